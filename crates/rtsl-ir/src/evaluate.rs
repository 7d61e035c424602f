//! The scalar operations, exact to the bit: used by the interpreter and for constant folding.
//!
//! Values are their [bits](Constant::bits); a bool is 0 or 1. Each operation is looked up once, by operator and type,
//! and is then a plain function. The lookup returns `None` if the operator does not take that type, which the verifier
//! uses for its check of types.
//!
//! Nothing here calls a transcendental function of the standard library: the functions used (`sqrt`, the roundings,
//! `mul_add`, conversions) are exact on every machine. The bits of a NaN that arithmetic produces differ between
//! machines, so [`OpKind::Bitcast`] from f32 turns every NaN into [`CANONICAL_NAN`].

use crate::{BinaryOp, CompareOp, Constant, OpKind, Scalar, UnaryOp, Value};

/// The result of `bitcast` for every NaN.
pub const CANONICAL_NAN: u32 = 0x7fc0_0000;

/// A computation on bits with one operand.
pub type UnaryFunction = fn(u32) -> u32;

/// A computation on bits with two operands.
pub type BinaryFunction = fn(u32, u32) -> u32;

/// Lifts a computation on f32, i32 or u32 to bits.
macro_rules! lift {
    (f32, |$a:ident| $result:expr) => {
        Some(|a| {
            let $a = f32::from_bits(a);
            f32::to_bits($result)
        })
    };
    (f32, |$a:ident, $b:ident| $result:expr) => {
        Some(|a, b| {
            let ($a, $b) = (f32::from_bits(a), f32::from_bits(b));
            f32::to_bits($result)
        })
    };
    (i32, |$a:ident| $result:expr) => {
        Some(|a| {
            let $a = a as i32;
            let result: i32 = $result;
            result as u32
        })
    };
    (i32, |$a:ident, $b:ident| $result:expr) => {
        Some(|a, b| {
            let ($a, $b) = (a as i32, b as i32);
            let result: i32 = $result;
            result as u32
        })
    };
    (u32, |$a:ident| $result:expr) => {
        Some(|$a| $result)
    };
    (u32, |$a:ident, $b:ident| $result:expr) => {
        Some(|$a, $b| $result)
    };
}

/// Looks up `op` on a value of this type.
pub fn unary(op: UnaryOp, scalar: Scalar) -> Option<UnaryFunction> {
    match (op, scalar) {
        (UnaryOp::Negate, Scalar::F32) => lift!(f32, |a| -a),
        (UnaryOp::Negate, Scalar::I32 | Scalar::U32) => lift!(u32, |a| a.wrapping_neg()),
        (UnaryOp::Not, Scalar::I32 | Scalar::U32) => lift!(u32, |a| !a),
        (UnaryOp::Not, Scalar::Bool) => lift!(u32, |a| a ^ 1),
        (UnaryOp::Abs, Scalar::F32) => lift!(f32, |a| a.abs()),
        (UnaryOp::Abs, Scalar::I32) => lift!(i32, |a| a.wrapping_abs()),
        (UnaryOp::Sqrt, Scalar::F32) => lift!(f32, |a| a.sqrt()),
        (UnaryOp::Floor, Scalar::F32) => lift!(f32, |a| a.floor()),
        (UnaryOp::Ceil, Scalar::F32) => lift!(f32, |a| a.ceil()),
        (UnaryOp::Trunc, Scalar::F32) => lift!(f32, |a| a.trunc()),
        (UnaryOp::RoundEven, Scalar::F32) => lift!(f32, |a| a.round_ties_even()),
        // Exact here; approximations differ between machines.
        (UnaryOp::ApproximateReciprocal, Scalar::F32) => lift!(f32, |a| 1.0 / a),
        (UnaryOp::ApproximateInverseSqrt, Scalar::F32) => lift!(f32, |a| 1.0 / a.sqrt()),
        (UnaryOp::ApproximateSqrt, Scalar::F32) => lift!(f32, |a| a.sqrt()),
        (UnaryOp::Seldom, Scalar::Bool) => Some(|a| a),
        (UnaryOp::Negate, Scalar::Bool)
        | (UnaryOp::Seldom, Scalar::F32 | Scalar::I32 | Scalar::U32)
        | (UnaryOp::Not, Scalar::F32)
        | (UnaryOp::Abs, Scalar::U32 | Scalar::Bool)
        | (
            UnaryOp::Sqrt
            | UnaryOp::Floor
            | UnaryOp::Ceil
            | UnaryOp::Trunc
            | UnaryOp::RoundEven
            | UnaryOp::ApproximateReciprocal
            | UnaryOp::ApproximateInverseSqrt
            | UnaryOp::ApproximateSqrt,
            Scalar::I32 | Scalar::U32 | Scalar::Bool,
        ) => None,
    }
}

/// Looks up `op` on two values of this type.
pub fn binary(op: BinaryOp, scalar: Scalar) -> Option<BinaryFunction> {
    match scalar {
        Scalar::F32 => binary_f32(op),
        Scalar::I32 => binary_i32(op),
        Scalar::U32 => binary_u32(op),
        Scalar::Bool => binary_bool(op),
    }
}

/// Looks up `op` on two values of this type; the function returns 0 or 1.
pub fn compare(op: CompareOp, scalar: Scalar) -> Option<BinaryFunction> {
    macro_rules! compare {
        (|$a:ident, $b:ident| $left:expr, $right:expr) => {
            match op {
                CompareOp::Equal => |$a: u32, $b: u32| ($left == $right) as u32,
                CompareOp::NotEqual => |$a: u32, $b: u32| ($left != $right) as u32,
                CompareOp::Less => |$a: u32, $b: u32| ($left < $right) as u32,
                CompareOp::LessEqual => |$a: u32, $b: u32| ($left <= $right) as u32,
                CompareOp::Greater => |$a: u32, $b: u32| ($left > $right) as u32,
                CompareOp::GreaterEqual => |$a: u32, $b: u32| ($left >= $right) as u32,
            }
        };
    }
    match scalar {
        Scalar::F32 => Some(compare!(|a, b| f32::from_bits(a), f32::from_bits(b))),
        Scalar::I32 => Some(compare!(|a, b| a as i32, b as i32)),
        Scalar::U32 => Some(compare!(|a, b| a, b)),
        Scalar::Bool => match op {
            CompareOp::Equal => Some(|a, b| (a == b) as u32),
            CompareOp::NotEqual => Some(|a, b| (a != b) as u32),
            CompareOp::Less
            | CompareOp::LessEqual
            | CompareOp::Greater
            | CompareOp::GreaterEqual => None,
        },
    }
}

/// Returns `a * b + c`, rounded once.
pub fn fma(a: u32, b: u32, c: u32) -> u32 {
    f32::from_bits(a).mul_add(f32::from_bits(b), f32::from_bits(c)).to_bits()
}

/// Looks up [`OpKind::Convert`] between these types.
pub fn convert(from: Scalar, to: Scalar) -> UnaryFunction {
    match (from, to) {
        (Scalar::F32, Scalar::F32)
        | (Scalar::I32 | Scalar::U32, Scalar::I32 | Scalar::U32)
        | (Scalar::Bool, Scalar::Bool | Scalar::I32 | Scalar::U32) => |a| a,
        (Scalar::F32, Scalar::I32) => |a| f32::from_bits(a) as i32 as u32,
        (Scalar::F32, Scalar::U32) => |a| f32::from_bits(a) as u32,
        (Scalar::F32, Scalar::Bool) => |a| (f32::from_bits(a) != 0.0) as u32,
        (Scalar::I32, Scalar::F32) => |a| (a as i32 as f32).to_bits(),
        (Scalar::U32 | Scalar::Bool, Scalar::F32) => |a| (a as f32).to_bits(),
        (Scalar::I32 | Scalar::U32, Scalar::Bool) => |a| (a != 0) as u32,
    }
}

/// Looks up [`OpKind::Bitcast`] between these types.
pub fn bitcast(from: Scalar, to: Scalar) -> Option<UnaryFunction> {
    match (from, to) {
        (Scalar::Bool, _) | (_, Scalar::Bool) => None,
        (Scalar::F32, Scalar::F32) | (Scalar::I32 | Scalar::U32, _) => Some(|a| a),
        (Scalar::F32, Scalar::I32 | Scalar::U32) => {
            Some(|a| if f32::from_bits(a).is_nan() { CANONICAL_NAN } else { a })
        }
    }
}

/// Returns the result of an operation whose operands are all known constants; `None` if one is not constant or the
/// result depends on more than the operands.
pub fn fold(kind: &OpKind, known: impl Fn(Value) -> Option<Constant>) -> Option<Constant> {
    let (scalar, bits) = match *kind {
        OpKind::Constant(constant) => (constant.scalar(), constant.bits()),
        OpKind::Unary(op, a) => {
            let a = known(a)?;
            (a.scalar(), unary(op, a.scalar())?(a.bits()))
        }
        OpKind::Binary(op, a, b) => {
            let (a, b) = (known(a)?, known(b)?);
            (a.scalar(), binary(op, a.scalar())?(a.bits(), b.bits()))
        }
        OpKind::Compare(op, a, b) => {
            let (a, b) = (known(a)?, known(b)?);
            (Scalar::Bool, compare(op, a.scalar())?(a.bits(), b.bits()))
        }
        OpKind::Select(condition, a, b) => {
            let chosen = if known(condition)?.bits() != 0 { known(a)? } else { known(b)? };
            (chosen.scalar(), chosen.bits())
        }
        OpKind::Fma(a, b, c) => {
            (Scalar::F32, fma(known(a)?.bits(), known(b)?.bits(), known(c)?.bits()))
        }
        OpKind::Convert(to, a) => {
            let a = known(a)?;
            (to, convert(a.scalar(), to)(a.bits()))
        }
        OpKind::Bitcast(to, a) => {
            let a = known(a)?;
            (to, bitcast(a.scalar(), to)?(a.bits()))
        }
        OpKind::Load(..)
        | OpKind::Store(..)
        | OpKind::Length(_)
        | OpKind::If { .. }
        | OpKind::Loop { .. }
        | OpKind::Trace { .. }
        | OpKind::Occluded { .. }
        | OpKind::LightCount
        | OpKind::LightSample { .. }
        | OpKind::Ambient
        | OpKind::Rand
        | OpKind::Query(..)
        | OpKind::ReferenceCall(_)
        | OpKind::IsSet(..)
        | OpKind::Seed(_)
        | OpKind::Derivative(..)
        | OpKind::ChainRule(..)
        | OpKind::ReferenceCount(_)
        | OpKind::Report(..)
        | OpKind::ReportBudget => return None,
    };
    Some(Constant::from_bits(scalar, bits))
}

fn binary_f32(op: BinaryOp) -> Option<BinaryFunction> {
    match op {
        BinaryOp::Add => lift!(f32, |a, b| a + b),
        BinaryOp::Subtract => lift!(f32, |a, b| a - b),
        BinaryOp::Multiply => lift!(f32, |a, b| a * b),
        BinaryOp::Divide => lift!(f32, |a, b| a / b),
        BinaryOp::Min => lift!(f32, |a, b| if b < a { b } else { a }),
        BinaryOp::Max => lift!(f32, |a, b| if a < b { b } else { a }),
        BinaryOp::Remainder
        | BinaryOp::And
        | BinaryOp::Or
        | BinaryOp::Xor
        | BinaryOp::ShiftLeft
        | BinaryOp::ShiftRight
        | BinaryOp::MultiplyHigh => None,
    }
}

fn binary_i32(op: BinaryOp) -> Option<BinaryFunction> {
    match op {
        BinaryOp::Divide => lift!(i32, |a, b| if b == 0 { 0 } else { a.wrapping_div(b) }),
        BinaryOp::Remainder => lift!(i32, |a, b| if b == 0 { 0 } else { a.wrapping_rem(b) }),
        BinaryOp::Min => lift!(i32, |a, b| a.min(b)),
        BinaryOp::Max => lift!(i32, |a, b| a.max(b)),
        BinaryOp::ShiftRight => lift!(i32, |a, b| a.wrapping_shr(b as u32)),
        BinaryOp::MultiplyHigh => {
            lift!(i32, |a, b| ((i64::from(a) * i64::from(b)) >> 32) as i32)
        }
        BinaryOp::Add
        | BinaryOp::Subtract
        | BinaryOp::Multiply
        | BinaryOp::And
        | BinaryOp::Or
        | BinaryOp::Xor
        | BinaryOp::ShiftLeft => binary_u32(op),
    }
}

fn binary_u32(op: BinaryOp) -> Option<BinaryFunction> {
    match op {
        BinaryOp::Add => lift!(u32, |a, b| a.wrapping_add(b)),
        BinaryOp::Subtract => lift!(u32, |a, b| a.wrapping_sub(b)),
        BinaryOp::Multiply => lift!(u32, |a, b| a.wrapping_mul(b)),
        BinaryOp::Divide => lift!(u32, |a, b| a.checked_div(b).unwrap_or(0)),
        BinaryOp::Remainder => lift!(u32, |a, b| a.checked_rem(b).unwrap_or(0)),
        BinaryOp::Min => lift!(u32, |a, b| a.min(b)),
        BinaryOp::Max => lift!(u32, |a, b| a.max(b)),
        BinaryOp::And => lift!(u32, |a, b| a & b),
        BinaryOp::Or => lift!(u32, |a, b| a | b),
        BinaryOp::Xor => lift!(u32, |a, b| a ^ b),
        BinaryOp::ShiftLeft => lift!(u32, |a, b| a.wrapping_shl(b)),
        BinaryOp::ShiftRight => lift!(u32, |a, b| a.wrapping_shr(b)),
        BinaryOp::MultiplyHigh => {
            lift!(u32, |a, b| ((u64::from(a) * u64::from(b)) >> 32) as u32)
        }
    }
}

fn binary_bool(op: BinaryOp) -> Option<BinaryFunction> {
    match op {
        BinaryOp::And | BinaryOp::Or | BinaryOp::Xor => binary_u32(op),
        BinaryOp::Add
        | BinaryOp::Subtract
        | BinaryOp::Multiply
        | BinaryOp::Divide
        | BinaryOp::Remainder
        | BinaryOp::Min
        | BinaryOp::Max
        | BinaryOp::ShiftLeft
        | BinaryOp::ShiftRight
        | BinaryOp::MultiplyHigh => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn binary_of(op: BinaryOp, a: Constant, b: Constant) -> Constant {
        let values = [a, b];
        fold(&OpKind::Binary(op, Value(0), Value(1)), |value| Some(values[value.0 as usize]))
            .unwrap()
    }

    fn convert_of(to: Scalar, a: Constant) -> Constant {
        fold(&OpKind::Convert(to, Value(0)), |_| Some(a)).unwrap()
    }

    #[test]
    fn integer_edges() {
        use BinaryOp::*;
        use Constant::{I32, U32};
        let table = [
            (Divide, I32(7), I32(0), I32(0)),
            (Divide, I32(-7), I32(2), I32(-3)),
            (Divide, I32(i32::MIN), I32(-1), I32(i32::MIN)),
            (Remainder, I32(i32::MIN), I32(-1), I32(0)),
            (Remainder, I32(-7), I32(3), I32(-1)),
            (Remainder, I32(7), I32(0), I32(0)),
            (Divide, U32(7), U32(0), U32(0)),
            (Remainder, U32(7), U32(0), U32(0)),
            (ShiftLeft, I32(1), I32(33), I32(2)),
            (ShiftRight, I32(-8), I32(-31), I32(-4)),
            (ShiftRight, U32(0x8000_0000), U32(63), U32(1)),
            (MultiplyHigh, I32(-1), I32(-1), I32(0)),
            (MultiplyHigh, U32(u32::MAX), U32(u32::MAX), U32(u32::MAX - 1)),
            (Add, I32(i32::MAX), I32(1), I32(i32::MIN)),
        ];
        for (op, a, b, expected) in table {
            assert_eq!(binary_of(op, a, b), expected, "{op:?} {a:?} {b:?}");
        }
    }

    #[test]
    fn min_and_max_keep_the_first_operand() {
        use Constant::F32;
        let nan = f32::NAN;
        for op in [BinaryOp::Min, BinaryOp::Max] {
            assert_eq!(binary_of(op, F32(0.0), F32(-0.0)), F32(0.0));
            assert_eq!(binary_of(op, F32(-0.0), F32(0.0)), F32(-0.0));
            assert_eq!(binary_of(op, F32(1.0), F32(nan)), F32(1.0));
            assert_eq!(binary_of(op, F32(nan), F32(1.0)), F32(nan));
        }
    }

    #[test]
    fn conversions_saturate() {
        use Constant::{Bool, F32, I32, U32};
        let table = [
            (Scalar::I32, F32(f32::NAN), I32(0)),
            (Scalar::I32, F32(3e9), I32(i32::MAX)),
            (Scalar::I32, F32(-2.9), I32(-2)),
            (Scalar::U32, F32(-1.0), U32(0)),
            (Scalar::U32, F32(f32::INFINITY), U32(u32::MAX)),
            (Scalar::Bool, F32(f32::NAN), Bool(true)),
            (Scalar::Bool, F32(-0.0), Bool(false)),
            (Scalar::F32, U32(u32::MAX), F32(4_294_967_296.0)),
            (Scalar::F32, I32(16_777_217), F32(16_777_216.0)),
            (Scalar::F32, Bool(true), F32(1.0)),
            (Scalar::U32, I32(-1), U32(u32::MAX)),
        ];
        for (to, a, expected) in table {
            assert_eq!(convert_of(to, a), expected, "{to:?} {a:?}");
        }
    }

    #[test]
    fn bitcast_shows_one_nan() {
        let bits = |bits| {
            let constant = Constant::F32(f32::from_bits(bits));
            fold(&OpKind::Bitcast(Scalar::U32, Value(0)), |_| Some(constant)).unwrap()
        };
        assert_eq!(bits(0xffc1_2345), Constant::U32(CANONICAL_NAN));
        assert_eq!(bits(0x8000_0000), Constant::U32(0x8000_0000));
    }

    #[test]
    fn fma_rounds_once() {
        let a = 1.0 + f32::EPSILON;
        let product = f32::from_bits(fma(a.to_bits(), a.to_bits(), (-(a * a)).to_bits()));
        assert_eq!(product, f32::EPSILON * f32::EPSILON);
    }
}
