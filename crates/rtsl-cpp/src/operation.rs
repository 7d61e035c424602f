//! Translation of operations to expressions.

use rtsl_ir::{
    BinaryOp, CompareOp, Index, OpKind, Scalar, UnaryOp, Value, VariableId, VariableKind,
};

use crate::expression::{self as ops, Expression, Operator};
use crate::method::{Writer, indexed};
use crate::statement::Statement;
use crate::support::Helper;

impl Writer<'_> {
    /// Returns the expression of an operation without effects.
    pub fn expression(
        &mut self,
        result: Value,
        kind: &OpKind,
        out: &mut Vec<Statement>,
    ) -> Expression {
        let scalar = |writer: &Self, value: Value| writer.function.scalar(value);
        match *kind {
            OpKind::Unary(op, a) => {
                let [value] = self.operands([a], out);
                self.unary(op, scalar(self, a), value)
            }
            OpKind::Binary(op, a, b) => {
                let ty = scalar(self, a);
                let [a, b] = self.operands([a, b], out);
                let value = self.binary(op, ty, a, b);
                let may_be_joined = op == BinaryOp::Multiply && ty == Scalar::F32;
                match may_be_joined && self.uses.goes_into_sum(result) {
                    true => self.help(Helper::Rounded, [value]),
                    false => value,
                }
            }
            OpKind::Compare(op, a, b) => {
                let [a, b] = self.operands([a, b], out);
                Expression::binary(comparison(op), a, b)
            }
            OpKind::Select(condition, a, b) => {
                let [condition, a, b] = self.operands([condition, a, b], out);
                choice(condition, a, b)
            }
            OpKind::Fma(a, b, c) => {
                let [a, b, c] = self.operands([a, b, c], out);
                let value = Expression::call("std::fma", [a, b, c]);
                match self.uses.goes_into_negation(result) {
                    true => self.help(Helper::Fused, [value]),
                    false => value,
                }
            }
            OpKind::Convert(to, a) => {
                let from = scalar(self, a);
                let [value] = self.operands([a], out);
                self.convert(from, to, value)
            }
            OpKind::Bitcast(to, a) => {
                let from = scalar(self, a);
                let [value] = self.operands([a], out);
                self.bitcast(from, to, value)
            }
            OpKind::Length(variable) => {
                Expression::atom(format!("{}.length()", self.variable_text(variable)))
            }
            OpKind::Constant(_)
            | OpKind::Load(..)
            | OpKind::Store(..)
            | OpKind::If { .. }
            | OpKind::Loop { .. }
            | OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightCount
            | OpKind::LightSample { .. }
            | OpKind::Ambient
            | OpKind::Rand
            | OpKind::Report(..)
            | OpKind::ReportBudget
            | OpKind::Query(..)
            | OpKind::ReferenceCall(_)
            | OpKind::Seed(_)
            | OpKind::Derivative(..)
            | OpKind::ChainRule(..)
            | OpKind::IsSet(..)
            | OpKind::ReferenceCount(_) => unreachable!("these are statements"),
        }
    }

    /// Returns a scalar of a variable as a value.
    pub fn load(
        &mut self,
        variable: VariableId,
        index: Index,
        out: &mut Vec<Statement>,
    ) -> Expression {
        let info = self.function.variable(variable);
        let element = self.element(variable, index, out);
        let is_stored_as_word = matches!(info.kind, VariableKind::Member | VariableKind::Buffer);
        match info.scalar == Scalar::Bool && is_stored_as_word {
            true => Expression::binary(ops::NOT_EQUAL, element, Expression::atom("0u")),
            false => element,
        }
    }

    /// Returns a scalar of a variable in its stored form.
    pub fn element(
        &mut self,
        variable: VariableId,
        index: Index,
        out: &mut Vec<Statement>,
    ) -> Expression {
        let info = self.function.variable(variable);
        let name = self.variable_text(variable).to_owned();
        match (index, info.kind) {
            // A buffer of one scalar is indexed, too.
            (Index::Constant(index), VariableKind::Buffer | VariableKind::Local) => {
                Expression::atom(format!("{name}[{index}]"))
            }
            (Index::Constant(index), _) => Expression::atom(indexed(&name, index, info.len)),
            (Index::Dynamic(_), _) if info.len == 1 && info.kind != VariableKind::Buffer => {
                let index = if info.kind == VariableKind::Local { "[0]" } else { "" };
                Expression::atom(format!("{name}{index}"))
            }
            (Index::Dynamic(index), kind) => {
                let is_in_range = self.uses.is_clamped(index, info.len as i32 - 1);
                let [index] = self.operands([index], out);
                let index = match kind {
                    // The buffer's operator clamps the index.
                    VariableKind::Buffer => index,
                    _ if is_in_range => index,
                    _ => {
                        let length = Expression::atom(info.len.to_string());
                        self.help(Helper::ClampedIndex, [index, length])
                    }
                };
                Expression::Element(name, Box::new(index))
            }
        }
    }

    pub fn help<const N: usize>(
        &mut self,
        helper: Helper,
        arguments: [Expression; N],
    ) -> Expression {
        self.helpers.insert(helper);
        Expression::call(helper.name(), arguments)
    }

    fn unary(&mut self, op: UnaryOp, scalar: Scalar, a: Expression) -> Expression {
        let one = || Expression::atom("1.0f");
        match (op, scalar) {
            (UnaryOp::Negate, Scalar::I32) => self.help(Helper::WrappingNegate, [a]),
            (UnaryOp::Negate, Scalar::U32) => {
                Expression::binary(ops::SUBTRACT, Expression::atom("0u"), a)
            }
            (UnaryOp::Negate, Scalar::F32 | Scalar::Bool) => Expression::unary("-", a),
            (UnaryOp::Not, Scalar::Bool) => a.inverted(),
            (UnaryOp::Not, Scalar::F32 | Scalar::I32 | Scalar::U32) => Expression::unary("~", a),
            (UnaryOp::Abs, Scalar::I32) => self.help(Helper::WrappingAbs, [a]),
            (UnaryOp::Abs, Scalar::F32 | Scalar::U32 | Scalar::Bool) => {
                Expression::call("std::fabs", [a])
            }
            (UnaryOp::Sqrt | UnaryOp::ApproximateSqrt, _) => Expression::call("std::sqrt", [a]),
            (UnaryOp::Floor, _) => Expression::call("std::floor", [a]),
            (UnaryOp::Ceil, _) => Expression::call("std::ceil", [a]),
            (UnaryOp::Trunc, _) => Expression::call("std::trunc", [a]),
            (UnaryOp::RoundEven, _) => Expression::call("std::nearbyint", [a]),
            (UnaryOp::ApproximateReciprocal, _) => Expression::binary(ops::DIVIDE, one(), a),
            (UnaryOp::ApproximateInverseSqrt, _) => {
                Expression::binary(ops::DIVIDE, one(), Expression::call("std::sqrt", [a]))
            }
            (UnaryOp::Seldom, _) => a,
        }
    }

    fn binary(&mut self, op: BinaryOp, scalar: Scalar, a: Expression, b: Expression) -> Expression {
        let wraps = scalar == Scalar::I32;
        let is_bool = scalar == Scalar::Bool;
        let helper = match op {
            BinaryOp::Add if wraps => Helper::WrappingAdd,
            BinaryOp::Subtract if wraps => Helper::WrappingSubtract,
            BinaryOp::Multiply if wraps => Helper::WrappingMultiply,
            BinaryOp::Divide if scalar != Scalar::F32 => Helper::Quotient,
            BinaryOp::Remainder => Helper::Modulo,
            BinaryOp::Min => Helper::Minimum,
            BinaryOp::Max => Helper::Maximum,
            BinaryOp::ShiftLeft => Helper::ShiftLeft,
            BinaryOp::ShiftRight => Helper::ShiftRight,
            BinaryOp::MultiplyHigh => Helper::MultiplyHigh,
            BinaryOp::Add => return Expression::binary(ops::ADD, a, b),
            BinaryOp::Subtract => return Expression::binary(ops::SUBTRACT, a, b),
            BinaryOp::Multiply => return Expression::binary(ops::MULTIPLY, a, b),
            BinaryOp::Divide => return Expression::binary(ops::DIVIDE, a, b),
            BinaryOp::And if is_bool => return Expression::binary(ops::AND, a, b),
            BinaryOp::Or if is_bool => return Expression::binary(ops::OR, a, b),
            BinaryOp::Xor if is_bool => return Expression::binary(ops::NOT_EQUAL, a, b),
            BinaryOp::And => return Expression::binary(ops::BIT_AND, a, b),
            BinaryOp::Or => return Expression::binary(ops::BIT_OR, a, b),
            BinaryOp::Xor => return Expression::binary(ops::BIT_XOR, a, b),
        };
        match unsigned_operator(op, scalar, &b) {
            Some(operator) => Expression::binary(operator, a, b),
            None => self.help(helper, [a, b]),
        }
    }

    fn convert(&mut self, from: Scalar, to: Scalar, a: Expression) -> Expression {
        match (from, to) {
            (Scalar::F32, Scalar::F32)
            | (Scalar::I32, Scalar::I32)
            | (Scalar::U32, Scalar::U32)
            | (Scalar::Bool, Scalar::Bool) => a,
            (Scalar::F32, Scalar::I32) => self.help(Helper::ToInt, [a]),
            (Scalar::F32, Scalar::U32) => self.help(Helper::ToUint, [a]),
            (Scalar::F32, Scalar::Bool) => {
                Expression::binary(ops::NOT_EQUAL, a, Expression::atom("0.0f"))
            }
            (Scalar::I32, Scalar::Bool) => {
                Expression::binary(ops::NOT_EQUAL, a, Expression::atom("0"))
            }
            (Scalar::U32, Scalar::Bool) => {
                Expression::binary(ops::NOT_EQUAL, a, Expression::atom("0u"))
            }
            (Scalar::I32 | Scalar::U32 | Scalar::Bool, Scalar::F32) => {
                Expression::call("float", [a])
            }
            (Scalar::U32 | Scalar::Bool, Scalar::I32) => Expression::call("int32_t", [a]),
            (Scalar::I32 | Scalar::Bool, Scalar::U32) => Expression::call("uint32_t", [a]),
        }
    }

    fn bitcast(&mut self, from: Scalar, to: Scalar, a: Expression) -> Expression {
        match (from, to) {
            (Scalar::F32, Scalar::U32) => self.help(Helper::BitsOf, [a]),
            (Scalar::F32, Scalar::I32) => {
                let bits = self.help(Helper::BitsOf, [a]);
                Expression::call("int32_t", [bits])
            }
            (Scalar::U32, Scalar::F32) => self.help(Helper::FloatOf, [a]),
            (Scalar::I32, Scalar::F32) => {
                self.help(Helper::FloatOf, [Expression::call("uint32_t", [a])])
            }
            (Scalar::I32, Scalar::U32) => Expression::call("uint32_t", [a]),
            (Scalar::U32, Scalar::I32) => Expression::call("int32_t", [a]),
            (Scalar::F32 | Scalar::Bool, Scalar::F32 | Scalar::Bool)
            | (Scalar::I32, Scalar::I32 | Scalar::Bool)
            | (Scalar::U32, Scalar::U32 | Scalar::Bool)
            | (Scalar::Bool, Scalar::I32 | Scalar::U32) => a,
        }
    }
}

/// Returns `condition ? a : b`, or a shorter form if a value is true or false.
fn choice(condition: Expression, a: Expression, b: Expression) -> Expression {
    let known = |value: &Expression| match value {
        Expression::Atom { text, .. } => text.parse::<bool>().ok(),
        _ => None,
    };
    match (known(&a), known(&b)) {
        (Some(true), Some(false)) => condition,
        (Some(false), Some(true)) => condition.inverted(),
        (Some(true), None) => Expression::binary(ops::OR, condition, b),
        (None, Some(false)) => Expression::binary(ops::AND, condition, a),
        (Some(false), None) => Expression::binary(ops::AND, condition.inverted(), b),
        (None, Some(true)) => Expression::binary(ops::OR, condition.inverted(), a),
        (Some(_), Some(_)) | (None, None) => Expression::choice(condition, a, b),
    }
}

/// Returns the C++ operator that is equivalent on unsigned numbers for this second operand.
fn unsigned_operator(op: BinaryOp, scalar: Scalar, b: &Expression) -> Option<Operator> {
    let Expression::Atom { text, .. } = b else { return None };
    if scalar != Scalar::U32 || !text.starts_with(|first: char| first.is_ascii_digit()) {
        return None;
    }
    let is_shift = text.strip_suffix('u')?.parse::<u32>().is_ok_and(|by| by < 32);
    match op {
        BinaryOp::ShiftLeft if is_shift => Some(ops::SHIFT_LEFT),
        BinaryOp::ShiftRight if is_shift => Some(ops::SHIFT_RIGHT),
        BinaryOp::Divide if text != "0u" => Some(ops::DIVIDE),
        BinaryOp::Remainder if text != "0u" => Some(ops::REMAINDER),
        _ => None,
    }
}

fn comparison(op: CompareOp) -> Operator {
    match op {
        CompareOp::Equal => ops::EQUAL,
        CompareOp::NotEqual => ops::NOT_EQUAL,
        CompareOp::Less => ops::LESS,
        CompareOp::LessEqual => ops::LESS_EQUAL,
        CompareOp::Greater => ops::GREATER,
        CompareOp::GreaterEqual => ops::GREATER_EQUAL,
    }
}
