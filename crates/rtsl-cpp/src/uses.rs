//! Analysis of the uses of values.

use rtsl_ir::{
    BinaryOp, Constant, Function, IndexVec, OpKind, Region, Scalar, UnaryOp, Value, VariableId,
};

/// Facts about the uses of each value.
#[derive(Debug)]
pub(crate) struct Uses {
    counts: IndexVec<Value, u32>,
    /// The loop depths of the definition and of the last use.
    defined: IndexVec<Value, u32>,
    used: IndexVec<Value, u32>,
    /// The operations that may have the value as an operand directly, however it is named between.
    reaches: IndexVec<Value, Reach>,
    /// True for values whose last use initialises or assigns a variable.
    assigned: IndexVec<Value, bool>,
    loads: IndexVec<VariableId, u32>,
    /// The upper bound of integers that have been clamped to a range from 0.
    clamped: IndexVec<Value, Option<i32>>,
}

/// Operations of f32 that compilers join with the one that makes their operand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Reach {
    sum: bool,
    negation: bool,
}

impl Reach {
    const SUM: Reach = Reach { sum: true, negation: false };
    const ALL: Reach = Reach { sum: true, negation: true };

    fn or(self, other: Reach) -> Reach {
        Reach { sum: self.sum || other.sum, negation: self.negation || other.negation }
    }
}

impl Uses {
    pub fn of(function: &Function) -> Uses {
        let values = function.values.len();
        let mut uses = Uses {
            counts: IndexVec::filled(values, 0),
            defined: IndexVec::filled(values, 0),
            used: IndexVec::filled(values, 0),
            reaches: IndexVec::filled(values, Reach::default()),
            assigned: IndexVec::filled(values, false),
            loads: IndexVec::filled(function.variables.len(), 0),
            clamped: IndexVec::filled(values, None),
        };
        uses.region(&function.body, 0);
        uses.find_clamped(function);
        while uses.spread(function, &function.body) {}
        uses
    }

    pub fn count(&self, value: Value) -> u32 {
        self.counts[value]
    }

    /// True if the value can be written at its use, where it is evaluated no more often than at its definition.
    pub fn nests(&self, value: Value) -> bool {
        self.counts[value] == 1 && self.defined[value] == self.used[value]
    }

    /// True if the value is assigned to a variable.
    pub fn is_assigned(&self, value: Value) -> bool {
        self.assigned[value]
    }

    /// True if the value is an operand of a sum directly, so that compilers might contract the operation that makes it
    /// with the sum.
    pub fn goes_into_sum(&self, value: Value) -> bool {
        self.reaches[value].sum
    }

    /// True if the value is the operand of a negation directly, so that compilers might join both.
    pub fn goes_into_negation(&self, value: Value) -> bool {
        self.reaches[value].negation
    }

    /// True if an integer is from 0 to `last` because it has been clamped to that range: `min(max(a, 0), last)`.
    pub fn is_clamped(&self, value: Value, last: i32) -> bool {
        self.clamped[value].is_some_and(|most| most <= last)
    }

    /// Finds clamped integers; constants precede their uses, and values are in the order of the text.
    fn find_clamped(&mut self, function: &Function) {
        let mut constants = IndexVec::filled(function.values.len(), None);
        function.body.for_each_op(&mut |op| {
            let Some(result) = op.results.iter().next() else { return };
            match op.kind {
                OpKind::Constant(Constant::I32(constant)) if constant >= 0 => {
                    constants[result] = Some(constant);
                    self.clamped[result] = Some(constant);
                }
                OpKind::Binary(BinaryOp::Max, _, b) if constants[b].is_some() => {
                    self.clamped[result] = Some(i32::MAX);
                }
                OpKind::Binary(BinaryOp::Min, a, b) => {
                    if let (Some(_), Some(most)) = (self.clamped[a], constants[b]) {
                        self.clamped[result] = Some(most);
                    }
                }
                _ => {}
            }
        });
    }

    /// Returns the number of operations that load from a variable.
    pub fn loads(&self, variable: VariableId) -> u32 {
        self.loads[variable]
    }

    fn region(&mut self, region: &Region, loops: u32) {
        for param in &region.params {
            self.defined[*param] = loops;
        }
        for op in &region.ops {
            let assigns = matches!(op.kind, OpKind::Loop { .. });
            op.kind.for_each_operand(|value| self.add(value, loops, assigns));
            if let OpKind::Load(variable, _) = op.kind {
                self.loads[variable] += 1;
            }
            for result in op.results.iter() {
                self.defined[result] = loops;
            }
            let inner = loops + u32::from(matches!(op.kind, OpKind::Loop { .. }));
            op.kind.regions().for_each(|region| self.region(region, inner));
        }
        region.yields.iter().for_each(|value| self.add(*value, loops, true));
    }

    fn add(&mut self, value: Value, loops: u32, assigns: bool) {
        self.assigned[value] = assigns;
        self.counts[value] += 1;
        self.used[value] = loops;
    }

    /// Propagates once from sums and negations to their operands; returns true if anything changed.
    fn spread(&mut self, function: &Function, region: &Region) -> bool {
        let mut found = false;
        for op in region.ops.iter().rev() {
            let reaches: Vec<Reach> =
                op.results.iter().map(|result| self.reaches[result]).collect();
            let mut mark = |value: Value, reach: Reach, uses: &mut Uses| {
                let reach = reach.or(uses.reaches[value]);
                found |= std::mem::replace(&mut uses.reaches[value], reach) != reach;
            };
            match &op.kind {
                OpKind::Binary(BinaryOp::Add | BinaryOp::Subtract, a, b)
                    if function.scalar(*a) == Scalar::F32 =>
                {
                    mark(*a, Reach::SUM, self);
                    mark(*b, Reach::SUM, self);
                }
                OpKind::Unary(UnaryOp::Negate, a) if function.scalar(*a) == Scalar::F32 => {
                    mark(*a, Reach { negation: true, ..reaches[0] }, self);
                }
                OpKind::Select(_, a, b) | OpKind::Binary(BinaryOp::Min | BinaryOp::Max, a, b) => {
                    mark(*a, reaches[0], self);
                    mark(*b, reaches[0], self);
                }
                // Locals are memory, but compilers keep them in registers.
                OpKind::Store(_, _, value) => mark(*value, Reach::ALL, self),
                OpKind::If { then, otherwise, .. } => {
                    for (index, reach) in reaches.iter().enumerate() {
                        mark(then.yields[index], *reach, self);
                        mark(otherwise.yields[index], *reach, self);
                    }
                }
                OpKind::Loop { initial, body } => {
                    for (index, reach) in reaches.iter().enumerate() {
                        let reach = reach.or(self.reaches[body.params[index]]);
                        mark(initial[index], reach, self);
                        mark(body.yields[index + 1], reach, self);
                    }
                }
                _ => {}
            }
            for inner in op.kind.regions().rev() {
                found |= self.spread(function, inner);
            }
        }
        found
    }
}
