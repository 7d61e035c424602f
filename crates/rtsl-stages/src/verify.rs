//! The verifier of stages: what the runtime, linkers and backends rely on.
//!
//! # Invariants
//!
//! 1. Every function of a stage is a verified function.
//! 2. The first stage, and no other, is resumed by the start; it has no live slots.
//! 3. Live slots exist, and are listed once each in ascending order.
//! 4. The variables of the interface have the types that the slots and events give them.
//! 5. A stage loads, of the interface, only live slots, answers, and the surface if it has one by request; it stores
//!    only slots, requests, surfaces and `next`.
//! 6. Stages after the first load state and scratch of the integrator's function only where they store it.
//! 7. `next` is an output, and one of several constants: [`END`], or the index of a stage after the first.
//! 8. A slot that is live in a stage is, in every stage that names it as the next, live or stored.
//! 9. A stage that names another as the next stores the operands of its request, and the surface if it has one by
//!    request.
//! 10. No stage waits for the renderer, and all queries about surfaces are about the surface of the stage.
//!
//! That slots are stored on every single way to a suspension is checked where stages are made.

use std::collections::BTreeSet;

use rtsl_ir::{
    Constant, Function, Index, IndexVec, Op, OpKind, Scalar, Value, Variable, VariableId,
    VariableKind,
};

use crate::points::{definitions, queried_surface};
use crate::{END, Port, ResumedBy, SlotId, Stage, Stages, Surface};

/// A violated invariant.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{stage}: {message}")]
pub struct VerifyError {
    /// The name of the stage's function, or of the integrator's.
    pub stage: String,
    /// The violation.
    pub message: String,
}

type Definitions<'a> = IndexVec<Value, Option<&'a Op>>;

type Result<T = (), E = String> = std::result::Result<T, E>;

/// Checks all invariants. The error names the first violation.
pub fn verify(stages: &Stages) -> Result<(), VerifyError> {
    let error = |stage: &str, message| VerifyError { stage: stage.to_owned(), message };
    if stages.stages.is_empty() {
        return Err(error(&stages.name, "there is no stage".to_owned()));
    }
    let check = |(index, stage)| Check { stages, stage, is_first: index == 0 };
    let checks = || stages.stages.iter().enumerate().map(check);
    let named = |check: &Check<'_>, result: Result| {
        result.map_err(|message| error(&check.stage.function.name, message))
    };
    // Stages refer to the heads of others.
    checks().try_for_each(|check| named(&check, check.head()))?;
    checks().try_for_each(|check| named(&check, check.body()))
}

struct Check<'a> {
    stages: &'a Stages,
    stage: &'a Stage,
    is_first: bool,
}

impl Check<'_> {
    fn head(&self) -> Result {
        self.start()?;
        self.live()
    }

    fn body(&self) -> Result {
        rtsl_ir::verify::verify(self.function()).map_err(|error| error.to_string())?;
        self.function().variables.iter().try_for_each(|variable| self.variable(variable))?;
        self.operations()?;
        self.outputs()?;
        self.next()?.into_iter().try_for_each(|next| self.successor(next))
    }

    fn function(&self) -> &Function {
        &self.stage.function
    }

    fn start(&self) -> Result {
        let is_start = self.stage.resumed_by == ResumedBy::Start;
        if is_start != self.is_first {
            return Err("the first stage, and no other, is resumed by the start".to_owned());
        }
        let fits = match self.stage.surface {
            Surface::None => true,
            Surface::Answer => self.stage.resumed_by == ResumedBy::NearestHit,
            Surface::Request => {
                !matches!(self.stage.resumed_by, ResumedBy::Start | ResumedBy::NearestHit)
            }
        };
        let (event, surface) = (self.stage.resumed_by.name(), self.stage.surface.name());
        let message = || format!("resumed by {event}, its surface cannot be `{surface}`");
        fits.then_some(()).ok_or_else(message)
    }

    fn live(&self) -> Result {
        let live = &self.stage.live;
        if self.is_first && !live.is_empty() {
            return Err("slots are live at the start".to_owned());
        }
        if !live.is_sorted_by(|a, b| a < b) {
            return Err("live slots are not in ascending order".to_owned());
        }
        live.last().map_or(Ok(()), |last| self.slot(*last).map(|_| ()))
    }

    fn slot(&self, slot: SlotId) -> Result<Scalar> {
        let found = self.stages.slots.get(slot.0 as usize);
        found.map(|slot| slot.scalar).ok_or_else(|| format!("there is no slot {}", slot.0))
    }

    fn variable(&self, variable: &Variable) -> Result {
        let Some(port) = Port::of(variable) else { return Ok(()) };
        let expected = match port {
            Port::Frame(slot) => Some(self.slot(slot)?),
            Port::Answer(index) => self.stage.resumed_by.answers().get(index as usize).copied(),
            Port::Request(index) => {
                (index < crate::MAX_REQUEST).then_some(Port::request_scalar(index))
            }
            Port::Surface(index) => (index < 3).then_some(Scalar::I32),
            Port::Next => Some(Scalar::I32),
        };
        let fits = expected == Some(variable.scalar) && variable.len == 1;
        let Variable { name, scalar, len, .. } = variable;
        let message = || format!("scratch `{name}` cannot be {}[{len}]", scalar.name());
        fits.then_some(()).ok_or_else(message)
    }

    fn operations(&self) -> Result {
        let mut result = Ok(());
        let mut surface = None;
        let definitions = definitions(self.function());
        self.function().body.for_each_op(&mut |op| {
            if result.is_ok() {
                result = self.operation(op, &definitions, &mut surface);
            }
        });
        result
    }

    /// Checks an operation. `surface` is that of the queries so far.
    fn operation(
        &self,
        op: &Op,
        definitions: &Definitions<'_>,
        surface: &mut Option<[Value; 3]>,
    ) -> Result {
        if let Some(event) = ResumedBy::of(&op.kind) {
            return Err(format!("it waits for {}", event.name()));
        }
        if let OpKind::Load(variable, _) = op.kind {
            self.load(variable)?;
        }
        let Some(queried) = queried_surface(&op.kind) else { return Ok(()) };
        let port = |value| self.port(value, definitions);
        let fits = match self.stage.surface {
            Surface::None => false,
            Surface::Answer => {
                (1..).zip(queried).all(|(index, it)| port(it) == Some(Port::Answer(index)))
            }
            Surface::Request => {
                let is_named = |it| matches!(port(it), Some(Port::Surface(_)));
                *surface.get_or_insert(queried) == queried && queried.into_iter().all(is_named)
            }
        };
        let message = || "a query is about another surface than that of the stage".to_owned();
        fits.then_some(()).ok_or_else(message)
    }

    fn load(&self, id: VariableId) -> Result {
        let variable = self.function().variable(id);
        let is_allowed = match (Port::of(variable), variable.kind) {
            (Some(Port::Frame(slot)), _) => self.stage.live.contains(&slot),
            (Some(Port::Answer(_)), _) => true,
            (Some(Port::Surface(_)), _) => self.stage.surface == Surface::Request,
            (Some(Port::Request(_) | Port::Next), _) => false,
            (None, VariableKind::State | VariableKind::Scratch) => {
                let mut outputs = self.function().outputs.iter();
                self.is_first || outputs.any(|output| output.variable == id)
            }
            (None, _) => true,
        };
        let (kind, name) = (variable.kind.name(), &variable.name);
        let message = || format!("{kind} `{name}` has no value when the stage is resumed");
        is_allowed.then_some(()).ok_or_else(message)
    }

    /// Returns the port that a value is loaded from.
    fn port(&self, value: Value, definitions: &Definitions<'_>) -> Option<Port> {
        let op = definitions.get(value).copied().flatten()?;
        let OpKind::Load(variable, Index::Constant(0)) = op.kind else { return None };
        Port::of(self.function().variable(variable))
    }

    fn outputs(&self) -> Result {
        match self.stage.stored().find(|port| matches!(port, Port::Answer(_))) {
            Some(port) => Err(format!("it stores `{}`", port.name())),
            None => Ok(()),
        }
    }

    /// Returns the values that `next` may have.
    fn next(&self) -> Result<BTreeSet<i32>> {
        let outputs = self.function().outputs.iter().zip(&self.function().body.yields);
        let mut ports = outputs.map(|(it, value)| (self.function().variable(it.variable), value));
        let next = ports.find(|(variable, _)| Port::of(variable) == Some(Port::Next));
        let (_, next) = next.ok_or("it does not store `next`")?;
        let sources = Sources::new(self.function());
        let mut constants = BTreeSet::new();
        sources.constants(*next, &mut constants)?;
        Ok(constants)
    }

    /// Checks a value of `next`.
    fn successor(&self, next: i32) -> Result {
        if next == END {
            return Ok(());
        }
        let found = usize::try_from(next).ok().filter(|index| *index > 0);
        let Some(other) = found.and_then(|index| self.stages.stages.get(index)) else {
            return Err(format!("`next` names stage {next}, which there is not"));
        };
        let stored: BTreeSet<Port> = self.stage.stored().collect();
        let missing = |slot: &&SlotId| {
            !stored.contains(&Port::Frame(**slot)) && !self.stage.live.contains(slot)
        };
        if let Some(slot) = other.live.iter().find(missing) {
            return Err(format!("slot {}, which is live in stage {next}, has no value", slot.0));
        }
        let request = other.resumed_by.request().iter().map(|port| Port::Request(*port));
        let surface = (0..3).map(Port::Surface).filter(|_| other.surface == Surface::Request);
        match request.chain(surface).find(|port| !stored.contains(port)) {
            Some(port) => Err(format!("it does not store `{}` for stage {next}", port.name())),
            None => Ok(()),
        }
    }
}

/// The values from which each value may be taken.
struct Sources {
    constants: IndexVec<Value, Option<i32>>,
    of: IndexVec<Value, Vec<Value>>,
}

impl Sources {
    fn new(function: &Function) -> Sources {
        let count = function.values.len();
        let constants = IndexVec::filled(count, None);
        let mut sources = Sources { constants, of: IndexVec::filled(count, Vec::new()) };
        function.body.for_each_op(&mut |op| match &op.kind {
            OpKind::Constant(Constant::I32(constant)) => {
                sources.constants[op.results.get(0)] = Some(*constant);
            }
            OpKind::Select(_, a, b) => sources.of[op.results.get(0)].extend([*a, *b]),
            OpKind::If { then, otherwise, .. } => {
                for (result, sides) in
                    op.results.iter().zip(then.yields.iter().zip(&otherwise.yields))
                {
                    sources.of[result].extend([*sides.0, *sides.1]);
                }
            }
            OpKind::Loop { initial, body } => {
                let carried = initial.iter().zip(&body.params).zip(&body.yields[1..]);
                for (result, ((first, param), next)) in op.results.iter().zip(carried) {
                    sources.of[result].push(*next);
                    sources.of[*param].extend([*first, *next]);
                }
            }
            _ => {}
        });
        sources
    }

    /// Adds the constants that a value may be.
    fn constants(&self, value: Value, found: &mut BTreeSet<i32>) -> Result {
        let (mut pending, mut seen) = (vec![value], BTreeSet::new());
        while let Some(value) = pending.pop() {
            if !seen.insert(value) {
                continue;
            }
            match self.constants[value] {
                Some(constant) => {
                    found.insert(constant);
                }
                None if self.of[value].is_empty() => {
                    return Err("`next` is not one of several constants".to_owned());
                }
                None => pending.extend(&self.of[value]),
            }
        }
        Ok(())
    }
}
