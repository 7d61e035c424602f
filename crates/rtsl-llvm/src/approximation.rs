//! Approximate reciprocals and square roots: the machine's estimate, of 12 or 14 bits, and one Newton step, which
//! doubles the precision.
//!
//! Operations are approximated only where that is faster. On a Zen 3 (8 lanes, cycles of throughput) 1/sqrt takes 2.7
//! instead of 8.3; but 1/x takes 1.9 instead of 3.3 and sqrt 2.8 instead of 5.0, all of them in the units that do
//! everything else, while the divider works in parallel to those: a torus found by sphere tracing, four vectors at a
//! time, takes 29 ns with exact roots and 36 ns with approximate ones. So up to 8 lanes only 1/sqrt is approximated.
//! With 16 lanes the divider takes two to three times as long, and all are. One lane and other machines use the exact
//! operations.
//!
//! A Zen 5 divides 16 lanes in 2.6 cycles and takes their roots in 4.6, no longer than 8 lanes. There only 1/sqrt is
//! approximated, and only in kernels that do little else: a thin lens takes 7 percent longer with the estimate, GGX as
//! long, the function by itself 0.7 times as long.
//!
//! Where the reciprocal is exact and a factor of one product only, the product becomes a division: one operation less.
//!
//! The Newton step alone would produce NaN for 0 and infinity, where estimates are exact; a `max` or `min`, which on
//! x86 returns its second operand if either is a NaN, keeps the estimate there.

use std::collections::BTreeMap;

use rtsl_ir::{BinaryOp, UnaryOp, Value};
use rtsl_packet::kernel::Region;

use crate::emitter::Emitter;
use crate::operand::{LlvmType, Operand};

/// An upper bound of the estimates of `1 / sqrt(a)` for a normal number `a`, which are at most 2^63.
const MAX_INVERSE_SQRT: f32 = 1.8446744e19;

/// The number of other operations that take as long as a division or a root by a fast divider.
const OPERATIONS_OF_DIVISION: u32 = 12;

/// The exact reciprocals of lanes that are used once, with their divisors.
#[derive(Default)]
pub struct ExactReciprocals(BTreeMap<Value, Value>);

#[derive(Clone, Copy)]
enum Estimate {
    Reciprocal,
    InverseSqrt,
}

impl Emitter<'_, '_> {
    /// Records a reciprocal if it is exact and used once.
    pub fn record_reciprocal(&mut self, result: Value, op: UnaryOp, divisor: Value) {
        let ty = self.register_type(result);
        let is_exact = op == UnaryOp::ApproximateReciprocal && !self.approximates_many(ty);
        if is_exact
            && ty.is_vector()
            && self.is_lanes(result)
            && uses(&self.kernel.body, result) == 1
        {
            self.exact_reciprocals.0.insert(result, divisor);
        }
    }

    /// Returns dividend and divisor of a product with a recorded reciprocal.
    pub fn quotient(&self, op: BinaryOp, a: Value, b: Value) -> Option<(Value, Value)> {
        let divisor = |factor| self.exact_reciprocals.0.get(&factor).copied();
        match (op, divisor(a), divisor(b)) {
            (BinaryOp::Multiply, _, Some(divisor)) => Some((a, divisor)),
            (BinaryOp::Multiply, Some(divisor), None) => Some((b, divisor)),
            _ => None,
        }
    }

    /// Returns infinity for 0 and subnormal numbers, 0 for infinity and numbers above 2^126; otherwise the error is at
    /// most two bits.
    pub fn approximate_reciprocal(&mut self, ty: LlvmType, a: Operand) -> Operand {
        let Some(estimate) = self.estimate_of_many(Estimate::Reciprocal, ty, a) else {
            let one = self.float(ty, 1.0);
            return self.binary("fdiv", ty, one, a);
        };
        // r (2 - a r), and 2 - a r is about 1.
        let two = self.float(ty, 2.0);
        let correction = self.minus_product(ty, two, a, estimate);
        let correction = self.at_least(ty, correction, 0.5);
        self.binary("fmul", ty, estimate, correction)
    }

    /// Returns infinity for 0 and subnormal numbers, 0 for infinity, NaN for negative numbers; otherwise the error is
    /// at most three bits.
    pub fn approximate_inverse_sqrt(&mut self, ty: LlvmType, a: Operand) -> Operand {
        let estimate = match self.module.target.has_fast_divider() && !self.waits_for_divider() {
            true => None,
            false => self.estimate(Estimate::InverseSqrt, ty, a),
        };
        let Some(estimate) = estimate else {
            let root = self.float_intrinsic("sqrt", ty, a);
            let one = self.float(ty, 1.0);
            return self.binary("fdiv", ty, one, root);
        };
        // r/2 (3 - a r r), and 3 - a r r is about 2. (At least 1 would do too, but of a choice between a
        // factor and 1 LLVM makes a product under a mask.)
        let product = self.binary("fmul", ty, a, estimate);
        let three = self.float(ty, 3.0);
        let correction = self.minus_product(ty, three, product, estimate);
        let correction = self.at_least(ty, correction, 0.5);
        let half = self.float(ty, 0.5);
        let half = self.binary("fmul", ty, estimate, half);
        self.binary("fmul", ty, half, correction)
    }

    /// Returns 0 for 0, NaN for negative numbers and for infinity; otherwise the error is at most two bits.
    pub fn approximate_sqrt(&mut self, ty: LlvmType, a: Operand) -> Operand {
        let Some(estimate) = self.estimate_of_many(Estimate::InverseSqrt, ty, a) else {
            return self.float_intrinsic("sqrt", ty, a);
        };
        // Infinite for 0, and -infinity for -0: clamped to a finite number, so that the product is 0.
        let magnitude = self.float_intrinsic("fabs", ty, estimate);
        let greatest = self.float(ty, MAX_INVERSE_SQRT);
        let above = self.compare("olt", ty, greatest, magnitude);
        let estimate = self.select(ty, above, greatest, magnitude);
        // With s = a r: s + s (1 - s r) / 2.
        let root = self.binary("fmul", ty, a, estimate);
        let half = self.float(ty, 0.5);
        let half_estimate = self.binary("fmul", ty, estimate, half);
        let error = self.minus_product(ty, half, root, half_estimate);
        self.product_plus(ty, root, error, root)
    }

    /// Emits the machine's estimate, if it has one and its divider is slow for that many lanes.
    fn estimate_of_many(
        &mut self,
        estimate: Estimate,
        ty: LlvmType,
        a: Operand,
    ) -> Option<Operand> {
        if self.approximates_many(ty) { self.estimate(estimate, ty, a) } else { None }
    }

    /// True if the divider is slow for that many lanes.
    fn approximates_many(&self, ty: LlvmType) -> bool {
        let target = self.module.target;
        ty.count.min(target.estimates.lanes()) > target.divider_lanes
    }

    /// True if a fast divider takes longer for the kernel's divisions and roots than all other units for the rest.
    fn waits_for_divider(&self) -> bool {
        let rtsl_packet::Estimate { operations, divisions, .. } =
            rtsl_packet::Estimate::new(self.kernel);
        operations < OPERATIONS_OF_DIVISION * divisions
    }

    /// Emits the machine's estimate, if it has one.
    fn estimate(&mut self, estimate: Estimate, ty: LlvmType, a: Operand) -> Option<Operand> {
        let widest = self.module.target.estimates.lanes();
        if !ty.is_vector() || widest == 0 {
            return None;
        }
        if ty.count <= widest {
            return Some(self.whole_estimate(estimate, ty, a));
        }
        let half = LlvmType { element: ty.element, count: ty.count / 2 };
        let [low, high] = [0, half.count].map(|first| {
            let lanes = lane_list(first, half.count);
            let part =
                self.instruction(format_args!("shufflevector {ty} {a}, {ty} poison, {lanes}"));
            self.estimate(estimate, half, part)
        });
        let lanes = lane_list(0, ty.count);
        let (low, high) = (low?, high?);
        Some(self.instruction(format_args!("shufflevector {half} {low}, {half} {high}, {lanes}")))
    }

    fn whole_estimate(&mut self, estimate: Estimate, ty: LlvmType, a: Operand) -> Operand {
        let short = match estimate {
            Estimate::Reciprocal => "rcp",
            Estimate::InverseSqrt => "rsqrt",
        };
        match ty.count {
            4 => self.intrinsic(&format!("llvm.x86.sse.{short}.ps"), ty, &[(ty, a)]),
            8 => self.intrinsic(&format!("llvm.x86.avx.{short}.ps.256"), ty, &[(ty, a)]),
            _ => {
                let mask = LlvmType { element: "i16", count: 1 };
                let name = format!("llvm.x86.avx512.{short}14.ps.512");
                let arguments = [(ty, a), (ty, Operand::Zero), (mask, Operand::Int(-1))];
                self.intrinsic(&name, ty, &arguments)
            }
        }
    }

    /// Emits `c - a * b`.
    fn minus_product(&mut self, ty: LlvmType, c: Operand, a: Operand, b: Operand) -> Operand {
        let negative = self.instruction(format_args!("fneg {ty} {a}"));
        self.product_plus(ty, negative, b, c)
    }

    /// Emits `a * b + c`, rounded once if that is one instruction.
    fn product_plus(&mut self, ty: LlvmType, a: Operand, b: Operand, c: Operand) -> Operand {
        if self.module.target.fma {
            let name = format!("llvm.fma.{}", ty.suffix());
            return self.intrinsic(&name, ty, &[(ty, a), (ty, b), (ty, c)]);
        }
        let product = self.binary("fmul", ty, a, b);
        self.binary("fadd", ty, product, c)
    }

    /// Emits the maximum, which is `least` for a NaN.
    fn at_least(&mut self, ty: LlvmType, a: Operand, least: f32) -> Operand {
        let least = self.float(ty, least);
        let greater = self.compare("ogt", ty, a, least);
        self.select(ty, greater, a, least)
    }

    fn float(&mut self, ty: LlvmType, value: f32) -> Operand {
        self.literal(ty, Operand::Float(value.to_bits()))
    }
}

/// Returns the number of uses of a value in a region.
fn uses(region: &Region, value: Value) -> usize {
    let mut count = region.yields.iter().filter(|it| **it == value).count();
    for op in &region.ops {
        op.kind.for_each_operand(|operand| count += usize::from(operand == value));
        count += op.kind.regions().map(|region| uses(region, value)).sum::<usize>();
    }
    count
}

/// Returns the indices of consecutive lanes, as a literal.
fn lane_list(first: u32, count: u32) -> String {
    let lanes: Vec<String> = (first..first + count).map(|lane| format!("i32 {lane}")).collect();
    format!("<{count} x i32> <{}>", lanes.join(", "))
}
