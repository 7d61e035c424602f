//! Methods on the interpreter whose calls are recorded.

use std::collections::BTreeSet;

use rtsl_ir::class::ParameterType;
use rtsl_ir::host::Host;
use rtsl_ir::{
    Function, Interpreter, OpKind, Outcome, Scalar, Storage, VariableId, VariableKind, shown,
};

use super::trace::Trace;

/// A method with its trace.
#[derive(Clone, Debug)]
pub(crate) struct TracedMethod {
    trace: Trace,
    /// `Class.method`.
    name: String,
    /// The state that it reads.
    inputs: Vec<StateOfMethod>,
    /// The state that it sets.
    outputs: Vec<StateOfMethod>,
    has_accepted: bool,
}

/// A state variable of a method.
#[derive(Clone, Debug)]
struct StateOfMethod {
    variable: VariableId,
    name: String,
    components: u32,
}

impl TracedMethod {
    pub fn new(function: &Function, trace: Trace) -> TracedMethod {
        let mut read = BTreeSet::new();
        function.body.for_each_op(&mut |op| {
            if let OpKind::Load(variable, _) = op.kind {
                read.insert(variable);
            }
        });
        let written = function.outputs.iter().map(|output| output.variable).collect();
        let state = |variables: BTreeSet<VariableId>| {
            let variables = variables.into_iter().map(|id| (id, function.variable(id)));
            let state = variables.filter(|(_, it)| it.kind == VariableKind::State);
            let named = state.map(|(variable, it)| StateOfMethod {
                variable,
                name: it.name.clone(),
                components: it.len,
            });
            named.collect()
        };
        let is_accepted = |id: &VariableId| function.variable(*id).kind == VariableKind::Accepted;
        TracedMethod {
            has_accepted: BTreeSet::iter(&written).any(is_accepted),
            name: function.name.clone(),
            inputs: state(read),
            outputs: state(written),
            trace,
        }
    }

    /// Runs the method for one ray.
    pub fn run(
        &self,
        interpreter: &mut Interpreter,
        lane: u32,
        storage: &mut impl Storage,
        host: &mut dyn Host,
    ) -> Outcome {
        if !self.trace.is_on() {
            return interpreter.run(lane, storage, host);
        }
        let inputs = self
            .trace
            .has_calls()
            .then(|| values(&self.inputs, |it, component| storage.load(it.variable, component)));
        self.trace.begin_call(&self.name, lane, inputs.unwrap_or_default());
        let mut kept = KeptOutputs { storage, outputs: Vec::new() };
        let observer = &mut self.trace.observer(&self.name, lane);
        let outcome = interpreter.run_observed(lane, &mut kept, host, observer);
        let set = kept.outputs;
        let mut outputs = values(&self.outputs, |it, component| {
            let of = |(variable, index, _): &&(VariableId, u32, u32)| {
                *variable == it.variable && *index == component
            };
            set.iter().find(of).map_or(0, |(_, _, bits)| *bits)
        });
        if self.has_accepted {
            if !outcome.accepted {
                outputs.clear();
            }
            outputs.insert(0, ("hit".to_owned(), outcome.accepted.to_string()));
        }
        self.trace.end_call(&self.name, lane, outputs);
        outcome
    }
}

/// Formats the values of state variables.
fn values(
    state: &[StateOfMethod],
    bits: impl Fn(&StateOfMethod, u32) -> u32,
) -> Vec<(String, String)> {
    let values = state.iter().map(|it| {
        let words: Vec<u32> = (0..it.components).map(|component| bits(it, component)).collect();
        let ty = ParameterType::Vector(Scalar::F32, it.components.min(u8::MAX.into()) as u8);
        (it.name.clone(), shown(&ty, &words))
    });
    values.collect()
}

/// The storage of a call, whose outputs are kept for the trace.
struct KeptOutputs<'a, S> {
    storage: &'a mut S,
    /// Variable, component and bits.
    outputs: Vec<(VariableId, u32, u32)>,
}

impl<S: Storage> Storage for KeptOutputs<'_, S> {
    fn load(&self, variable: VariableId, index: u32) -> u32 {
        self.storage.load(variable, index)
    }

    fn elements(&self, buffer: VariableId) -> u32 {
        self.storage.elements(buffer)
    }

    fn store(&mut self, variable: VariableId, component: u32, bits: u32) {
        self.outputs.push((variable, component, bits));
        self.storage.store(variable, component, bits);
    }
}
