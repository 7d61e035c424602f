//! Methods on the interpreter, called as machine code is called.

use rtsl_ir::{Function, Interpreter, PrepareError};
use rtsl_jit::{CallArguments, CallStatus, Signature};
use rtsl_packet::Layout;

use crate::lane_storage::{CallStorage, LanePlaces};

/// A method, run ray by ray.
#[derive(Clone, Debug)]
pub(crate) struct InterpretedKernel {
    /// Copied for each call: a call needs registers of its own, since hosts call kernels from
    /// within calls.
    interpreter: Interpreter,
    places: LanePlaces,
    signature: Signature,
}

impl InterpretedKernel {
    pub fn new(
        function: &Function,
        layout: &Layout,
        signature: Signature,
    ) -> Result<InterpretedKernel, PrepareError> {
        let places = LanePlaces::new(&function.places, layout, signature.shape);
        Ok(InterpretedKernel { interpreter: Interpreter::prepare(function)?, places, signature })
    }

    pub fn signature(&self) -> &Signature {
        &self.signature
    }

    /// Runs the method for all rays of the call, in order.
    pub fn call(&self, call: CallArguments<'_>) -> CallStatus {
        self.signature.check(&call);
        let CallArguments { state, scratch, count, mask, accepted, instances, host } = call;
        let mut storage = CallStorage::new(&self.places, state, scratch, accepted, instances);
        let mut interpreter = self.interpreter.clone();
        let mut status = CallStatus::default();
        for lane in 0..count {
            let is_on = mask.is_none_or(|mask| mask.get(lane));
            let mut hit = false;
            if is_on {
                let outcome = interpreter.run(lane as u32, &mut storage.lane(lane), &mut *host);
                status.budget_exhausted |= outcome.budget_exceeded;
                hit = outcome.accepted;
            }
            storage.accept(lane, hit);
        }
        status
    }
}
