//! Tests of the class of floats on targets with mask registers.
//!
//! A comparison into a mask register takes longer than several other operations: on a Zen 5 a cycle, in which four sums
//! of integers are computed. The test for positive normal numbers, with which logarithms and powers begin, is therefore
//! one comparison of the bits instead of two of the number.

use std::collections::BTreeMap;

use rtsl_ir::{BinaryOp, CompareOp, Scalar, Value};

use crate::emitter::Emitter;
use crate::operand::Operand;

/// The bits of the smallest positive normal number and of infinity.
const SMALLEST_NORMAL: u32 = 0x0080_0000;
const INFINITY: u32 = 0x7f80_0000;

/// A bound of a positive normal number, with which a value is compared.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Bound {
    Lower,
    Upper,
}

/// The masks of comparisons with the bounds of positive normal numbers, with the number that is compared.
#[derive(Default)]
pub struct BoundTests(BTreeMap<Value, (Bound, Value)>);

impl Emitter<'_, '_> {
    /// Records a comparison if it is one with a bound.
    pub fn record_bound_test(&mut self, result: Value, op: CompareOp, a: Value, b: Value) {
        if !self.is_lanes(a) || self.scalar(a) != Scalar::F32 || self.is_lanes(b) {
            return;
        }
        let bound = match (op, self.uniform(b)) {
            (CompareOp::GreaterEqual, Operand::Float(SMALLEST_NORMAL)) => Bound::Lower,
            (CompareOp::Less, Operand::Float(INFINITY)) => Bound::Upper,
            _ => return,
        };
        self.bound_tests.0.insert(result, (bound, a));
    }

    /// Emits the conjunction of two masks as one comparison if it is true just for positive normal numbers. Returns
    /// false if it is another one.
    pub fn emit_class_test(&mut self, result: Value, op: BinaryOp, a: Value, b: Value) -> bool {
        let test = |mask| self.bound_tests.0.get(&mask).copied();
        let number = match (op, test(a), test(b)) {
            (BinaryOp::And, Some((first, a)), Some((second, b))) if first != second && a == b => a,
            _ => return false,
        };
        if !self.module.target.mask_registers || self.width == 1 {
            return false;
        }
        let (floats, words) = (self.lanes("float"), self.lanes("i32"));
        let number = self.operand(number, true);
        let bits = self.instruction(format_args!("bitcast {floats} {number} to {words}"));
        let first = self.literal(words, Operand::Int(SMALLEST_NORMAL as i32));
        let above = self.binary("sub", words, bits, first);
        let count = self.literal(words, Operand::Int((INFINITY - SMALLEST_NORMAL) as i32));
        let is_positive_normal = self.compare("ult", words, above, count);
        self.define(result, is_positive_normal);
        true
    }
}
