//! A method's packet code, to be run and counted.

use rtsl_abi::{CallArguments, CallStatus, Layout, Signature};
use rtsl_packet::Profile;
use rtsl_packet::interpreter::{self, Rays};

use super::lane_storage::{CallStorage, LaneVariables};

/// A method's packet code. It is called as machine code is, gives the same bits, takes far
/// longer, and says what it did.
#[derive(Clone, Debug)]
pub struct PacketKernel {
    packet: rtsl_packet::Kernel,
    variables: LaneVariables,
    signature: Signature,
}

/// How a run of packet code ended.
#[derive(Clone, Debug, PartialEq, Eq)]
#[must_use]
pub struct PacketRun {
    /// As of machine code.
    pub status: CallStatus,
    /// The limit of rounds ended it; what it gave means nothing.
    pub cut_short: bool,
    /// What it did.
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
        PacketKernel { packet, variables, signature }
    }

    /// Runs the method for all rays of the call, until it is done or its loops went round
    /// `round_limit` times, all together.
    ///
    /// # Panics
    /// If the arguments' sizes do not fit the kernel.
    pub fn run(&self, call: CallArguments<'_>, round_limit: u64) -> PacketRun {
        if let Err(error) = self.signature.check(&call) {
            error.refuse();
        }
        let CallArguments { state, scratch, count, mask, accepted, instances, host } = call;
        let mut storage = CallStorage::new(&self.variables, state, scratch, accepted, instances);
        let is_on = |ray: u32| mask.is_none_or(|mask| mask.get(ray as usize));
        let rays = Rays { count: count as u32, is_on: &is_on, round_limit };
        let outcome = interpreter::run(&self.packet, rays, &mut storage, host);
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
