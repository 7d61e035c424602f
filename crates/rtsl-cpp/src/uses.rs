//! Analysis of the uses of values.

use rtsl_ir::{BinaryOp, Constant, Function, OpKind, Region, Scalar, UnaryOp, Value, VariableId};

/// Facts about the uses of each value.
#[derive(Debug)]
pub(crate) struct Uses {
    counts: Vec<u32>,
    /// The loop depths of the definition and of the last use.
    defined: Vec<u32>,
    used: Vec<u32>,
    /// True for products that may become an operand of a sum directly.
    into_sums: Vec<bool>,
    /// True for values whose last use initialises or assigns a variable.
    assigned: Vec<bool>,
    loads: Vec<u32>,
    /// The upper bound of integers that have been clamped to a range from 0.
    clamped: Vec<Option<i32>>,
}

impl Uses {
    pub fn of(function: &Function) -> Uses {
        let values = function.values.len();
        let mut uses = Uses {
            counts: vec![0; values],
            defined: vec![0; values],
            used: vec![0; values],
            into_sums: vec![false; values],
            assigned: vec![false; values],
            loads: vec![0; function.variables.len()],
            clamped: vec![None; values],
        };
        uses.region(&function.body, 0);
        uses.find_clamped(function);
        while uses.spread(function, &function.body) {}
        uses
    }

    pub fn count(&self, value: Value) -> u32 {
        self.counts[value.0 as usize]
    }

    /// True if the value can be written at its use, where it is evaluated no more often than at its definition.
    pub fn nests(&self, value: Value) -> bool {
        let index = value.0 as usize;
        self.counts[index] == 1 && self.defined[index] == self.used[index]
    }

    /// True if the value is assigned to a variable.
    pub fn is_assigned(&self, value: Value) -> bool {
        self.assigned[value.0 as usize]
    }

    /// True if the value is an operand of a sum directly, so that compilers might contract the operation that makes it
    /// with the sum.
    pub fn goes_into_sum(&self, value: Value) -> bool {
        self.into_sums[value.0 as usize]
    }

    /// True if an integer is from 0 to `last` because it has been clamped to that range: `min(max(a, 0), last)`.
    pub fn is_clamped(&self, value: Value, last: i32) -> bool {
        self.clamped[value.0 as usize].is_some_and(|most| most <= last)
    }

    /// Finds clamped integers; constants precede their uses, and values are in the order of the text.
    fn find_clamped(&mut self, function: &Function) {
        let mut constants = vec![None; function.values.len()];
        function.body.for_each_op(&mut |op| {
            let index = op.results.first as usize;
            match op.kind {
                OpKind::Constant(Constant::I32(constant)) if constant >= 0 => {
                    constants[index] = Some(constant);
                    self.clamped[index] = Some(constant);
                }
                OpKind::Binary(BinaryOp::Max, _, b) if constants[b.0 as usize].is_some() => {
                    self.clamped[index] = Some(i32::MAX);
                }
                OpKind::Binary(BinaryOp::Min, a, b) => {
                    if let (Some(_), Some(most)) =
                        (self.clamped[a.0 as usize], constants[b.0 as usize])
                    {
                        self.clamped[index] = Some(most);
                    }
                }
                _ => {}
            }
        });
    }

    /// Returns the number of operations that load from a variable.
    pub fn loads(&self, variable: VariableId) -> u32 {
        self.loads[variable.0 as usize]
    }

    fn region(&mut self, region: &Region, loops: u32) {
        for param in &region.params {
            self.defined[param.0 as usize] = loops;
        }
        for op in &region.ops {
            let assigns = matches!(op.kind, OpKind::Loop { .. });
            op.kind.for_each_operand(|value| self.add(value, loops, assigns));
            if let OpKind::Load(variable, _) = op.kind {
                self.loads[variable.0 as usize] += 1;
            }
            for result in op.results.iter() {
                self.defined[result.0 as usize] = loops;
            }
            let inner = loops + u32::from(matches!(op.kind, OpKind::Loop { .. }));
            op.kind.regions().for_each(|region| self.region(region, inner));
        }
        region.yields.iter().for_each(|value| self.add(*value, loops, true));
    }

    fn add(&mut self, value: Value, loops: u32, assigns: bool) {
        self.assigned[value.0 as usize] = assigns;
        self.counts[value.0 as usize] += 1;
        self.used[value.0 as usize] = loops;
    }

    /// Propagates once from sums to their operands; returns true if anything changed.
    fn spread(&mut self, function: &Function, region: &Region) -> bool {
        let mut found = false;
        for op in region.ops.iter().rev() {
            let goes = op.results.iter().map(|result| self.goes_into_sum(result));
            let goes: Vec<bool> = goes.collect();
            let mut mark = |value: Value, uses: &mut Uses| {
                found |= !std::mem::replace(&mut uses.into_sums[value.0 as usize], true);
            };
            match &op.kind {
                OpKind::Binary(BinaryOp::Add | BinaryOp::Subtract, a, b)
                    if function.scalar(*a) == Scalar::F32 =>
                {
                    mark(*a, self);
                    mark(*b, self);
                }
                OpKind::Unary(UnaryOp::Negate, a) if goes[0] => mark(*a, self),
                OpKind::Select(_, a, b) | OpKind::Binary(BinaryOp::Min | BinaryOp::Max, a, b)
                    if goes[0] =>
                {
                    mark(*a, self);
                    mark(*b, self);
                }
                // Locals are memory, but compilers keep them in registers.
                OpKind::Store(_, _, value) => mark(*value, self),
                OpKind::If { then, otherwise, .. } => {
                    for (index, goes) in goes.iter().enumerate() {
                        if *goes {
                            mark(then.yields[index], self);
                            mark(otherwise.yields[index], self);
                        }
                    }
                }
                OpKind::Loop { initial, body } => {
                    for (index, goes) in goes.iter().enumerate() {
                        if *goes || self.goes_into_sum(body.params[index]) {
                            mark(initial[index], self);
                            mark(body.yields[index + 1], self);
                        }
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
