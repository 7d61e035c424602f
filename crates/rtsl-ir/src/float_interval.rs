//! Interval arithmetic on floats: bounds on an f32 from bounds on the operands.
//!
//! Bounds are ordered by IEEE 754's `totalOrder`, with -0 before 0, so that they also determine signs. A separate flag
//! records that the value may be a NaN. Rounding is monotone, so the bounds of a result are those that
//! [`evaluate`](crate::evaluate) computes for bounds of operands, without a margin.

use std::cmp::Ordering;

use crate::{BinaryOp, CompareOp, Interval, Scalar, UnaryOp, evaluate};

/// All numbers from `low` to `high`, with or without NaN.
#[derive(Clone, Copy, Debug)]
pub struct FloatInterval {
    /// The least number; not NaN.
    pub low: f32,
    /// The greatest number; not NaN, and not before `low`.
    pub high: f32,
    /// True if the value may be a NaN.
    pub nan: bool,
}

impl FloatInterval {
    /// All floats.
    pub const ALL: FloatInterval =
        FloatInterval { low: f32::NEG_INFINITY, high: f32::INFINITY, nan: true };

    /// Returns the interval between two numbers.
    pub const fn between(low: f32, high: f32) -> FloatInterval {
        FloatInterval { low, high, nan: false }
    }

    /// Returns the interval of one value.
    pub const fn of(value: f32) -> FloatInterval {
        if value.is_nan() { FloatInterval::ALL } else { FloatInterval::between(value, value) }
    }

    /// Returns the value if the interval holds only one.
    pub fn constant(self) -> Option<f32> {
        (!self.nan && self.low.to_bits() == self.high.to_bits()).then_some(self.low)
    }

    /// True if the interval holds this value.
    pub fn contains(self, value: f32) -> bool {
        if value.is_nan() {
            self.nan
        } else {
            self.low.total_cmp(&value) != Ordering::Greater
                && self.high.total_cmp(&value) != Ordering::Less
        }
    }

    /// Returns the least interval that contains both.
    pub fn hull(self, other: FloatInterval) -> FloatInterval {
        FloatInterval {
            low: least(self.low, other.low),
            high: greatest(self.high, other.high),
            nan: self.nan || other.nan,
        }
    }

    /// True if the interval holds no negative number and no -0.
    pub fn is_positive(self) -> bool {
        self.low.is_sign_positive()
    }

    fn has_zero(self) -> bool {
        self.low <= 0.0 && self.high >= 0.0
    }

    fn has_infinity(self) -> bool {
        self.low == f32::NEG_INFINITY || self.high == f32::INFINITY
    }

    /// Returns the hull of these results of a monotone operation; all floats if one is a NaN.
    fn around(results: impl IntoIterator<Item = f32>, nan: bool) -> FloatInterval {
        let mut results = results.into_iter();
        let Some(first) = results.next() else { return FloatInterval::ALL };
        let all = results.fold(FloatInterval::of(first), |all, result| {
            if result.is_nan() { FloatInterval::ALL } else { all.hull(FloatInterval::of(result)) }
        });
        FloatInterval { nan: nan || all.nan, ..all }
    }

    /// Returns the bounds of `op`.
    pub fn unary(op: UnaryOp, a: FloatInterval) -> FloatInterval {
        let Some(function) = evaluate::unary(op, Scalar::F32) else { return FloatInterval::ALL };
        let at = |value: f32| f32::from_bits(function(value.to_bits()));
        match op {
            UnaryOp::Negate
            | UnaryOp::Floor
            | UnaryOp::Ceil
            | UnaryOp::Trunc
            | UnaryOp::RoundEven => FloatInterval::around([at(a.low), at(a.high)], a.nan),
            UnaryOp::Abs => {
                let middle =
                    if a.is_positive() || a.high.is_sign_negative() { None } else { Some(0.0) };
                FloatInterval::around([at(a.low), at(a.high)].into_iter().chain(middle), a.nan)
            }
            UnaryOp::Sqrt if a.high >= 0.0 => {
                // The square root of a negative number is NaN.
                let low = if a.low < 0.0 { -0.0 } else { a.low };
                FloatInterval::around([at(low), at(a.high)], a.nan || a.low < 0.0)
            }
            UnaryOp::Sqrt
            | UnaryOp::Not
            | UnaryOp::Seldom
            | UnaryOp::ApproximateReciprocal
            | UnaryOp::ApproximateInverseSqrt
            | UnaryOp::ApproximateSqrt => FloatInterval::ALL,
        }
    }

    /// Returns the bounds of `op` on two independent values.
    pub fn binary(op: BinaryOp, a: FloatInterval, b: FloatInterval) -> FloatInterval {
        match op {
            BinaryOp::Add => {
                let opposite = |a: FloatInterval, b: FloatInterval| {
                    a.low == f32::NEG_INFINITY && b.high == f32::INFINITY
                };
                let nan = a.nan || b.nan || opposite(a, b) || opposite(b, a);
                FloatInterval::around([a.low + b.low, a.high + b.high], nan)
            }
            BinaryOp::Subtract => {
                let negated = FloatInterval::unary(UnaryOp::Negate, b);
                FloatInterval::binary(BinaryOp::Add, a, negated)
            }
            BinaryOp::Multiply => {
                let nan = a.has_zero() && b.has_infinity() || a.has_infinity() && b.has_zero();
                let ends = corners(a, b).into_iter().flat_map(|(a, b)| product(a, b));
                FloatInterval::around(ends, a.nan || b.nan || nan)
            }
            BinaryOp::Divide => FloatInterval::quotient(a, b),
            BinaryOp::Min => FloatInterval {
                low: least(a.low, b.low),
                high: if !b.nan && b.high < a.high { positive_zero(b.high) } else { a.high },
                nan: a.nan,
            },
            BinaryOp::Max => FloatInterval {
                low: if !b.nan && b.low > a.low { negative_zero(b.low) } else { a.low },
                high: greatest(a.high, b.high),
                nan: a.nan,
            },
            BinaryOp::Remainder
            | BinaryOp::And
            | BinaryOp::Or
            | BinaryOp::Xor
            | BinaryOp::ShiftLeft
            | BinaryOp::ShiftRight
            | BinaryOp::MultiplyHigh => FloatInterval::ALL,
        }
    }

    /// Returns the bounds of the square of one value.
    pub fn square(a: FloatInterval) -> FloatInterval {
        let size = FloatInterval::unary(UnaryOp::Abs, a);
        FloatInterval::around([size.low * size.low, size.high * size.high], a.nan)
    }

    fn quotient(a: FloatInterval, b: FloatInterval) -> FloatInterval {
        let nan = a.nan || b.nan || a.has_zero() && b.has_zero();
        let nan = nan || a.has_infinity() && b.has_infinity();
        let ends = corners(a, b).map(|(a, b)| a / b);
        if !b.has_zero() && !ends.into_iter().any(f32::is_nan) {
            return FloatInterval::around(ends, nan);
        }
        // Only the sign of the quotient is bounded, and only if the divisor has one sign.
        let (low, high) = match (b.is_positive(), b.high.is_sign_negative()) {
            (true, _) => (a.low, a.high),
            (_, true) => (-a.high, -a.low),
            (false, false) => return FloatInterval { nan, ..FloatInterval::ALL },
        };
        FloatInterval {
            low: if low.is_sign_positive() { 0.0 } else { f32::NEG_INFINITY },
            high: if high.is_sign_negative() { -0.0 } else { f32::INFINITY },
            nan,
        }
    }

    /// Returns the bounds of `a * b + c`, rounded once.
    pub fn fma(a: FloatInterval, b: FloatInterval, c: FloatInterval) -> FloatInterval {
        let product = FloatInterval::binary(BinaryOp::Multiply, a, b);
        let nan = product.nan || c.nan || product.has_infinity() && c.has_infinity();
        let ends = corners(a, b).into_iter();
        let ends = ends.flat_map(|(a, b)| [a.mul_add(b, c.low), a.mul_add(b, c.high)]);
        let around = FloatInterval::around(ends, nan);
        // A sum of positive zeros is a positive zero; in other cases the sign of zero is not tracked.
        let positive = product.is_positive() && c.is_positive();
        let low = if positive { greatest(around.low, 0.0) } else { negative_zero(around.low) };
        FloatInterval { low, high: positive_zero(around.high), nan: around.nan }
    }

    /// Returns the bounds of an integer or bool converted to f32.
    pub fn of_integer(a: Interval) -> FloatInterval {
        FloatInterval::between(a.low as f32, a.high as f32)
    }

    /// Returns the bounds of a comparison of two values, as a bool.
    pub fn compare(op: CompareOp, a: FloatInterval, b: FloatInterval) -> Interval {
        let nan = a.nan || b.nan;
        let apart = a.high < b.low || a.low > b.high;
        let same = a.low == a.high && b.low == b.high && a.low == b.low;
        let (always, never) = match op {
            CompareOp::Less => (a.high < b.low, a.low >= b.high),
            CompareOp::LessEqual => (a.high <= b.low, a.low > b.high),
            CompareOp::Greater => (a.low > b.high, a.high <= b.low),
            CompareOp::GreaterEqual => (a.low >= b.high, a.high < b.low),
            CompareOp::Equal => (same, apart),
            CompareOp::NotEqual => {
                return Interval { low: i64::from(apart), high: i64::from(nan || !same) };
            }
        };
        Interval { low: i64::from(always && !nan), high: i64::from(!never) }
    }

    /// Returns the parts of two intervals for which a comparison of the values can be `truth`; any parts of them if it
    /// never is.
    pub fn where_is(
        op: CompareOp,
        truth: bool,
        a: FloatInterval,
        b: FloatInterval,
    ) -> (FloatInterval, FloatInterval) {
        match (op, truth) {
            (CompareOp::Equal, true) | (CompareOp::NotEqual, false) => {
                (a.equal_to(b).unwrap_or(a), b.equal_to(a).unwrap_or(b))
            }
            (CompareOp::Equal, false) | (CompareOp::NotEqual, true) => (a, b),
            (CompareOp::Less, true) => FloatInterval::where_less(a, b, true),
            (CompareOp::LessEqual, true) => FloatInterval::where_less(a, b, false),
            (CompareOp::Greater, false) => FloatInterval::where_not_greater(a, b, false),
            (CompareOp::GreaterEqual, false) => FloatInterval::where_not_greater(a, b, true),
            (CompareOp::Greater | CompareOp::GreaterEqual, true)
            | (CompareOp::Less | CompareOp::LessEqual, false) => {
                let (b, a) = FloatInterval::where_is(op.mirrored(), truth, b, a);
                (a, b)
            }
        }
    }

    /// Restricts both to `a < b`, or `a <= b`.
    fn where_less(a: FloatInterval, b: FloatInterval, strict: bool) -> (Self, Self) {
        let number = |it: FloatInterval| FloatInterval { nan: false, ..it };
        let (left, right) = (a.below(b.high, strict), b.above(a.low, strict));
        (number(left.unwrap_or(a)), number(right.unwrap_or(b)))
    }

    /// Restricts both to `a < b`, or `a <= b`, or one being a NaN, which leaves the other unrestricted.
    fn where_not_greater(a: FloatInterval, b: FloatInterval, strict: bool) -> (Self, Self) {
        let left = if b.nan { None } else { a.below(b.high, strict) };
        let right = if a.nan { None } else { b.above(a.low, strict) };
        (left.unwrap_or(a), right.unwrap_or(b))
    }

    /// Returns the numbers equal to some number of `other`.
    fn equal_to(self, other: FloatInterval) -> Option<FloatInterval> {
        let both = self.below(other.high, false)?.above(other.low, false)?;
        Some(FloatInterval { nan: false, ..both })
    }

    /// Returns the numbers less than a limit, or equal to it unless `strict`.
    fn below(self, limit: f32, strict: bool) -> Option<FloatInterval> {
        let limit = if strict { limit.next_down() } else { positive_zero(limit) };
        let high = least(limit, self.high);
        (self.low.total_cmp(&high) != Ordering::Greater).then_some(FloatInterval { high, ..self })
    }

    /// Returns the numbers greater than a limit, or equal to it unless `strict`.
    fn above(self, limit: f32, strict: bool) -> Option<FloatInterval> {
        let limit = if strict { limit.next_up() } else { negative_zero(limit) };
        let low = greatest(limit, self.low);
        (low.total_cmp(&self.high) != Ordering::Greater).then_some(FloatInterval { low, ..self })
    }
}

/// Returns each bound of one paired with each bound of the other.
fn corners(a: FloatInterval, b: FloatInterval) -> [(f32, f32); 4] {
    [(a.low, b.low), (a.low, b.high), (a.high, b.low), (a.high, b.high)]
}

/// Returns the product of two bounds; for 0 and infinity, the possible products of numbers close to them.
fn product(a: f32, b: f32) -> [f32; 2] {
    let result = a * b;
    if result.is_nan() {
        let sign = 1.0_f32.copysign(a) * 1.0_f32.copysign(b);
        [0.0_f32.copysign(sign), f32::INFINITY.copysign(sign)]
    } else {
        [result, result]
    }
}

fn least(a: f32, b: f32) -> f32 {
    if b.total_cmp(&a) == Ordering::Less { b } else { a }
}

fn greatest(a: f32, b: f32) -> f32 {
    if b.total_cmp(&a) == Ordering::Greater { b } else { a }
}

fn positive_zero(value: f32) -> f32 {
    if value == 0.0 { 0.0 } else { value }
}

fn negative_zero(value: f32) -> f32 {
    if value == 0.0 { -0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Special and boundary numbers, in order.
    const NUMBERS: [f32; 14] = [
        f32::NEG_INFINITY,
        f32::MIN,
        -1.0,
        -0.5,
        -1e-45,
        -0.0,
        0.0,
        1e-45,
        f32::MIN_POSITIVE,
        0.5,
        1.0,
        2.5,
        f32::MAX,
        f32::INFINITY,
    ];

    /// Returns intervals with those of the numbers that they hold.
    fn intervals() -> Vec<(FloatInterval, Vec<f32>)> {
        let mut intervals = Vec::new();
        for first in 0..NUMBERS.len() {
            for last in first..NUMBERS.len() {
                for nan in [false, true] {
                    let numbers = FloatInterval::between(NUMBERS[first], NUMBERS[last]);
                    let mut held = NUMBERS[first..=last].to_vec();
                    held.extend(nan.then_some(f32::NAN));
                    intervals.push((FloatInterval { nan, ..numbers }, held));
                }
            }
        }
        intervals
    }

    #[test]
    fn results_of_one_operand_lie_in_their_interval() {
        for (a, of_a) in intervals() {
            for op in UnaryOp::ALL {
                let Some(function) = evaluate::unary(*op, Scalar::F32) else { continue };
                let result = FloatInterval::unary(*op, a);
                for value in &of_a {
                    let found = f32::from_bits(function(value.to_bits()));
                    assert!(result.contains(found), "{op:?} {a:?}: {value} {found} {result:?}");
                }
            }
            let square = FloatInterval::square(a);
            assert!(of_a.iter().all(|value| square.contains(value * value)), "{a:?} {square:?}");
        }
    }

    #[test]
    fn results_of_two_operands_lie_in_their_interval() {
        let intervals = intervals();
        for (a, of_a) in &intervals {
            for (b, of_b) in &intervals {
                check_pairs((*a, of_a), (*b, of_b));
            }
        }
    }

    fn check_pairs((a, of_a): (FloatInterval, &[f32]), (b, of_b): (FloatInterval, &[f32])) {
        let pairs = || of_a.iter().flat_map(|x| of_b.iter().map(move |y| (*x, *y)));
        for op in BinaryOp::ALL {
            let Some(function) = evaluate::binary(*op, Scalar::F32) else { continue };
            let result = FloatInterval::binary(*op, a, b);
            for (x, y) in pairs() {
                let found = f32::from_bits(function(x.to_bits(), y.to_bits()));
                assert!(result.contains(found), "{op:?} {a:?} {b:?}: {x} {y} {result:?}");
            }
        }
        for op in CompareOp::ALL {
            let function = evaluate::compare(*op, Scalar::F32).unwrap();
            let result = FloatInterval::compare(*op, a, b);
            for (x, y) in pairs() {
                let truth = function(x.to_bits(), y.to_bits()) != 0;
                let point = Interval::point(truth.into());
                assert!(result.contains(point), "{op:?} {a:?} {b:?}: {x} {y}");
                let (left, right) = FloatInterval::where_is(*op, truth, a, b);
                let kept = left.contains(x) && right.contains(y);
                assert!(kept, "{op:?} {truth} {a:?} {b:?}: {x} {y} {left:?} {right:?}");
            }
        }
    }

    #[test]
    fn sums_of_products_lie_in_their_interval() {
        // Every fifth of the 210 intervals, to save time.
        let intervals: Vec<_> = intervals().into_iter().step_by(5).collect();
        for (a, of_a) in &intervals {
            for (b, of_b) in &intervals {
                for (c, of_c) in &intervals {
                    let result = FloatInterval::fma(*a, *b, *c);
                    for (x, y) in of_a.iter().flat_map(|x| of_b.iter().map(move |y| (x, y))) {
                        let is_inside = |z: &f32| result.contains(x.mul_add(*y, *z));
                        assert!(
                            of_c.iter().all(is_inside),
                            "{a:?} {b:?} {c:?}: {x} {y} {result:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn intervals_are_narrow() {
        let positive = FloatInterval::between(0.0, f32::INFINITY);
        let sum = FloatInterval::binary(BinaryOp::Add, positive, FloatInterval::of(1.0));
        assert_eq!((sum.low, sum.high, sum.nan), (1.0, f32::INFINITY, false));
        let square = FloatInterval::square(FloatInterval::ALL);
        assert!(square.is_positive() && square.nan);
        let negative = FloatInterval::unary(UnaryOp::Negate, square);
        let exponent = FloatInterval::binary(BinaryOp::Divide, negative, square);
        assert_eq!(exponent.high.to_bits(), (-0.0_f32).to_bits());
        let clamped = FloatInterval::binary(BinaryOp::Max, FloatInterval::of(0.0), exponent);
        assert_eq!(clamped.constant().map(f32::to_bits), Some(0));
        let zero = FloatInterval::of(0.0);
        let (less, _) = FloatInterval::where_is(CompareOp::Less, true, FloatInterval::ALL, zero);
        assert_eq!((less.high, less.nan), (-1e-45, false));
    }
}
