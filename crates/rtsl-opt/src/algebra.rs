//! Exact algebraic rules, which preserve the bits of the result for all operands.
//!
//! This excludes many identities of real numbers: `x + 0` is not `x` (-0 + 0 is 0), `x * 0` is not 0, `x - x` is not 0
//! (infinities), and nothing is reassociated. NaN remains NaN; its payload may change, which no operation can observe.

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, Index, IndexVec, OpKind, Scalar, UnaryOp, Value, Variable,
    VariableId, VariableKind, evaluate,
};

/// A simpler equivalent of an operation.
#[derive(Clone, Debug)]
pub(crate) enum Simplified {
    /// An existing value.
    Value(Value),
    /// A constant.
    Constant(Constant),
    /// Another operation.
    Kind(OpKind),
}

/// The definition of a value, as far as the rules use it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Definition {
    Unary(UnaryOp, Value),
    Compare(CompareOp, Value, Value),
    Select(Value, Value, Value),
    Convert(Value),
    Bitcast(Value),
}

impl Definition {
    /// Returns the definition of the result of an operation.
    pub fn of(kind: &OpKind) -> Option<Definition> {
        match *kind {
            OpKind::Unary(op, a) => Some(Definition::Unary(op, a)),
            OpKind::Compare(op, a, b) => Some(Definition::Compare(op, a, b)),
            OpKind::Select(condition, a, b) => Some(Definition::Select(condition, a, b)),
            OpKind::Convert(_, a) => Some(Definition::Convert(a)),
            OpKind::Bitcast(_, a) => Some(Definition::Bitcast(a)),
            _ => None,
        }
    }
}

/// Known facts about the values of a function.
pub(crate) struct Facts<'a> {
    /// The types of the values.
    pub scalars: &'a [Scalar],
    /// The function's variables.
    pub variables: &'a [Variable],
    /// The constants, by value; may be shorter than the number of values.
    pub known: &'a IndexVec<Value, Option<Constant>>,
    /// The definitions, by value; may be shorter than the number of values.
    pub definitions: &'a IndexVec<Value, Option<Definition>>,
}

/// Applies the first rule that matches.
pub(crate) fn simplify(kind: &OpKind, facts: &Facts<'_>) -> Option<Simplified> {
    if !matches!(kind, OpKind::Constant(_))
        && let Some(constant) = evaluate::fold(kind, |value| facts.known(value))
    {
        return Some(Simplified::Constant(constant));
    }
    match *kind {
        OpKind::Unary(op, a) => facts.unary(op, a),
        OpKind::Binary(op, a, b) => match facts.scalar(a) {
            Scalar::F32 => facts.binary_f32(op, a, b),
            Scalar::I32 | Scalar::U32 => facts.binary_integer(op, a, b),
            Scalar::Bool => facts.binary_bool(op, a, b),
        },
        OpKind::Compare(op, a, b) => facts.compare(op, a, b),
        OpKind::Select(condition, a, b) => facts.select(condition, a, b),
        OpKind::Fma(a, b, c) => facts.fma(a, b, c),
        OpKind::Convert(to, a) => facts.convert(to, a),
        OpKind::Bitcast(to, a) => facts.bitcast(to, a),
        OpKind::Load(variable, Index::Dynamic(index)) => {
            let index = facts.constant_index(variable, index)?;
            Some(Simplified::Kind(OpKind::Load(variable, index)))
        }
        OpKind::Store(variable, Index::Dynamic(index), value) => {
            let index = facts.constant_index(variable, index)?;
            Some(Simplified::Kind(OpKind::Store(variable, index, value)))
        }
        _ => None,
    }
}

/// Shorthands for results of rules.
fn same(value: Value) -> Option<Simplified> {
    Some(Simplified::Value(value))
}

fn becomes(kind: OpKind) -> Option<Simplified> {
    Some(Simplified::Kind(kind))
}

impl Facts<'_> {
    fn scalar(&self, value: Value) -> Scalar {
        self.scalars[value.0 as usize]
    }

    fn known(&self, value: Value) -> Option<Constant> {
        self.known.get(value).copied().flatten()
    }

    fn definition(&self, value: Value) -> Option<Definition> {
        self.definitions.get(value).copied().flatten()
    }

    fn is_f32(&self, value: Value, constant: f32) -> bool {
        self.known(value) == Some(Constant::F32(constant))
    }

    /// Returns the bits of an integer or bool constant.
    fn bits(&self, value: Value) -> Option<u32> {
        self.known(value).map(Constant::bits)
    }

    /// Returns `x` if `value` is `-x`.
    fn negated(&self, value: Value) -> Option<Value> {
        match self.definition(value)? {
            Definition::Unary(UnaryOp::Negate, x) => Some(x),
            _ => None,
        }
    }

    fn unary(&self, op: UnaryOp, a: Value) -> Option<Simplified> {
        match (op, self.definition(a)?) {
            (UnaryOp::Negate, Definition::Unary(UnaryOp::Negate, x))
            | (UnaryOp::Not, Definition::Unary(UnaryOp::Not, x)) => same(x),
            (UnaryOp::Abs, Definition::Unary(UnaryOp::Negate, x)) => {
                becomes(OpKind::Unary(UnaryOp::Abs, x))
            }
            (UnaryOp::Abs, Definition::Unary(UnaryOp::Abs, _))
            | (UnaryOp::Floor, Definition::Unary(UnaryOp::Floor, _))
            | (UnaryOp::Ceil, Definition::Unary(UnaryOp::Ceil, _))
            | (UnaryOp::Trunc, Definition::Unary(UnaryOp::Trunc, _)) => same(a),
            (UnaryOp::Not, Definition::Compare(op, x, y)) => {
                becomes(OpKind::Compare(self.inverse(op, x)?, x, y))
            }
            _ => None,
        }
    }

    /// Returns the negated comparison; for floats only of equality, since all others are false with a NaN.
    fn inverse(&self, op: CompareOp, operand: Value) -> Option<CompareOp> {
        let ordered = self.scalar(operand) != Scalar::F32;
        match op {
            CompareOp::Equal => Some(CompareOp::NotEqual),
            CompareOp::NotEqual => Some(CompareOp::Equal),
            CompareOp::Less => ordered.then_some(CompareOp::GreaterEqual),
            CompareOp::LessEqual => ordered.then_some(CompareOp::Greater),
            CompareOp::Greater => ordered.then_some(CompareOp::LessEqual),
            CompareOp::GreaterEqual => ordered.then_some(CompareOp::Less),
        }
    }

    fn binary_f32(&self, op: BinaryOp, a: Value, b: Value) -> Option<Simplified> {
        match op {
            BinaryOp::Add if self.is_f32(b, -0.0) => same(a),
            BinaryOp::Add if self.is_f32(a, -0.0) => same(b),
            BinaryOp::Add => {
                let subtract = |x, y| becomes(OpKind::Binary(BinaryOp::Subtract, x, y));
                if let Some(x) = self.negated(b) {
                    return subtract(a, x);
                }
                subtract(b, self.negated(a)?)
            }
            BinaryOp::Subtract if self.is_f32(b, 0.0) => same(a),
            BinaryOp::Subtract if self.is_f32(a, -0.0) => {
                becomes(OpKind::Unary(UnaryOp::Negate, b))
            }
            BinaryOp::Subtract => becomes(OpKind::Binary(BinaryOp::Add, a, self.negated(b)?)),
            BinaryOp::Multiply if self.is_f32(b, 1.0) => same(a),
            BinaryOp::Multiply if self.is_f32(a, 1.0) => same(b),
            BinaryOp::Multiply if self.is_f32(b, -1.0) => {
                becomes(OpKind::Unary(UnaryOp::Negate, a))
            }
            BinaryOp::Multiply if self.is_f32(a, -1.0) => {
                becomes(OpKind::Unary(UnaryOp::Negate, b))
            }
            BinaryOp::Divide if self.is_f32(b, 1.0) => same(a),
            BinaryOp::Multiply | BinaryOp::Divide => {
                let (x, y) = (self.negated(a)?, self.negated(b)?);
                becomes(OpKind::Binary(op, x, y))
            }
            BinaryOp::Min | BinaryOp::Max if a == b => same(a),
            _ => None,
        }
    }

    fn binary_integer(&self, op: BinaryOp, a: Value, b: Value) -> Option<Simplified> {
        let zero = Simplified::Constant(Constant::zero(self.scalar(a)));
        let (left, right) = (self.bits(a), self.bits(b));
        match op {
            BinaryOp::Add | BinaryOp::Or | BinaryOp::Xor if right == Some(0) => same(a),
            BinaryOp::Add | BinaryOp::Or | BinaryOp::Xor if left == Some(0) => same(b),
            BinaryOp::Subtract if right == Some(0) => same(a),
            BinaryOp::Subtract if left == Some(0) => becomes(OpKind::Unary(UnaryOp::Negate, b)),
            BinaryOp::Subtract | BinaryOp::Xor if a == b => Some(zero),
            BinaryOp::Multiply if right == Some(1) => same(a),
            BinaryOp::Multiply if left == Some(1) => same(b),
            BinaryOp::Multiply | BinaryOp::And if left == Some(0) || right == Some(0) => Some(zero),
            BinaryOp::And if right == Some(u32::MAX) => same(a),
            BinaryOp::And if left == Some(u32::MAX) => same(b),
            BinaryOp::And | BinaryOp::Or | BinaryOp::Min | BinaryOp::Max if a == b => same(a),
            BinaryOp::Divide if right == Some(1) => same(a),
            BinaryOp::Divide | BinaryOp::Remainder if right == Some(0) => Some(zero),
            BinaryOp::Remainder if right == Some(1) => Some(zero),
            BinaryOp::ShiftLeft | BinaryOp::ShiftRight if right.is_some_and(|it| it & 31 == 0) => {
                same(a)
            }
            _ => None,
        }
    }

    fn binary_bool(&self, op: BinaryOp, a: Value, b: Value) -> Option<Simplified> {
        let (constant, other) = match (self.bits(a), self.bits(b)) {
            (Some(constant), None) => (constant != 0, b),
            (None, Some(constant)) => (constant != 0, a),
            _ => return self.binary_bool_unknown(op, a, b),
        };
        match (op, constant) {
            (BinaryOp::And, true) | (BinaryOp::Or | BinaryOp::Xor, false) => same(other),
            (BinaryOp::And, false) | (BinaryOp::Or, true) => {
                Some(Simplified::Constant(Constant::Bool(constant)))
            }
            (BinaryOp::Xor, true) => becomes(OpKind::Unary(UnaryOp::Not, other)),
            _ => None,
        }
    }

    fn binary_bool_unknown(&self, op: BinaryOp, a: Value, b: Value) -> Option<Simplified> {
        match op {
            BinaryOp::And | BinaryOp::Or if a == b => same(a),
            BinaryOp::Xor if a == b => Some(Simplified::Constant(Constant::Bool(false))),
            _ => None,
        }
    }

    fn compare(&self, op: CompareOp, a: Value, b: Value) -> Option<Simplified> {
        match self.scalar(a) {
            Scalar::F32 => None,
            Scalar::I32 | Scalar::U32 | Scalar::Bool if a == b => {
                let holds = match op {
                    CompareOp::Equal | CompareOp::LessEqual | CompareOp::GreaterEqual => true,
                    CompareOp::NotEqual | CompareOp::Less | CompareOp::Greater => false,
                };
                Some(Simplified::Constant(Constant::Bool(holds)))
            }
            Scalar::I32 | Scalar::U32 => {
                // A test of a number converted from a bool is the bool.
                let Definition::Convert(x) = self.definition(a)? else { return None };
                if self.scalar(x) != Scalar::Bool || self.bits(b) != Some(0) {
                    return None;
                }
                match op {
                    CompareOp::NotEqual => same(x),
                    CompareOp::Equal => becomes(OpKind::Unary(UnaryOp::Not, x)),
                    _ => None,
                }
            }
            Scalar::Bool => {
                let (constant, other) = match (self.bits(a), self.bits(b)) {
                    (Some(constant), None) => (constant != 0, b),
                    (None, Some(constant)) => (constant != 0, a),
                    _ => return None,
                };
                if constant == (op == CompareOp::Equal) {
                    same(other)
                } else {
                    becomes(OpKind::Unary(UnaryOp::Not, other))
                }
            }
        }
    }

    fn select(&self, condition: Value, a: Value, b: Value) -> Option<Simplified> {
        if a == b {
            return same(a);
        }
        if let Some(condition) = self.bits(condition) {
            return same(if condition != 0 { a } else { b });
        }
        if let Some(Definition::Unary(UnaryOp::Not, x)) = self.definition(condition) {
            return becomes(OpKind::Select(x, b, a));
        }
        // An inner select with the same condition is decided by the outer one.
        if let Some(Definition::Select(inner, x, _)) = self.definition(a)
            && inner == condition
        {
            return becomes(OpKind::Select(condition, x, b));
        }
        if let Some(Definition::Select(inner, _, y)) = self.definition(b)
            && inner == condition
        {
            return becomes(OpKind::Select(condition, a, y));
        }
        match self.scalar(a) {
            Scalar::Bool => self.select_bool(condition, a, b),
            Scalar::F32 | Scalar::I32 | Scalar::U32 => None,
        }
    }

    fn select_bool(&self, condition: Value, a: Value, b: Value) -> Option<Simplified> {
        if a == condition {
            return becomes(OpKind::Binary(BinaryOp::Or, condition, b));
        }
        if b == condition {
            return becomes(OpKind::Binary(BinaryOp::And, condition, a));
        }
        match (self.bits(a), self.bits(b)) {
            (Some(1), Some(0)) => same(condition),
            (Some(0), Some(1)) => becomes(OpKind::Unary(UnaryOp::Not, condition)),
            (Some(1), None) => becomes(OpKind::Binary(BinaryOp::Or, condition, b)),
            (None, Some(0)) => becomes(OpKind::Binary(BinaryOp::And, condition, a)),
            _ => None,
        }
    }

    fn fma(&self, a: Value, b: Value, c: Value) -> Option<Simplified> {
        if self.is_f32(c, -0.0) {
            return becomes(OpKind::Binary(BinaryOp::Multiply, a, b));
        }
        for (factor, other) in [(a, b), (b, a)] {
            if self.is_f32(factor, 1.0) {
                return becomes(OpKind::Binary(BinaryOp::Add, other, c));
            }
            if self.is_f32(factor, -1.0) {
                return becomes(OpKind::Binary(BinaryOp::Subtract, c, other));
            }
        }
        let (x, y) = (self.negated(a)?, self.negated(b)?);
        becomes(OpKind::Fma(x, y, c))
    }

    fn convert(&self, to: Scalar, a: Value) -> Option<Simplified> {
        if self.scalar(a) == to {
            return same(a);
        }
        let Definition::Convert(x) = self.definition(a)? else { return None };
        let chain = (self.scalar(x), self.scalar(a), to);
        match chain {
            // A conversion through a type that represents every value is the identity.
            (Scalar::I32, Scalar::U32, Scalar::I32)
            | (Scalar::U32, Scalar::I32, Scalar::U32)
            | (Scalar::Bool, _, Scalar::Bool) => same(x),
            (Scalar::Bool, _, _) => becomes(OpKind::Convert(to, x)),
            _ => None,
        }
    }

    fn bitcast(&self, to: Scalar, a: Value) -> Option<Simplified> {
        if self.scalar(a) == to {
            return same(a);
        }
        let Definition::Bitcast(x) = self.definition(a)? else { return None };
        // A cast from integer through f32 to integer would canonicalise the bits of a NaN.
        match (self.scalar(x), self.scalar(a)) {
            (Scalar::F32, _) if to == Scalar::F32 => same(x),
            (Scalar::I32 | Scalar::U32, Scalar::I32 | Scalar::U32) if self.scalar(x) == to => {
                same(x)
            }
            (_, Scalar::I32 | Scalar::U32) => becomes(OpKind::Bitcast(to, x)),
            _ => None,
        }
    }

    /// Returns the clamped value of a known index, unless the clamp depends on a buffer's length.
    fn constant_index(&self, id: VariableId, index: Value) -> Option<Index> {
        let Constant::I32(index) = self.known(index)? else { return None };
        let variable = &self.variables[id.0 as usize];
        let index = index.max(0) as u32;
        match variable.kind {
            VariableKind::Buffer => (index < variable.len).then_some(Index::Constant(index)),
            _ => Some(Index::Constant(index.min(variable.len - 1))),
        }
    }
}
