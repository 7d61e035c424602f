//! Computation of factors in a gap of the text.

use std::collections::{BTreeSet, HashMap};

use rtsl_ir::{BinaryOp, Constant, Op, OpKind, Scalar, UnaryOp, Value, Values};

use super::factors::{Expression, Factor, Factors};
use super::flow::{Flow, Gap};
use crate::ray_weights::can_be_copied;

/// The greatest number of operations that are copied for the factors of a request.
const MAX_COPIES: u32 = 128;

/// Operations that compute factors, which are inserted in a gap.
pub(super) struct Placed {
    pub gap: Gap,
    /// The numbers of operations that move to an earlier gap, before the gap or around it, in the order in which they
    /// do.
    pub moves: Vec<(u32, Gap)>,
    pub ops: Vec<Op>,
    pub factors: Vec<Value>,
    /// The values of the function that the operations use.
    pub used: Vec<Value>,
}

/// A value that is neither known in the gap nor can be computed there.
struct Unknown(Value);

/// The factors that a request needs.
pub(super) struct Wanted<'a> {
    pub expressions: &'a Factors,
    pub factors: &'a [Factor],
    /// The gap in which it needs them.
    pub gap: Gap,
    /// True if it may wait for them.
    pub may_wait: bool,
}

/// Places the factors in the gap, or if the request may wait, in the first one behind it in the same region in which
/// they are known. New values are added to `types`. `None` if the factors are not known.
pub(super) fn place(
    flow: &Flow<'_>,
    wanted: &Wanted<'_>,
    types: &mut Vec<Scalar>,
) -> Option<Placed> {
    let (mut gap, count) = (wanted.gap, types.len());
    loop {
        types.truncate(count);
        match try_place(flow, wanted, gap, types) {
            Ok(placed) => return Some(placed),
            Err(Unknown(value)) => {
                let later = flow.visible_later(value, gap).filter(|_| wanted.may_wait)?;
                if later.position <= gap.position {
                    return None;
                }
                gap = later;
            }
        }
    }
}

fn try_place(
    flow: &Flow<'_>,
    wanted: &Wanted<'_>,
    gap: Gap,
    types: &mut Vec<Scalar>,
) -> Result<Placed, Unknown> {
    let placed =
        Placed { gap, moves: Vec::new(), ops: Vec::new(), factors: Vec::new(), used: Vec::new() };
    let (copies, computed, steps) = (HashMap::new(), HashMap::new(), MAX_COPIES);
    let mut placing = Placing { flow, types, placed, copies, computed, steps };
    for factor in wanted.factors {
        let value = placing.factor(wanted.expressions, *factor)?;
        placing.placed.factors.push(value);
    }
    Ok(placing.placed)
}

struct Placing<'a, 'f> {
    flow: &'a Flow<'f>,
    types: &'a mut Vec<Scalar>,
    placed: Placed,
    /// Copies of values that are defined elsewhere.
    copies: HashMap<Value, Value>,
    computed: HashMap<Factor, Value>,
    /// The number of operations that may still be copied.
    steps: u32,
}

impl Placing<'_, '_> {
    fn factor(&mut self, expressions: &Factors, factor: Factor) -> Result<Value, Unknown> {
        let Factor::Of(root) = factor else { return Ok(self.known(factor)) };
        let (mut needed, mut pending) = (BTreeSet::new(), vec![root]);
        while let Some(number) = pending.pop() {
            if needed.insert(number) {
                let operands = operands(expressions.expression(number));
                pending.extend(operands.into_iter().flatten().filter_map(Factor::number));
            }
        }
        // Operands have lower numbers.
        for number in needed {
            if !self.computed.contains_key(&Factor::Of(number)) {
                let value = self.expression(expressions.expression(number))?;
                self.computed.insert(Factor::Of(number), value);
            }
        }
        Ok(self.known(factor))
    }

    /// Returns a constant or a factor that has been computed.
    fn known(&mut self, factor: Factor) -> Value {
        if let Some(value) = self.computed.get(&factor) {
            return *value;
        }
        let constant = if factor == Factor::Zero { 0.0 } else { 1.0 };
        let value = self.push(OpKind::Constant(Constant::F32(constant)));
        self.computed.insert(factor, value);
        value
    }

    fn expression(&mut self, expression: Expression) -> Result<Value, Unknown> {
        let binary = OpKind::Binary;
        let kind = match expression {
            Expression::Value(value) => return self.copy_of(value),
            Expression::Negated(Factor::One) => OpKind::Constant(Constant::F32(-1.0)),
            Expression::Negated(a) => OpKind::Unary(UnaryOp::Negate, self.known(a)),
            Expression::Product(a, b) => {
                binary(BinaryOp::Multiply, self.known(a), self.copy_of(b)?)
            }
            Expression::Quotient(a, b) => binary(BinaryOp::Divide, self.known(a), self.copy_of(b)?),
            Expression::Sum(a, b) => binary(BinaryOp::Add, self.known(a), self.known(b)),
            Expression::Choice(condition, a, b) => {
                OpKind::Select(self.copy_of(condition)?, self.known(a), self.known(b))
            }
        };
        Ok(self.push(kind))
    }

    /// Returns the value, or a copy in the gap.
    fn copy_of(&mut self, value: Value) -> Result<Value, Unknown> {
        let copy = self.copy(value);
        // Where copying takes too much, the request waits for the value.
        copy.map_err(|unknown| if self.steps == 0 { Unknown(value) } else { unknown })
    }

    fn copy(&mut self, value: Value) -> Result<Value, Unknown> {
        if self.flow.earlier_gap(value, self.placed.gap).is_some() {
            self.show(value, self.placed.gap)?;
            return Ok(value);
        }
        if let Some(copy) = self.copies.get(&value) {
            return Ok(*copy);
        }
        let variables = &self.flow.function.variables;
        let definition =
            self.flow.definition(value).filter(|op| can_be_copied(&op.kind, variables));
        let Some(mut op) = definition.cloned() else { return Err(Unknown(value)) };
        self.steps = self.steps.checked_sub(1).ok_or(Unknown(value))?;
        let mut operands = Vec::new();
        op.kind.for_each_operand(|operand| operands.push(operand));
        let copied: Result<Vec<Value>, Unknown> =
            operands.into_iter().map(|operand| self.copy(operand)).collect();
        let mut copied = copied?.into_iter();
        op.kind.for_each_operand_mut(|operand| *operand = copied.next().unwrap_or(*operand));
        op.results = self.new_value(self.flow.function.scalar(value));
        let copy = op.results.get(0);
        self.placed.ops.push(op);
        self.copies.insert(value, copy);
        Ok(copy)
    }

    /// Makes a value visible in a gap inside the region that defines it: moves its operation there if need be.
    fn show(&mut self, value: Value, gap: Gap) -> Result<(), Unknown> {
        if self.flow.is_visible(value, gap) {
            self.placed.used.push(value);
            return Ok(());
        }
        let found = self.flow.earlier_gap(value, gap).zip(self.flow.movable(value));
        let (to, number) = found.ok_or(Unknown(value))?;
        if self.placed.moves.iter().any(|(moved, _)| *moved == number) {
            return Ok(());
        }
        self.steps = self.steps.checked_sub(1).ok_or(Unknown(value))?;
        for operand in self.flow.operands_from_outside(number) {
            self.show(operand, to)?;
        }
        self.placed.moves.push((number, to));
        Ok(())
    }

    /// Appends an operation that nothing contracts.
    fn push(&mut self, kind: OpKind) -> Value {
        let results = self.new_value(Scalar::F32);
        let precise = matches!(kind, OpKind::Binary(..));
        self.placed.ops.push(Op { results, precise, kind });
        results.get(0)
    }

    fn new_value(&mut self, scalar: Scalar) -> Values {
        self.types.push(scalar);
        Values { first: self.types.len() as u32 - 1, count: 1 }
    }
}

fn operands(expression: Expression) -> [Option<Factor>; 2] {
    match expression {
        Expression::Value(_) => [None, None],
        Expression::Negated(a) | Expression::Product(a, _) | Expression::Quotient(a, _) => {
            [Some(a), None]
        }
        Expression::Sum(a, b) | Expression::Choice(_, a, b) => [Some(a), Some(b)],
    }
}
