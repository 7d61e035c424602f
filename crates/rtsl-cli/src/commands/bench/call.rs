//! Repeatable kernel calls.

use rtsl::{
    CallArguments, Instances, Kernel, LaneBlock, LaneMask, LinkedMethod, PacketKernel, PacketRun,
};

use super::host::BenchHost;
use super::inputs::Inputs;

/// A call with separate memory, which is restored before each repetition.
pub struct Call {
    given: Inputs,
    current: Inputs,
    accepted: LaneMask,
    /// State arrays that the method both reads and sets.
    changed_state: Vec<usize>,
    changes_scratch: bool,
}

impl Call {
    /// Creates a call of `method` with these inputs.
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

    /// Returns the number of rays.
    pub fn lanes(&self) -> usize {
        self.given.lanes()
    }

    /// True if a second call would read values that the first one changed.
    pub fn changes_in_place(&self) -> bool {
        self.changes_scratch || !self.changed_state.is_empty()
    }

    /// Restores arrays that calls change in place. Other arrays are not touched and keep their place in caches.
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

/// Interprets packet code for these inputs and counts its operations.
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
