//! Packet code with an interpreter that counts its operations.

use std::sync::Arc;

use rtsl_abi::{CallArguments, CallStatus, Layout, Signature};
use rtsl_ir::Source;
use rtsl_packet::Profile;
use rtsl_packet::interpreter::{Interpreter, Rays};

use super::lane_storage::{CallStorage, LaneVariables};

/// A method's packet code on an interpreter. It is called like machine code and gives the same bits, takes far longer,
/// and counts its operations.
#[derive(Clone, Debug)]
pub struct PacketKernel {
    interpreter: Interpreter,
    variables: LaneVariables,
    signature: Signature,
}

/// The result of a run of packet code.
#[derive(Clone, Debug, PartialEq, Eq)]
#[must_use]
pub struct PacketRun {
    /// The status, as of machine code.
    pub status: CallStatus,
    /// True if the limit of iterations ended the run; then the stored values are meaningless.
    pub cut_short: bool,
    /// The counts.
    pub profile: Profile,
}

impl PacketKernel {
    pub(crate) fn new(
        packet: rtsl_packet::Kernel,
        layout: &Layout,
        signature: Signature,
    ) -> PacketKernel {
        let variables: Vec<_> =
            packet.variables.iter().map(|variable| variable.variable.clone()).collect();
        let variables = LaneVariables::new(&variables, layout, &signature);
        PacketKernel { interpreter: Interpreter::new(packet), variables, signature }
    }

    pub(crate) fn signature(&self) -> &Signature {
        &self.signature
    }

    /// The texts of the lines in the counts.
    pub(crate) fn sources(&self) -> &[Arc<Source>] {
        self.interpreter.kernel().places.sources()
    }

    /// Runs the method for all rays of the call. The run ends after `round_limit` loop iterations, all loops taken
    /// together.
    ///
    /// # Panics
    /// If the arguments' sizes do not fit the kernel.
    pub fn run(&self, call: CallArguments<'_>, round_limit: u64) -> PacketRun {
        if let Err(error) = self.signature.check(&call) {
            error.refuse();
        }
        self.run_checked(call, 0, round_limit)
    }

    /// Runs the method with checked arguments. In the call mode `leaf` all lanes share the ray of the lane `ray`, which
    /// is 0 in others.
    pub(crate) fn run_checked(
        &self,
        call: CallArguments<'_>,
        ray: usize,
        round_limit: u64,
    ) -> PacketRun {
        let CallArguments { state, scratch, count, mask, accepted, instances, host } = call;
        let mut storage =
            CallStorage::of_ray(ray, &self.variables, state, scratch, accepted, instances);
        let is_on = |lane: u32| mask.is_none_or(|mask| mask.get(lane as usize));
        let rays = Rays { count: count as u32, is_on: &is_on, round_limit };
        let outcome = self.interpreter.run(rays, &mut storage, host);
        PacketRun {
            status: CallStatus {
                budget_exhausted: outcome.budget_exceeded,
                nearest: outcome.nearest.and_then(|lane| instances.number(lane as usize)),
            },
            cut_short: outcome.cut_short,
            profile: outcome.profile,
        }
    }
}
