//! The evaluator's arithmetic: operators, conversions and built-in functions on constant leaves.

use rtsl_ir::evaluate;
use rtsl_ir::{BinaryOp, CompareOp, Constant, Scalar, UnaryOp};
use rtsl_spec::builtins::{Operation, Special};

use super::evaluated::{Evaluated, Stop, Value};
use crate::hir::{BinaryOperator, Type};

pub(super) fn converted(value: Constant, to: Scalar) -> Constant {
    if value.scalar() == to {
        return value;
    }
    Constant::from_bits(to, evaluate::convert(value.scalar(), to)(value.bits()))
}

pub(super) fn diagonal(value: Constant, columns: u8, rows: u8) -> Value {
    let element = |column, row| if column == row { value } else { Constant::F32(0.0) };
    (0..columns).flat_map(|column| (0..rows).map(move |row| element(column, row))).collect()
}

/// A matrix with rows and columns removed or added; added entries come from the identity.
pub(super) fn resized(leaves: &[Constant], from_rows: u8, columns: u8, rows: u8) -> Value {
    let from_columns = leaves.len() / usize::from(from_rows);
    let mut result = Value::new();
    for column in 0..usize::from(columns) {
        for row in 0..usize::from(rows) {
            let inside = column < from_columns && row < usize::from(from_rows);
            result.push(if inside {
                leaves[column * usize::from(from_rows) + row]
            } else {
                Constant::F32(if column == row { 1.0 } else { 0.0 })
            });
        }
    }
    result
}

pub(super) fn apply_unary(op: UnaryOp, value: Constant) -> Evaluated<Constant> {
    let function = evaluate::unary(op, value.scalar()).ok_or(Stop::Error)?;
    Ok(Constant::from_bits(value.scalar(), function(value.bits())))
}

pub(super) fn apply_binary(op: BinaryOp, a: Constant, b: Constant) -> Evaluated<Constant> {
    let function = evaluate::binary(op, a.scalar()).ok_or(Stop::Error)?;
    Ok(Constant::from_bits(a.scalar(), function(a.bits(), b.bits())))
}

fn apply_compare(op: CompareOp, a: Constant, b: Constant) -> Evaluated<Constant> {
    let function = evaluate::compare(op, a.scalar()).ok_or(Stop::Error)?;
    Ok(Constant::Bool(function(a.bits(), b.bits()) != 0))
}

/// The operation that a binary operator of the typed tree performs on each pair of leaves.
enum Pairwise {
    Binary(BinaryOp),
    Compare(CompareOp),
}

fn pairwise(operator: BinaryOperator) -> Pairwise {
    match operator {
        BinaryOperator::Add => Pairwise::Binary(BinaryOp::Add),
        BinaryOperator::Subtract => Pairwise::Binary(BinaryOp::Subtract),
        BinaryOperator::Multiply => Pairwise::Binary(BinaryOp::Multiply),
        BinaryOperator::Divide => Pairwise::Binary(BinaryOp::Divide),
        BinaryOperator::Remainder => Pairwise::Binary(BinaryOp::Remainder),
        BinaryOperator::ShiftLeft => Pairwise::Binary(BinaryOp::ShiftLeft),
        BinaryOperator::ShiftRight => Pairwise::Binary(BinaryOp::ShiftRight),
        BinaryOperator::BitAnd | BinaryOperator::And => Pairwise::Binary(BinaryOp::And),
        BinaryOperator::BitOr | BinaryOperator::Or => Pairwise::Binary(BinaryOp::Or),
        BinaryOperator::BitXor | BinaryOperator::Xor => Pairwise::Binary(BinaryOp::Xor),
        BinaryOperator::Less => Pairwise::Compare(CompareOp::Less),
        BinaryOperator::LessEqual => Pairwise::Compare(CompareOp::LessEqual),
        BinaryOperator::Greater => Pairwise::Compare(CompareOp::Greater),
        BinaryOperator::GreaterEqual => Pairwise::Compare(CompareOp::GreaterEqual),
        BinaryOperator::Equal => Pairwise::Compare(CompareOp::Equal),
        BinaryOperator::NotEqual => Pairwise::Compare(CompareOp::NotEqual),
    }
}

/// Evaluates `a operator b` on leaves.
pub(super) fn combine(
    operator: BinaryOperator,
    left: &Type,
    a: &[Constant],
    right: &Type,
    b: &[Constant],
) -> Evaluated<Value> {
    if operator == BinaryOperator::Multiply
        && let Some((rows, inner, columns)) = product_shape(left, right)
    {
        return product(a, b, rows, inner, columns);
    }
    let count = a.len().max(b.len());
    let pairs = (0..count).map(|index| (a[index.min(a.len() - 1)], b[index.min(b.len() - 1)]));
    match (pairwise(operator), operator) {
        (Pairwise::Binary(op), _) => pairs
            .map(|(a, b)| apply_binary(op, a, Constant::from_bits(a.scalar(), b.bits())))
            .collect(),
        (Pairwise::Compare(_), BinaryOperator::Equal | BinaryOperator::NotEqual) => {
            let mut equal = true;
            for (a, b) in pairs {
                equal &= apply_compare(CompareOp::Equal, a, b)?.bits() != 0;
            }
            Ok(vec![Constant::Bool(equal == (operator == BinaryOperator::Equal))])
        }
        (Pairwise::Compare(op), _) => pairs.map(|(a, b)| apply_compare(op, a, b)).collect(),
    }
}

/// If the types make `*` a product of linear algebra: the rows of the left side, the inner
/// dimension and the columns of the right side.
fn product_shape(left: &Type, right: &Type) -> Option<(usize, usize, usize)> {
    let size = |size: &u8| usize::from(*size);
    match (left, right) {
        (Type::Matrix(columns, rows), Type::Matrix(other, _)) => {
            Some((size(rows), size(columns), size(other)))
        }
        (Type::Matrix(columns, rows), Type::Vector(..)) => Some((size(rows), size(columns), 1)),
        (Type::Vector(..), Type::Matrix(columns, rows)) => Some((1, size(rows), size(columns))),
        _ => None,
    }
}

fn product(
    a: &[Constant],
    b: &[Constant],
    rows: usize,
    inner: usize,
    columns: usize,
) -> Evaluated<Value> {
    let mut result = Value::new();
    for column in 0..columns {
        for row in 0..rows {
            let mut sum = apply_binary(BinaryOp::Multiply, a[row], b[column * inner])?;
            for index in 1..inner {
                let term = apply_binary(
                    BinaryOp::Multiply,
                    a[index * rows + row],
                    b[column * inner + index],
                )?;
                sum = apply_binary(BinaryOp::Add, sum, term)?;
            }
            result.push(sum);
        }
    }
    Ok(result)
}

pub(super) fn operate(operation: Operation, operands: &[Constant]) -> Evaluated<Constant> {
    let unary = |op| apply_unary(op, operands[0]);
    let binary = |op| apply_binary(op, operands[0], operands[1]);
    let compare = |op| apply_compare(op, operands[0], operands[1]);
    match operation {
        Operation::Abs => unary(UnaryOp::Abs),
        Operation::Sqrt => unary(UnaryOp::Sqrt),
        Operation::Floor => unary(UnaryOp::Floor),
        Operation::Ceil => unary(UnaryOp::Ceil),
        Operation::Trunc => unary(UnaryOp::Trunc),
        Operation::RoundEven => unary(UnaryOp::RoundEven),
        Operation::Not => unary(UnaryOp::Not),
        Operation::Seldom => unary(UnaryOp::Seldom),
        Operation::Min => binary(BinaryOp::Min),
        Operation::Max => binary(BinaryOp::Max),
        Operation::MultiplyHigh => binary(BinaryOp::MultiplyHigh),
        Operation::Less => compare(CompareOp::Less),
        Operation::LessEqual => compare(CompareOp::LessEqual),
        Operation::Greater => compare(CompareOp::Greater),
        Operation::GreaterEqual => compare(CompareOp::GreaterEqual),
        Operation::Equal => compare(CompareOp::Equal),
        Operation::NotEqual => compare(CompareOp::NotEqual),
        Operation::Fma => {
            let [a, b, c] = [0, 1, 2].map(|index: usize| operands[index].bits());
            Ok(Constant::from_bits(Scalar::F32, evaluate::fma(a, b, c)))
        }
        Operation::BitcastToUint => bitcast(operands[0], Scalar::U32),
        Operation::BitcastToFloat => bitcast(operands[0], Scalar::F32),
    }
}

fn bitcast(value: Constant, to: Scalar) -> Evaluated<Constant> {
    let function = evaluate::bitcast(value.scalar(), to).ok_or(Stop::Error)?;
    Ok(Constant::from_bits(to, function(value.bits())))
}

/// Evaluates the built-in functions that have specific lowerings; `None` for those that depend on
/// the ray.
pub(super) fn apply_special(special: Special, ty: &Type, arguments: &[Value]) -> Option<Value> {
    match special {
        Special::Rgb => arguments.first().cloned(),
        Special::Any => {
            Some(vec![Constant::Bool(arguments[0].iter().any(|each| each.bits() != 0))])
        }
        Special::All => {
            Some(vec![Constant::Bool(arguments[0].iter().all(|each| each.bits() != 0))])
        }
        Special::MatrixCompMult => arguments[0]
            .iter()
            .zip(&arguments[1])
            .map(|(a, b)| apply_binary(BinaryOp::Multiply, *a, *b).ok())
            .collect(),
        Special::Transpose => {
            let Type::Matrix(columns, rows) = ty else { return None };
            let (columns, rows) = (usize::from(*columns), usize::from(*rows));
            let element = |column: usize, row: usize| arguments[0][row * columns + column];
            Some(
                (0..columns)
                    .flat_map(|column| (0..rows).map(move |row| element(column, row)))
                    .collect(),
            )
        }
        Special::Hit
        | Special::Trace
        | Special::Occluded
        | Special::Ambient
        | Special::NearestHit
        | Special::Query(_)
        | Special::Rand
        | Special::Map(..)
        | Special::Gradient
        | Special::Change(_)
        | Special::Inside
        | Special::IsSet
        | Special::IsTextured => None,
    }
}
