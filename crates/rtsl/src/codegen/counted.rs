//! Methods on the interpreter that counts their work, called like machine code.

use rtsl_abi::{
    CallArguments, CallError, CallStatus, HostArguments, LeafArguments, Objects, Signature,
};

use super::lane_calls;
use super::line_costs::{KernelCosts, LineCosts};
use super::packet_kernel::{PacketKernel, PacketRun};

/// Packet code whose work a [record of costs](LineCosts) has.
#[derive(Clone, Debug)]
pub(crate) struct CountedKernel {
    packets: PacketKernel,
    costs: KernelCosts,
}

impl CountedKernel {
    pub fn new(packets: PacketKernel, costs: &LineCosts) -> CountedKernel {
        let costs = costs.of_kernel(packets.sources());
        CountedKernel { packets, costs }
    }

    pub fn signature(&self) -> &Signature {
        self.packets.signature()
    }

    /// Runs the method for all lanes of the call.
    pub fn try_call(&self, call: CallArguments<'_>) -> Result<CallStatus, CallError> {
        self.signature().check(&call)?;
        lane_calls::check_stack()?;
        Ok(self.run(call, 0))
    }

    /// Runs the method for all rays of a host's arrays, whose values it copies.
    pub fn call_host(&self, call: HostArguments<'_, '_>) -> Result<CallStatus, CallError> {
        lane_calls::with_copies(self.signature(), call, |call| self.run(call, 0))
    }

    /// Makes the tests of a call in the call mode `leaf`, one after another.
    pub fn make_tests(&self, call: LeafArguments<'_>, objects: &Objects) -> CallStatus {
        lane_calls::make_tests(self.signature(), call, objects, |call, ray| self.run(call, ray))
    }

    /// Runs the method with checked arguments.
    fn run(&self, call: CallArguments<'_>, ray: usize) -> CallStatus {
        // Methods of texts that are not trusted have a budget of iterations of their own.
        let PacketRun { status, profile, .. } = self.packets.run_checked(call, ray, u64::MAX);
        self.costs.add(&profile.lines);
        status
    }
}
