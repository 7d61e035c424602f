//! Calls of kernels that can be repeated.

use rtsl::{
    CallArguments, Instances, Kernel, LaneBlock, LaneMask, LinkedMethod, PacketKernel, PacketRun,
};

use super::host::BenchHost;
use super::inputs::Inputs;

/// A call with memory of its own, which is put back to what was given before each repetition.
pub struct Call {
    given: Inputs,
    current: Inputs,
    accepted: LaneMask,
    /// State arrays that the method both reads and sets.
    changed_state: Vec<usize>,
    changes_scratch: bool,
}

impl Call {
    /// A call of `method` with these inputs.
    pub fn new(method: &LinkedMethod, given: Inputs) -> Call {
        let changed = method.writes.iter().filter(|variable| method.reads.contains(variable));
        let arrays = changed.flat_map(|variable| {
            let first = variable.first_component as usize;
            first..first + variable.ty.components() as usize
        });
        Call {
            accepted: LaneMask::new(given.lanes()),
            changed_state: arrays.collect(),
            changes_scratch: method.reads_scratch && method.sets_scratch,
            current: given.clone(),
            given,
        }
    }

    /// How many rays.
    pub fn lanes(&self) -> usize {
        self.given.lanes()
    }

    /// Whether a second call would see what the first one left.
    pub fn changes_in_place(&self) -> bool {
        self.changes_scratch || !self.changed_state.is_empty()
    }

    /// Undoes what calls changed in place. Other arrays stay as they are, in the cache or out of it.
    pub fn restore(&mut self) {
        for &array in &self.changed_state {
            copy_array(&mut self.current.state, &self.given.state, array);
        }
        if self.changes_scratch {
            for array in 0..self.given.scratch.components() {
                copy_array(&mut self.current.scratch, &self.given.scratch, array);
            }
        }
    }

    /// Calls the kernel.
    pub fn run(&mut self, kernel: &Kernel, instances: Instances<'_>) {
        let _ = kernel.call(arguments(
            &mut self.current,
            &mut self.accepted,
            instances,
            &mut BenchHost,
        ));
    }
}

fn copy_array(to: &mut LaneBlock, from: &LaneBlock, array: usize) {
    to.words_mut(array).copy_from_slice(from.words(array));
}

/// Runs packet code for these inputs and counts what it does.
pub fn count(
    kernel: &PacketKernel,
    instances: Instances<'_>,
    inputs: &Inputs,
    round_limit: u64,
) -> PacketRun {
    let mut accepted = LaneMask::new(inputs.lanes());
    let mut inputs = inputs.clone();
    let mut host = BenchHost;
    let call = arguments(&mut inputs, &mut accepted, instances, &mut host);
    kernel.run(call, round_limit)
}

fn arguments<'a>(
    inputs: &'a mut Inputs,
    accepted: &'a mut LaneMask,
    instances: Instances<'a>,
    host: &'a mut BenchHost,
) -> CallArguments<'a> {
    CallArguments {
        count: inputs.lanes(),
        state: &mut inputs.state,
        scratch: &mut inputs.scratch,
        mask: None,
        accepted: Some(accepted),
        instances,
        host,
    }
}
