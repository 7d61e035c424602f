//! Interval arithmetic on integers: bounds on a result from bounds on the operands.
//!
//! Bounds are values of the type itself, so a u32 is never negative. An operation that may wrap gives the full range.
//! The rules follow [`evaluate`](crate::evaluate).

use crate::{BinaryOp, CompareOp, Constant, Scalar, UnaryOp};

/// All integers from `low` to `high`, which is never empty. A bool is 0 or 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interval {
    /// The least value.
    pub low: i64,
    /// The greatest value.
    pub high: i64,
}

impl Interval {
    /// Returns the range of a type; `None` for f32.
    pub const fn all(scalar: Scalar) -> Option<Interval> {
        match scalar {
            Scalar::F32 => None,
            Scalar::I32 => Some(Interval { low: i32::MIN as i64, high: i32::MAX as i64 }),
            Scalar::U32 => Some(Interval { low: 0, high: u32::MAX as i64 }),
            Scalar::Bool => Some(Interval { low: 0, high: 1 }),
        }
    }

    /// Returns the interval of one value.
    pub const fn point(value: i64) -> Interval {
        Interval { low: value, high: value }
    }

    /// Returns the interval of a constant; `None` for f32.
    pub const fn of(constant: Constant) -> Option<Interval> {
        match constant {
            Constant::F32(_) => None,
            Constant::I32(value) => Some(Interval::point(value as i64)),
            Constant::U32(value) => Some(Interval::point(value as i64)),
            Constant::Bool(value) => Some(Interval::point(value as i64)),
        }
    }

    /// Returns the constant of this type if the interval holds one value only.
    pub const fn constant(self, scalar: Scalar) -> Option<Constant> {
        if self.low == self.high && !matches!(scalar, Scalar::F32) {
            Some(Constant::from_bits(scalar, self.low as u32))
        } else {
            None
        }
    }

    /// True if all of `other` lies in this interval.
    pub const fn contains(self, other: Interval) -> bool {
        self.low <= other.low && other.high <= self.high
    }

    /// Returns the least interval that contains both.
    pub fn hull(self, other: Interval) -> Interval {
        Interval { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Returns the common part of both, `None` if they are disjoint.
    pub fn intersection(self, other: Interval) -> Option<Interval> {
        let (low, high) = (self.low.max(other.low), self.high.min(other.high));
        (low <= high).then_some(Interval { low, high })
    }

    /// Returns `self` if it fits in the type, else the full range of the type.
    fn wrapped(self, scalar: Scalar) -> Option<Interval> {
        let all = Interval::all(scalar)?;
        Some(if all.contains(self) { self } else { all })
    }

    /// Returns the bounds of `op` on a value of this type; `None` for f32.
    pub fn unary(op: UnaryOp, scalar: Scalar, a: Interval) -> Option<Interval> {
        let all = Interval::all(scalar)?;
        match op {
            UnaryOp::Negate => Interval { low: -a.high, high: -a.low }.wrapped(scalar),
            UnaryOp::Not => match scalar {
                Scalar::Bool | Scalar::U32 => {
                    Some(Interval { low: all.high - a.high, high: all.high - a.low })
                }
                Scalar::I32 => Some(Interval { low: -1 - a.high, high: -1 - a.low }),
                Scalar::F32 => None,
            },
            UnaryOp::Abs if a.low >= 0 => Some(a),
            UnaryOp::Abs if a.high <= 0 => Interval { low: -a.high, high: -a.low }.wrapped(scalar),
            UnaryOp::Abs => Interval { low: 0, high: a.high.max(-a.low) }.wrapped(scalar),
            UnaryOp::Seldom => Some(a),
            UnaryOp::Sqrt
            | UnaryOp::Floor
            | UnaryOp::Ceil
            | UnaryOp::Trunc
            | UnaryOp::RoundEven
            | UnaryOp::ApproximateReciprocal
            | UnaryOp::ApproximateInverseSqrt
            | UnaryOp::ApproximateSqrt => None,
        }
    }

    /// Returns the bounds of `op` on two values of this type; `None` for f32.
    pub fn binary(op: BinaryOp, scalar: Scalar, a: Interval, b: Interval) -> Option<Interval> {
        let all = Interval::all(scalar)?;
        let both_positive = a.low >= 0 && b.low >= 0;
        match op {
            BinaryOp::Add => Interval { low: a.low + b.low, high: a.high + b.high }.wrapped(scalar),
            BinaryOp::Subtract => {
                Interval { low: a.low - b.high, high: a.high - b.low }.wrapped(scalar)
            }
            BinaryOp::Multiply => a.product(b).map_or(Some(all), |it| it.wrapped(scalar)),
            BinaryOp::Min => Some(Interval { low: a.low.min(b.low), high: a.high.min(b.high) }),
            BinaryOp::Max => Some(Interval { low: a.low.max(b.low), high: a.high.max(b.high) }),
            // Division by 0 gives 0.
            BinaryOp::Divide if both_positive => Some(Interval {
                low: if b.low > 0 { a.low / b.high } else { 0 },
                high: a.high / b.low.max(1),
            }),
            BinaryOp::Remainder if both_positive => {
                Some(Interval { low: 0, high: a.high.min((b.high - 1).max(0)) })
            }
            BinaryOp::And if both_positive => Some(Interval { low: 0, high: a.high.min(b.high) }),
            BinaryOp::And if a.low >= 0 => Some(Interval { low: 0, high: a.high }),
            BinaryOp::And if b.low >= 0 => Some(Interval { low: 0, high: b.high }),
            BinaryOp::Or if both_positive => {
                Some(Interval { low: a.low.max(b.low), high: all_bits(a.high | b.high) })
            }
            BinaryOp::Xor if both_positive => {
                Some(Interval { low: 0, high: all_bits(a.high | b.high) })
            }
            BinaryOp::ShiftLeft => {
                let (low, high) = b.shift_counts()?;
                let factors = Interval { low: 1 << low, high: 1 << high };
                a.product(factors).map_or(Some(all), |it| it.wrapped(scalar))
            }
            BinaryOp::ShiftRight => {
                let (low, high) = b.shift_counts()?;
                let ends = [a.low >> low, a.low >> high, a.high >> low, a.high >> high];
                Interval::around(ends)
            }
            BinaryOp::MultiplyHigh if both_positive => {
                Some(Interval { low: 0, high: ((a.high as u64 * b.high as u64) >> 32) as i64 })
            }
            BinaryOp::Divide
            | BinaryOp::Remainder
            | BinaryOp::And
            | BinaryOp::Or
            | BinaryOp::Xor
            | BinaryOp::MultiplyHigh => Some(all),
        }
    }

    /// Returns the bounds of a conversion from one type to another; `None` if the target is f32.
    pub fn convert(from: Scalar, to: Scalar, a: Option<Interval>) -> Option<Interval> {
        let all = Interval::all(to)?;
        match (from, a) {
            (Scalar::F32, _) | (_, None) => Some(all),
            (Scalar::I32 | Scalar::U32 | Scalar::Bool, Some(a)) => match to {
                Scalar::Bool if a.low > 0 || a.high < 0 => Some(Interval::point(1)),
                Scalar::Bool => Some(Interval { low: 0, high: i64::from(a != Interval::point(0)) }),
                // Only numbers that both types represent keep their value.
                Scalar::I32 | Scalar::U32 => a.wrapped(to),
                Scalar::F32 => None,
            },
        }
    }

    /// Returns the bounds of a comparison of two values, as a bool.
    pub fn compare(op: CompareOp, a: Interval, b: Interval) -> Interval {
        let (always, never) = match op {
            CompareOp::Less => (a.high < b.low, a.low >= b.high),
            CompareOp::LessEqual => (a.high <= b.low, a.low > b.high),
            CompareOp::Greater => (a.low > b.high, a.high <= b.low),
            CompareOp::GreaterEqual => (a.low >= b.high, a.high < b.low),
            CompareOp::Equal => (a.is_same_point(b), a.intersection(b).is_none()),
            CompareOp::NotEqual => (a.intersection(b).is_none(), a.is_same_point(b)),
        };
        Interval { low: i64::from(always), high: i64::from(!never) }
    }

    /// Returns the subintervals of two values for which a comparison of them can hold; `None` if it never holds.
    pub fn where_holds(op: CompareOp, a: Interval, b: Interval) -> Option<(Interval, Interval)> {
        let below = |value: i64| Interval { low: i64::MIN, high: value };
        let above = |value: i64| Interval { low: value, high: i64::MAX };
        match op {
            CompareOp::Less => {
                Some((a.intersection(below(b.high - 1))?, b.intersection(above(a.low + 1))?))
            }
            CompareOp::LessEqual => {
                Some((a.intersection(below(b.high))?, b.intersection(above(a.low))?))
            }
            CompareOp::Greater => {
                Some((a.intersection(above(b.low + 1))?, b.intersection(below(a.high - 1))?))
            }
            CompareOp::GreaterEqual => {
                Some((a.intersection(above(b.low))?, b.intersection(below(a.high))?))
            }
            CompareOp::Equal => a.intersection(b).map(|both| (both, both)),
            CompareOp::NotEqual => Some((a.without(b)?, b.without(a)?)),
        }
    }

    /// Removes the value of `other` if that is a single value at an end of this interval.
    fn without(self, other: Interval) -> Option<Interval> {
        if other.low != other.high {
            return Some(self);
        }
        let low = self.low + i64::from(self.low == other.low);
        let high = self.high - i64::from(self.high == other.low);
        (low <= high).then_some(Interval { low, high })
    }

    fn is_same_point(self, other: Interval) -> bool {
        self == other && self.low == self.high
    }

    /// Returns the hull of the products of the ends. Products of 32-bit integers, and shifts, fit in 64 bits.
    fn product(self, other: Interval) -> Option<Interval> {
        let ends = [
            self.low.checked_mul(other.low)?,
            self.low.checked_mul(other.high)?,
            self.high.checked_mul(other.low)?,
            self.high.checked_mul(other.high)?,
        ];
        Interval::around(ends)
    }

    fn around(values: [i64; 4]) -> Option<Interval> {
        Some(Interval { low: values.into_iter().min()?, high: values.into_iter().max()? })
    }

    /// Returns the least and the greatest shift count, of which operations use the low 5 bits.
    fn shift_counts(self) -> Option<(u32, u32)> {
        let counts = if self.low >= 0 && self.high <= 31 { (self.low, self.high) } else { (0, 31) };
        Some((counts.0 as u32, counts.1 as u32))
    }
}

/// Returns the greatest number with no bits above those of a non-negative `value`.
fn all_bits(value: i64) -> i64 {
    let used = i64::BITS - value.leading_zeros();
    (1 << used) - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate;

    /// Boundary values of both types.
    const VALUES: [i64; 13] = [
        i32::MIN as i64,
        i32::MIN as i64 + 1,
        -33,
        -2,
        -1,
        0,
        1,
        2,
        7,
        31,
        32,
        i32::MAX as i64,
        u32::MAX as i64,
    ];

    fn intervals(scalar: Scalar) -> Vec<(Interval, Vec<i64>)> {
        let all = Interval::all(scalar).unwrap();
        let values = VALUES.into_iter().filter(|value| all.contains(Interval::point(*value)));
        let values: Vec<i64> = values.collect();
        let mut intervals = Vec::new();
        for first in 0..values.len() {
            for last in first..values.len() {
                let interval = Interval { low: values[first], high: values[last] };
                intervals.push((interval, values[first..=last].to_vec()));
            }
        }
        intervals
    }

    fn point_of(scalar: Scalar, bits: u32) -> Interval {
        Interval::of(Constant::from_bits(scalar, bits)).unwrap()
    }

    #[test]
    fn every_result_lies_in_its_interval() {
        for scalar in [Scalar::I32, Scalar::U32, Scalar::Bool] {
            let intervals = intervals(scalar);
            for (a, of_a) in &intervals {
                for op in UnaryOp::ALL {
                    let Some(function) = evaluate::unary(*op, scalar) else { continue };
                    let result = Interval::unary(*op, scalar, *a).unwrap();
                    for value in of_a {
                        let found = point_of(scalar, function(*value as u32));
                        assert!(result.contains(found), "{op:?} {a:?}: {value}");
                    }
                }
                for to in [Scalar::I32, Scalar::U32, Scalar::Bool] {
                    let result = Interval::convert(scalar, to, Some(*a)).unwrap();
                    for value in of_a {
                        let found = point_of(to, evaluate::convert(scalar, to)(*value as u32));
                        assert!(result.contains(found), "{scalar:?} {to:?} {a:?}: {value}");
                    }
                }
                for (b, of_b) in &intervals {
                    check_pairs(scalar, (*a, of_a), (*b, of_b));
                }
            }
        }
    }

    fn check_pairs(scalar: Scalar, (a, of_a): (Interval, &[i64]), (b, of_b): (Interval, &[i64])) {
        let pairs = || of_a.iter().flat_map(|x| of_b.iter().map(move |y| (*x, *y)));
        for op in BinaryOp::ALL {
            let Some(function) = evaluate::binary(*op, scalar) else { continue };
            let result = Interval::binary(*op, scalar, a, b).unwrap();
            for (x, y) in pairs() {
                let found = point_of(scalar, function(x as u32, y as u32));
                assert!(result.contains(found), "{op:?} {scalar:?} {a:?} {b:?}: {x} {y}");
            }
        }
        for op in CompareOp::ALL {
            let Some(function) = evaluate::compare(*op, scalar) else { continue };
            let result = Interval::compare(*op, a, b);
            let left = Interval::where_holds(*op, a, b);
            for (x, y) in pairs() {
                let holds = function(x as u32, y as u32);
                assert!(result.contains(Interval::point(holds.into())), "{op:?} {a:?} {b:?}");
                let kept = left.is_some_and(|(a, b)| {
                    a.contains(Interval::point(x)) && b.contains(Interval::point(y))
                });
                assert!(holds == 0 || kept, "{op:?} {a:?} {b:?}: {x} {y}");
            }
        }
    }

    #[test]
    fn intervals_are_narrow() {
        let up_to = |high| Interval { low: 0, high };
        let of = |op, a, b| Interval::binary(op, Scalar::U32, a, b).unwrap();
        let all = Interval::all(Scalar::U32).unwrap();
        assert_eq!(of(BinaryOp::And, all, Interval::point(255)), up_to(255));
        assert_eq!(of(BinaryOp::Remainder, all, Interval::point(10)), up_to(9));
        assert_eq!(of(BinaryOp::ShiftRight, all, Interval::point(24)), up_to(255));
        assert_eq!(of(BinaryOp::Or, up_to(5), up_to(8)), up_to(15));
        assert_eq!(of(BinaryOp::Add, up_to(255), up_to(255)), up_to(510));
        assert_eq!(of(BinaryOp::Add, all, Interval::point(1)), all);
    }
}
