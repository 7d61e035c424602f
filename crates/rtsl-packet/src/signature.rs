//! The signature of a kernel, against which calls of its code are checked.

use std::sync::Arc;

use rtsl_abi::{BufferEntry, ComponentSet, Signature, offsets};
use rtsl_ir::{Index, VariableKind};

use crate::kernel::{Kernel, KernelVariable, OpKind, Region};

impl Kernel {
    /// Returns the requirements on calls of the kernel.
    pub fn signature(&self) -> Signature {
        let variables = |kind| self.variables.iter().filter(move |it| it.variable.kind == kind);
        let end =
            |variable: &KernelVariable| variable.location.saturating_add(variable.variable.len);
        let buffers = |of_objects| -> Arc<[BufferEntry]> {
            let buffers = variables(VariableKind::Buffer).filter(|it| it.of_objects == of_objects);
            let entry = |it: &KernelVariable| BufferEntry {
                offset: it.location,
                element_words: it.variable.len,
            };
            buffers.map(entry).collect()
        };
        let (buffers, object_buffers) = (buffers(false), buffers(true));
        let entry_ends = buffers.iter().map(|it| it.offset.saturating_add(offsets::BUFFER_WORDS));
        let members = variables(VariableKind::Member).filter(|it| !it.of_objects).map(end);
        Signature {
            state: state_components(self),
            scratch_arrays: variables(VariableKind::Scratch).map(end).max().unwrap_or(0),
            block_words: members.chain(entry_ends).max().unwrap_or(0),
            buffers,
            object_words: self.object_words,
            object_blocks: self.object_blocks,
            object_buffers,
            mode: self.mode,
            accepts: self.accepted_output().is_some(),
        }
    }
}

/// Returns the state components that a kernel loads or stores.
fn state_components(kernel: &Kernel) -> ComponentSet {
    let mut components = ComponentSet::default();
    add_loaded(kernel, &kernel.prologue, &mut components);
    add_loaded(kernel, &kernel.body, &mut components);
    for output in &kernel.outputs {
        let variable = kernel.variable(output.variable);
        if variable.variable.kind == VariableKind::State {
            components.insert(variable.location + output.component);
        }
    }
    components
}

fn add_loaded(kernel: &Kernel, region: &Region, components: &mut ComponentSet) {
    for op in &region.ops {
        if let OpKind::Load(id, index) = &op.kind
            && kernel.variable(*id).variable.kind == VariableKind::State
        {
            let variable = kernel.variable(*id);
            match index {
                Index::Constant(index) => components.insert(variable.location + index),
                Index::Dynamic(_) => {
                    (0..variable.variable.len)
                        .for_each(|it| components.insert(variable.location + it));
                }
            }
        }
        op.kind.regions().for_each(|region| add_loaded(kernel, region, components));
    }
}
