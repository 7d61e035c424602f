//! Values that nobody reads: a slot that is not live in the next stage, an operand where nothing is requested, and all
//! of a path that has not left yet.
//!
//! Where paths part, such a value may be anything, so it is chosen to be that of the other paths: then it needs no
//! `if`, and packets need no select for it. Before locals are promoted, [`mark`] stores a placeholder to every slot and
//! operand that the next stage does not read; after that, [`choose`] replaces the placeholders.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_ir::{
    Constant, Function, Index, IndexVec, Op, OpKind, Region, Scalar, Value, Values, Variable,
    VariableId, VariableKind,
};

use crate::emit::Draft;
use crate::{END, Port, Stage, Surface};

/// The greatest number of placeholders in a stage; beyond, values are as they come.
const MAX_MARKS: usize = 1 << 16;

/// The start of the names of the variables that placeholders are loaded from.
pub(crate) const PREFIX: &str = "#undefined.";

/// The placeholders of a function: one for `next`, and one for each type of other ports.
#[derive(Default)]
pub(crate) struct Placeholders {
    values: BTreeMap<Option<Scalar>, Value>,
}

impl Placeholders {
    /// Returns the constants that take the places of those that remain. A `next` that remains is not used.
    fn constants(&self) -> BTreeMap<Value, Constant> {
        let constant = |scalar: &Option<Scalar>| scalar.map_or(Constant::I32(END), Constant::zero);
        self.values.iter().map(|(scalar, value)| (*value, constant(scalar))).collect()
    }
}

/// Stores placeholders where a draft leaves to a stage that does not read a slot or an operand.
pub(crate) fn mark(draft: &mut Draft, stages: &[Stage]) -> Placeholders {
    let mut placeholders = Placeholders::default();
    let (mut constants, mut exits) = (BTreeMap::new(), 0);
    draft.function.body.for_each_op(&mut |op| match op.kind {
        OpKind::Constant(Constant::I32(constant)) => {
            constants.insert(op.results.get(0), constant);
        }
        OpKind::Loop { .. } => exits += 1,
        _ => exits += usize::from(is_exit(draft, op)),
    });
    if exits * draft.ports.len() > MAX_MARKS {
        return placeholders;
    }
    let mut start = Vec::new();
    let kinds = draft.ports.iter().map(|(local, port)| kind(&draft.function, *local, *port));
    for kind in kinds.collect::<BTreeSet<Option<Scalar>>>() {
        let name = format!("{PREFIX}{}", kind.map_or("next", Scalar::name));
        let scalar = kind.unwrap_or(Scalar::I32);
        let variable = Variable { kind: VariableKind::Scratch, name, scalar, len: 1 };
        let variable = draft.function.intern_variable(variable);
        let load = OpKind::Load(variable, Index::Constant(0));
        placeholders.values.insert(kind, draft.function.push(&mut start, scalar, load));
    }
    let mut body = std::mem::take(&mut draft.function.body);
    // A placeholder takes the place of the first, which is for paths that have not left.
    if let Some(first) = body.ops.iter().position(|op| is_exit(draft, op)) {
        body.ops.remove(first);
    }
    let marking = Marking { draft, stages, constants, placeholders: &placeholders };
    marking.region(&mut body);
    marking.entry(&mut start);
    body.ops.splice(0..0, start);
    draft.function.body = body;
    placeholders
}

struct Marking<'a> {
    draft: &'a Draft,
    stages: &'a [Stage],
    constants: BTreeMap<Value, i32>,
    placeholders: &'a Placeholders,
}

impl Marking<'_> {
    fn region(&self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            op.kind.regions_mut().for_each(|region| self.region(region));
            match &mut op.kind {
                OpKind::Store(local, _, next) if *local == self.draft.next => {
                    let next = self.constants.get(next);
                    let next = next.and_then(|next| self.stages.get(usize::try_from(*next).ok()?));
                    self.exit(next, &mut ops);
                }
                OpKind::Loop { body, .. } if self.leaves(body) => {
                    let mut start = Vec::new();
                    self.entry(&mut start);
                    body.ops.splice(0..0, start);
                }
                _ => {}
            }
            ops.push(op);
        }
        region.ops = ops;
    }

    fn leaves(&self, region: &Region) -> bool {
        let mut leaves = false;
        region.for_each_op(&mut |op| leaves |= is_exit(self.draft, op));
        leaves
    }

    /// Appends stores to all ports, for paths that have not left.
    fn entry(&self, ops: &mut Vec<Op>) {
        self.store(|_| true, ops);
    }

    /// Appends stores to the ports that the next stage does not read.
    fn exit(&self, next: Option<&Stage>, ops: &mut Vec<Op>) {
        let is_read = |port| next.is_some_and(|stage| is_read(stage, port));
        self.store(|port| port != Port::Next && !is_read(port), ops);
    }

    fn store(&self, is_stored: impl Fn(Port) -> bool, ops: &mut Vec<Op>) {
        for (local, port) in self.draft.ports.iter().filter(|(_, port)| is_stored(**port)) {
            let value = self.placeholders.values[&kind(&self.draft.function, *local, *port)];
            let kind = OpKind::Store(*local, Index::Constant(0), value);
            ops.push(Op { results: Values::default(), precise: false, kind });
        }
    }
}

/// Returns the kind of placeholder for a port, which has this local.
fn kind(function: &Function, local: VariableId, port: Port) -> Option<Scalar> {
    (port != Port::Next).then(|| function.variable(local).scalar)
}

/// True for the operation that ends a path's way through a draft.
fn is_exit(draft: &Draft, op: &Op) -> bool {
    matches!(op.kind, OpKind::Store(local, ..) if local == draft.next)
}

/// True if a stage, or the answer to the request that it waits for, depends on a port.
fn is_read(stage: &Stage, port: Port) -> bool {
    match port {
        Port::Frame(slot) => stage.live.binary_search(&slot).is_ok(),
        Port::Request(index) => stage.resumed_by.request().contains(&index),
        Port::Surface(_) => stage.surface == Surface::Request,
        Port::Answer(_) | Port::Next => false,
    }
}

/// Replaces the placeholders by values that make the code simpler.
pub(crate) fn choose(function: &mut Function, placeholders: &Placeholders) {
    let placeholders = placeholders.constants();
    if placeholders.is_empty() {
        return;
    }
    let mut body = std::mem::take(&mut function.body);
    let count = function.values.len();
    let mut choice = Choice {
        placeholders: &placeholders,
        visible: IndexVec::filled(count, false),
        substitutes: IndexVec::filled(count, None),
    };
    choice.region(&mut body);
    for op in body.ops.iter_mut().filter(|op| op.results.count == 1) {
        if let Some(constant) = placeholders.get(&op.results.get(0)) {
            op.kind = OpKind::Constant(*constant);
        }
    }
    function.body = body;
    // The variables of placeholders came last.
    while function.variables.last().is_some_and(|last| last.name.starts_with(PREFIX)) {
        function.variables.pop();
    }
}

struct Choice<'a> {
    placeholders: &'a BTreeMap<Value, Constant>,
    visible: IndexVec<Value, bool>,
    substitutes: IndexVec<Value, Option<Value>>,
}

impl Choice<'_> {
    fn region(&mut self, region: &mut Region) {
        self.set_visible(region, true);
        for op in &mut region.ops {
            op.kind.for_each_operand_mut(|value| *value = self.get(*value));
            op.kind.regions_mut().for_each(|region| self.region(region));
            op.results.iter().for_each(|value| self.visible[value] = true);
            match &op.kind {
                OpKind::If { then, otherwise, .. } => {
                    let sides = then.yields.iter().zip(&otherwise.yields);
                    for (result, (a, b)) in op.results.iter().zip(sides) {
                        self.substitutes[result] = self.either(*a, *b);
                    }
                }
                // The result is what the last iteration yields.
                OpKind::Loop { body, .. } => {
                    for (result, value) in op.results.iter().zip(&body.yields[1..]) {
                        self.substitutes[result] = self.visible[*value].then_some(*value);
                    }
                }
                _ => {}
            }
        }
        region.yields.iter_mut().for_each(|value| *value = self.get(*value));
        self.set_visible(region, false);
    }

    /// Shows the parameters of a region, or hides all values that it defines.
    fn set_visible(&mut self, region: &Region, visible: bool) {
        region.params.iter().for_each(|value| self.visible[*value] = visible);
        if !visible {
            let results = region.ops.iter().flat_map(|op| op.results.iter());
            results.for_each(|value| self.visible[value] = false);
        }
    }

    /// Returns the value that both sides of an `if` may yield.
    fn either(&self, a: Value, b: Value) -> Option<Value> {
        let chosen = match [a, b].map(|value| self.placeholders.contains_key(&value)) {
            [true, _] => b,
            [false, true] => a,
            [false, false] if a == b => a,
            [false, false] => return None,
        };
        self.visible[chosen].then_some(chosen)
    }

    fn get(&self, value: Value) -> Value {
        self.substitutes[value].unwrap_or(value)
    }
}
