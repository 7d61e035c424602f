//! Methods on the interpreter whose calls are recorded.

use std::collections::BTreeSet;

use std::sync::Arc;

use rtsl_ir::class::ParameterType;
use rtsl_ir::host::Host;
use rtsl_ir::{
    EventValue, Function, Interpreter, OpKind, Outcome, Scalar, Storage, ValueScope, VariableId,
    VariableKind,
};
use rtsl_link::reported_calls::{event_value, is_recorded, known_at_reads};

use super::recording::TracedValue;
use super::trace::Trace;

/// A function with its trace.
#[derive(Clone, Debug)]
pub(crate) enum Traced {
    /// A method, each of whose runs is a call by a host.
    Method(TracedMethod),
    /// A function that reports the calls of the methods in it.
    Linked(Trace),
}

impl Traced {
    /// Returns a method with its trace.
    pub fn method(function: &Function, trace: Trace) -> Traced {
        trace.prepare(function);
        Traced::Method(TracedMethod::new(function, trace))
    }

    /// Returns a function that reports the calls of the methods in it.
    pub fn linked(function: &Function, trace: Trace) -> Traced {
        trace.prepare(function);
        Traced::Linked(trace)
    }

    /// Runs the function for one ray.
    pub fn run(
        &self,
        interpreter: &mut Interpreter,
        lane: u32,
        storage: &mut impl Storage,
        host: &mut dyn Host,
    ) -> Outcome {
        match self {
            Traced::Method(method) => method.run(interpreter, lane, storage, host),
            Traced::Linked(trace) if trace.is_on() => {
                interpreter.run_observed(lane, storage, host, &mut trace.observer(None, lane))
            }
            Traced::Linked(_) => interpreter.run(lane, storage, host),
        }
    }
}

/// A method with its trace.
#[derive(Clone, Debug)]
pub(crate) struct TracedMethod {
    trace: Trace,
    /// `Class.method`.
    name: Arc<str>,
    /// The state that it reads.
    inputs: Vec<HostVariable>,
    /// The members that it reads.
    members: Vec<HostVariable>,
    /// The state that it sets.
    outputs: Vec<HostVariable>,
    has_accepted: bool,
}

/// A variable in the memory of the host.
#[derive(Clone, Debug)]
struct HostVariable {
    id: VariableId,
    components: u32,
    value: Arc<EventValue>,
}

impl TracedMethod {
    fn new(function: &Function, trace: Trace) -> TracedMethod {
        let mut read = BTreeSet::new();
        function.body.for_each_op(&mut |op| {
            if let OpKind::Load(variable, _) = op.kind {
                read.insert(variable);
            }
        });
        let written = function.outputs.iter().map(|output| output.variable).collect();
        let is_accepted = |id: &VariableId| function.variable(*id).kind == VariableKind::Accepted;
        TracedMethod {
            has_accepted: BTreeSet::iter(&written).any(is_accepted),
            name: function.name.as_str().into(),
            inputs: host_variables(function, &read, VariableKind::State),
            members: host_variables(function, &read, VariableKind::Member),
            outputs: host_variables(function, &written, VariableKind::State),
            trace,
        }
    }

    /// Runs the method for one ray.
    fn run(
        &self,
        interpreter: &mut Interpreter,
        lane: u32,
        storage: &mut impl Storage,
        host: &mut dyn Host,
    ) -> Outcome {
        if !self.trace.is_on() {
            return interpreter.run(lane, storage, host);
        }
        if self.trace.has_calls() {
            let load = |it: &HostVariable, component| storage.load(it.id, component);
            let (state, members) = (values(&self.inputs, load), values(&self.members, load));
            self.trace.begin_call(&self.name, lane, state, members);
        }
        let mut kept = KeptOutputs { storage, outputs: Vec::new() };
        let observer = &mut self.trace.observer(Some(&self.name), lane);
        let outcome = interpreter.run_observed(lane, &mut kept, host, observer);
        let set = kept.outputs;
        let mut outputs = values(&self.outputs, |it, component| {
            let of = |(variable, index, _): &&(VariableId, u32, u32)| {
                *variable == it.id && *index == component
            };
            set.iter().find(of).map_or(0, |(_, _, bits)| *bits)
        });
        if self.has_accepted {
            if !outcome.accepted {
                outputs.clear();
            }
            outputs.insert(0, hit(outcome.accepted));
        }
        self.trace.end_call(&self.name, lane, outputs);
        outcome
    }
}

/// The variables of a kind among those of a function that can be recorded.
fn host_variables(
    function: &Function,
    variables: &BTreeSet<VariableId>,
    kind: VariableKind,
) -> Vec<HostVariable> {
    let variables = variables.iter().map(|id| (*id, function.variable(*id)));
    let known_later = known_at_reads(function);
    let is_known = |name: &str| kind == VariableKind::Member && known_later.contains(name);
    let wanted = variables
        .filter(|(_, it)| it.kind == kind && is_recorded(&it.name, it.len) && !is_known(&it.name));
    let variable = |(id, it): (VariableId, &rtsl_ir::Variable)| HostVariable {
        id,
        components: it.len,
        value: Arc::new(event_value(it)),
    };
    wanted.map(variable).collect()
}

/// That a ray hits, as a value.
fn hit(accepted: bool) -> TracedValue {
    let ty = ParameterType::Scalar(Scalar::Bool);
    let variable = EventValue::new("hit", ty, ValueScope::State);
    TracedValue { variable: Arc::new(variable), words: [accepted.into()].into() }
}

/// Reads variables.
fn values(
    variables: &[HostVariable],
    bits: impl Fn(&HostVariable, u32) -> u32,
) -> Vec<TracedValue> {
    let value = |it: &HostVariable| TracedValue {
        variable: it.value.clone(),
        words: (0..it.components).map(|component| bits(it, component)).collect(),
    };
    variables.iter().map(value).collect()
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
