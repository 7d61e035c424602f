//! Integers whose only set bit is the sign of an f32.

use rtsl_ir::{BinaryOp, Constant, OpKind, Value};

pub const SIGN: u32 = 1 << 31;

/// True if all bits of an integer except the highest are 0; `definitions` is indexed by value.
pub fn is_sign(definitions: &[Option<&OpKind>], value: Value) -> bool {
    let constant = |value| constant(definitions, value);
    match definitions[value.0 as usize] {
        Some(OpKind::Constant(_)) => constant(value).is_some_and(|bits| bits & !SIGN == 0),
        Some(OpKind::Binary(BinaryOp::And, a, b)) => {
            [*a, *b].into_iter().any(|operand| constant(operand) == Some(SIGN))
        }
        Some(OpKind::Binary(BinaryOp::ShiftLeft, _, count)) => {
            constant(*count).is_some_and(|count| count & 31 == 31)
        }
        _ => false,
    }
}

/// Returns the bits of an integer constant.
pub fn constant(definitions: &[Option<&OpKind>], value: Value) -> Option<u32> {
    match definitions[value.0 as usize] {
        Some(OpKind::Constant(constant @ (Constant::I32(_) | Constant::U32(_)))) => {
            Some(constant.bits())
        }
        _ => None,
    }
}
