//! The values that have tangents: those that depend on the seed and that a derivative depends on.

use std::collections::BTreeSet;

use rtsl_ir::{
    BinaryOp, Function, Op, OpKind, Region, Scalar, UnaryOp, Value, VariableId, VariableKind,
};

/// The values of a range of operations that have tangents.
#[derive(Debug, Default)]
pub struct Dependence {
    /// Values that depend on the seed.
    active: BTreeSet<Value>,
    /// Values that a wanted derivative depends on.
    needed: BTreeSet<Value>,
    active_locals: BTreeSet<VariableId>,
    needed_locals: BTreeSet<VariableId>,
    changed: bool,
}

impl Dependence {
    /// Finds the values between a seed and the wanted values that depend on it.
    pub fn new(function: &Function, range: &[Op], seed: Value, wanted: &[Value]) -> Dependence {
        let mut dependence = Dependence::default();
        dependence.active.insert(seed);
        dependence.needed.extend(wanted);
        dependence.until_stable(|it| it.activate(function, range));
        dependence.until_stable(|it| it.require(function, range));
        dependence
    }

    /// True if the value has a tangent.
    pub fn has(&self, value: Value) -> bool {
        self.active.contains(&value) && self.needed.contains(&value)
    }

    /// The locals with values that have tangents.
    pub fn locals(&self) -> impl Iterator<Item = VariableId> {
        self.active_locals.intersection(&self.needed_locals).copied()
    }

    /// Loops carry values back, so that one pass over the operations does not see all dependences.
    fn until_stable(&mut self, pass: impl Fn(&mut Self)) {
        loop {
            self.changed = false;
            pass(self);
            if !self.changed {
                break;
            }
        }
    }

    fn is_active(&self, value: Value) -> bool {
        self.active.contains(&value)
    }

    fn set_active(&mut self, value: Value) {
        self.changed |= self.active.insert(value);
    }

    fn set_needed(&mut self, value: Value) {
        self.changed |= self.needed.insert(value);
    }

    fn activate(&mut self, function: &Function, ops: &[Op]) {
        for op in ops {
            match &op.kind {
                OpKind::If { then, otherwise, .. } => {
                    for region in [then, otherwise] {
                        self.activate(function, &region.ops);
                        self.activate_all(op.results.iter().zip(&region.yields));
                    }
                }
                OpKind::Loop { initial, body } => {
                    self.activate(function, &body.ops);
                    let params = || body.params.iter().copied();
                    self.activate_all(params().zip(initial));
                    self.activate_all(params().zip(&body.yields[1..]));
                    self.activate_all(op.results.iter().zip(&body.params));
                }
                OpKind::Store(local, _, value) if self.is_active(*value) => {
                    self.changed |= self.active_locals.insert(*local);
                }
                kind => {
                    let mut is_active = false;
                    for_each_source(function, kind, |source| {
                        is_active |= match source {
                            Source::Value(value) => self.is_active(value),
                            Source::Local(local) => self.active_locals.contains(&local),
                        }
                    });
                    if is_active {
                        op.results.iter().for_each(|result| self.set_active(result));
                    }
                }
            }
        }
    }

    /// Activates each value whose source is active.
    fn activate_all<'v>(&mut self, pairs: impl Iterator<Item = (Value, &'v Value)>) {
        for (value, source) in pairs {
            if self.is_active(*source) {
                self.set_active(value);
            }
        }
    }

    fn require(&mut self, function: &Function, ops: &[Op]) {
        for op in ops.iter().rev() {
            match &op.kind {
                OpKind::If { then, otherwise, .. } => {
                    for region in [then, otherwise] {
                        self.require_all(region.yields.iter().copied().zip(op.results.iter()));
                        self.require(function, &region.ops);
                    }
                }
                OpKind::Loop { initial, body } => self.require_loop(function, op, initial, body),
                OpKind::Store(local, _, value) if self.needed_locals.contains(local) => {
                    self.set_needed(*value);
                }
                kind if op.results.iter().any(|it| self.needed.contains(&it)) => {
                    for_each_source(function, kind, |source| match source {
                        Source::Value(value) => self.set_needed(value),
                        Source::Local(local) => self.changed |= self.needed_locals.insert(local),
                    });
                }
                _ => {}
            }
        }
    }

    fn require_loop(&mut self, function: &Function, op: &Op, initial: &[Value], body: &Region) {
        // A carried value is needed if its result is, or if the loop needs it.
        self.require_all(body.params.iter().copied().zip(op.results.iter()));
        self.require_all(body.yields[1..].iter().copied().zip(body.params.iter().copied()));
        self.require(function, &body.ops);
        self.require_all(body.yields[1..].iter().copied().zip(body.params.iter().copied()));
        self.require_all(initial.iter().copied().zip(body.params.iter().copied()));
        // The tangent of a carried value is a result, too.
        self.require_all(op.results.iter().zip(body.params.iter().copied()));
    }

    /// Requires each value whose use is needed.
    fn require_all(&mut self, pairs: impl Iterator<Item = (Value, Value)>) {
        for (value, user) in pairs {
            if self.needed.contains(&user) {
                self.set_needed(value);
            }
        }
    }
}

/// A source of the tangent of an operation's result.
enum Source {
    Value(Value),
    Local(VariableId),
}

/// Visits the values on whose tangents that of the result depends.
fn for_each_source(function: &Function, kind: &OpKind, mut visit: impl FnMut(Source)) {
    let mut value = |value: Value| {
        if function.scalar(value) == Scalar::F32 {
            visit(Source::Value(value));
        }
    };
    match kind {
        OpKind::Seed(a) | OpKind::Unary(UnaryOp::Negate | UnaryOp::Abs | UnaryOp::Sqrt, a) => {
            value(*a);
        }
        OpKind::Binary(
            BinaryOp::Add
            | BinaryOp::Subtract
            | BinaryOp::Multiply
            | BinaryOp::Divide
            | BinaryOp::Min
            | BinaryOp::Max,
            a,
            b,
        )
        | OpKind::Select(_, a, b) => {
            value(*a);
            value(*b);
        }
        OpKind::Fma(a, b, c) => [a, b, c].into_iter().for_each(|it| value(*it)),
        OpKind::ChainRule(_, factors) => factors.iter().for_each(|(of, _)| value(*of)),
        OpKind::Load(local, _) if function.variable(*local).kind == VariableKind::Local => {
            visit(Source::Local(*local));
        }
        _ => {}
    }
}
