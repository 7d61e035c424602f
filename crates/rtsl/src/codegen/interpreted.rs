//! Methods on the interpreter, called like machine code.

use rtsl_abi::{
    CallArguments, CallError, CallMode, CallStatus, HostArguments, Layout, LeafArguments, Objects,
    Signature,
};
use rtsl_ir::host::Host;
use rtsl_ir::{Function, Interpreter, Outcome, PrepareError, Storage, VariableId, VariableKind};
use rtsl_packet::kernel::HIT_DISTANCE;

use super::lane_calls;
use super::lane_storage::{CallStorage, LaneStorage, LaneVariables};
use super::traced_method::Traced;

/// A method that runs ray by ray.
#[derive(Clone, Debug)]
pub(crate) struct InterpretedKernel {
    /// Copied for each call: each call needs registers, since hosts call kernels within calls.
    interpreter: Interpreter,
    variables: LaneVariables,
    /// The variable of `rt_HitDistance`.
    distance: Option<VariableId>,
    signature: Signature,
    traced: Option<Traced>,
}

impl InterpretedKernel {
    pub fn new(
        function: &Function,
        layout: &Layout,
        signature: Signature,
        traced: Option<Traced>,
    ) -> Result<InterpretedKernel, PrepareError> {
        let variables = LaneVariables::new(&function.variables, layout, &signature);
        let distance = function
            .variables
            .iter()
            .position(|variable| {
                variable.kind == VariableKind::State && variable.name == HIT_DISTANCE
            })
            .map(|index| VariableId(index as u32));
        let interpreter = match traced {
            Some(_) => Interpreter::prepare_observed(function)?,
            None => Interpreter::prepare(function)?,
        };
        Ok(InterpretedKernel { interpreter, variables, distance, signature, traced })
    }

    pub fn signature(&self) -> &Signature {
        &self.signature
    }

    /// Runs the method for all lanes of the call, in order.
    pub fn try_call(&self, call: CallArguments<'_>) -> Result<CallStatus, CallError> {
        self.signature.check(&call)?;
        lane_calls::check_stack()?;
        Ok(self.run(call))
    }

    /// Runs the method with checked arguments.
    fn run(&self, call: CallArguments<'_>) -> CallStatus {
        if self.signature.mode == CallMode::Leaf && self.signature.accepts {
            self.keep_nearest(call, 0)
        } else {
            self.store_each(call)
        }
    }

    /// Runs the method for all rays of a host's arrays, whose values it copies.
    pub fn call_host(&self, call: HostArguments<'_, '_>) -> Result<CallStatus, CallError> {
        lane_calls::with_copies(&self.signature, call, |call| self.run(call))
    }

    fn store_each(&self, call: CallArguments<'_>) -> CallStatus {
        let CallArguments { state, scratch, count, mask, accepted, instances, host } = call;
        // Only methods that accept hits write the mask.
        let accepted = accepted.filter(|_| self.signature.accepts);
        let mut storage = CallStorage::new(&self.variables, state, scratch, accepted, instances);
        let mut interpreter = self.interpreter.clone();
        let mut status = CallStatus::default();
        for lane in 0..count {
            let is_on = mask.is_none_or(|mask| mask.get(lane));
            let mut hit = false;
            if is_on {
                let outcome = self.run_lane(&mut interpreter, lane, &mut storage.lane(lane), host);
                status.budget_exhausted |= outcome.budget_exceeded;
                hit = outcome.accepted;
            }
            storage.accept(lane, hit);
        }
        status
    }

    /// Makes the tests of a call in the call mode `leaf`, one after another.
    pub fn make_tests(&self, call: LeafArguments<'_>, objects: &Objects) -> CallStatus {
        lane_calls::make_tests(&self.signature, call, objects, |call, ray| {
            self.keep_nearest(call, ray)
        })
    }

    /// Tests each object with the unchanged ray of a lane, and stores the outputs of the closest hit.
    fn keep_nearest(&self, call: CallArguments<'_>, ray: usize) -> CallStatus {
        let CallArguments { state, scratch, count, mask, accepted: _, instances, host } = call;
        let mut storage =
            CallStorage::of_ray(ray, &self.variables, state, scratch, None, instances);
        let mut interpreter = self.interpreter.clone();
        let mut status = CallStatus::default();
        let mut nearest: Option<Hit> = None;
        for lane in (0..count).filter(|lane| mask.is_none_or(|mask| mask.get(*lane))) {
            let mut held = HeldOutputs { inputs: storage.lane(lane), outputs: Vec::new() };
            let outcome = self.run_lane(&mut interpreter, lane, &mut held, host);
            status.budget_exhausted |= outcome.budget_exceeded;
            let hit =
                Hit { lane, distance: self.distance_of(&held.outputs), outputs: held.outputs };
            let is_nearer = nearest.as_ref().is_none_or(|nearest| hit.distance < nearest.distance);
            if outcome.accepted && is_nearer {
                nearest = Some(hit);
            }
        }
        if let Some(Hit { lane, distance: _, outputs }) = nearest {
            for (variable, component, bits) in outputs {
                storage.lane(ray).store(variable, component, bits);
            }
            status.nearest = instances.number(lane);
        }
        status
    }

    /// Runs the method for one lane, and traces it if there is a trace.
    fn run_lane(
        &self,
        interpreter: &mut Interpreter,
        lane: usize,
        storage: &mut impl Storage,
        host: &mut dyn Host,
    ) -> Outcome {
        match &self.traced {
            Some(traced) => traced.run(interpreter, lane as u32, storage, host),
            None => interpreter.run(lane as u32, storage, host),
        }
    }

    /// Returns the distance by which hits are compared; infinity for NaN.
    fn distance_of(&self, outputs: &[Output]) -> f32 {
        let distance = outputs.iter().find(|(variable, ..)| Some(*variable) == self.distance);
        let distance = distance.map_or(0.0, |(_, _, bits)| f32::from_bits(*bits));
        distance.min(f32::INFINITY)
    }
}

/// Variable, component and bits.
type Output = (VariableId, u32, u32);

/// A hit in the call mode `leaf`.
struct Hit {
    lane: usize,
    distance: f32,
    outputs: Vec<Output>,
}

/// The variables of a lane, with outputs held back until the closest hit is known.
struct HeldOutputs<'a, 'call> {
    inputs: LaneStorage<'a, 'call>,
    outputs: Vec<Output>,
}

impl Storage for HeldOutputs<'_, '_> {
    fn load(&self, variable: VariableId, index: u32) -> u32 {
        self.inputs.load(variable, index)
    }

    fn elements(&self, buffer: VariableId) -> u32 {
        self.inputs.elements(buffer)
    }

    fn store(&mut self, variable: VariableId, component: u32, bits: u32) {
        self.outputs.push((variable, component, bits));
    }
}
