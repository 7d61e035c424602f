//! Simplification of selects and tests that depend on bits of an integer.
//!
//! - `(h & 4u) != 0u ? -x : x` flips the sign of `x` by a bit of `h`: a mask, a comparison, a negation and a select
//!   become a shift and an exclusive or, with a mask between them if the bit is not the lowest. The exclusive or must
//!   not expose the bits of a NaN, and does not.
//! - `h == 12u || h == 14u`, with two numbers that differ in one bit, becomes one comparison without that bit.
//!
//! Lattice noise does either for each corner of a cell.

use std::collections::HashMap;

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, ConstantPool, Function, Op, OpKind, Region, Scalar, UnaryOp,
    Value,
};

/// Simplifies such selects and tests in `function`.
pub fn run(function: &mut Function) {
    let mut pool = ConstantPool::of(function);
    let mut body = std::mem::take(&mut function.body);
    let definitions = HashMap::new();
    Choices { function, pool: &mut pool, definitions }.region(&mut body);
    function.body = body;
    pool.define_in(function);
}

struct Choices<'a> {
    function: &'a mut Function,
    pool: &'a mut ConstantPool,
    /// The definitions of the values of operations with at most one result, as far as the rules use them.
    definitions: HashMap<Value, Definition>,
}

#[derive(Clone, Copy)]
enum Definition {
    Constant(Constant),
    Negate(Value),
    And(Value, Value),
    Compare(CompareOp, Value, Value),
    IsNotZero(Value),
}

/// A bit of an integer.
#[derive(Clone, Copy)]
struct Bit {
    /// The integer.
    word: Value,
    /// The position of the bit, from the lowest.
    position: u32,
}

impl Choices<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            for region in op.kind.regions_mut() {
                self.region(region);
            }
            self.remember(&op);
            let simpler = match op.kind {
                OpKind::Select(condition, a, b) => self.flipped(condition, a, b, &mut ops),
                OpKind::Binary(BinaryOp::Or, a, b) => self.either(a, b, &mut ops),
                _ => None,
            };
            op.kind = simpler.unwrap_or(op.kind);
            ops.push(op);
        }
        region.ops = ops;
    }

    fn remember(&mut self, op: &Op) {
        let definition = match op.kind {
            OpKind::Constant(constant) => Definition::Constant(constant),
            OpKind::Unary(UnaryOp::Negate, a) => Definition::Negate(a),
            OpKind::Binary(BinaryOp::And, a, b) => Definition::And(a, b),
            OpKind::Compare(op, a, b) => Definition::Compare(op, a, b),
            OpKind::Convert(Scalar::Bool, a) => Definition::IsNotZero(a),
            _ => return,
        };
        self.definitions.insert(op.results.get(0), definition);
    }

    fn flipped(
        &mut self,
        condition: Value,
        a: Value,
        b: Value,
        before: &mut Vec<Op>,
    ) -> Option<OpKind> {
        let opposite = self.is_negative(a, b) || self.is_negative(b, a);
        if self.function.scalar(a) != Scalar::F32 || !opposite {
            return None;
        }
        let (bit, is_set) = self.tested_bit(condition)?;
        // The result of the select if the bit is not set.
        let plain = if is_set { b } else { a };
        let sign = self.sign(bit, before);
        let bits = self.push(OpKind::Bitcast(Scalar::U32, plain), before);
        let flipped = self.push(OpKind::Binary(BinaryOp::Xor, bits, sign), before);
        Some(OpKind::Bitcast(Scalar::F32, flipped))
    }

    /// Returns one comparison for two that test whether an integer is one of two constants.
    fn either(&mut self, a: Value, b: Value, before: &mut Vec<Op>) -> Option<OpKind> {
        let ((word, first), (other, second)) = (self.equality(a)?, self.equality(b)?);
        let difference = first ^ second;
        if word != other || !difference.is_power_of_two() {
            return None;
        }
        let scalar = self.function.scalar(word);
        let [mask, common] = [!difference, first & !difference].map(|bits| {
            let constant = Constant::from_bits(scalar, bits);
            self.pool.intern(&mut self.function.values, constant)
        });
        let masked = self.push(OpKind::Binary(BinaryOp::And, word, mask), before);
        Some(OpKind::Compare(CompareOp::Equal, masked, common))
    }

    /// If a bool is an equality with a constant, returns the integer and the bits of the constant.
    fn equality(&self, value: Value) -> Option<(Value, u32)> {
        match *self.definitions.get(&value)? {
            Definition::Compare(CompareOp::Equal, a, b) => {
                let left = self.constant(a).map(|bits| (b, bits));
                self.constant(b).map(|bits| (a, bits)).or(left)
            }
            _ => None,
        }
    }

    fn is_negative(&self, value: Value, of: Value) -> bool {
        matches!(self.definitions.get(&value), Some(Definition::Negate(a)) if *a == of)
    }

    /// Returns the bit on which a bool depends, and true if the bool is true for a set bit.
    fn tested_bit(&self, condition: Value) -> Option<(Bit, bool)> {
        match *self.definitions.get(&condition)? {
            Definition::IsNotZero(masked) => Some((self.bit(masked)?, true)),
            Definition::Compare(op, masked, other) => {
                let bit = self.bit(masked)?;
                let other = self.constant(other)?;
                let is_set = match op {
                    CompareOp::Equal => true,
                    CompareOp::NotEqual => false,
                    _ => return None,
                };
                match other {
                    0 => Some((bit, !is_set)),
                    _ if other == 1 << bit.position => Some((bit, is_set)),
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// Returns the bit that the mask of `masked` selects.
    fn bit(&self, masked: Value) -> Option<Bit> {
        let Definition::And(a, b) = *self.definitions.get(&masked)? else { return None };
        let (word, mask) = match (self.constant(a), self.constant(b)) {
            (None, Some(mask)) => (a, mask),
            (Some(mask), None) => (b, mask),
            _ => return None,
        };
        mask.is_power_of_two().then(|| Bit { word, position: mask.trailing_zeros() })
    }

    /// Returns the bits of an integer constant.
    fn constant(&self, value: Value) -> Option<u32> {
        match self.definitions.get(&value)? {
            Definition::Constant(constant @ (Constant::I32(_) | Constant::U32(_))) => {
                Some(constant.bits())
            }
            _ => None,
        }
    }

    /// Computes the bit shifted to the sign position of an f32, as u32.
    fn sign(&mut self, bit: Bit, before: &mut Vec<Op>) -> Value {
        let word = match self.function.scalar(bit.word) {
            Scalar::I32 => self.push(OpKind::Convert(Scalar::U32, bit.word), before),
            Scalar::U32 | Scalar::F32 | Scalar::Bool => bit.word,
        };
        let distance = self.literal(31 - bit.position);
        let shifted = self.push(OpKind::Binary(BinaryOp::ShiftLeft, word, distance), before);
        if bit.position == 0 {
            return shifted;
        }
        let sign = self.literal(1 << 31);
        self.push(OpKind::Binary(BinaryOp::And, shifted, sign), before)
    }

    fn literal(&mut self, bits: u32) -> Value {
        self.pool.intern(&mut self.function.values, Constant::U32(bits))
    }

    fn push(&mut self, kind: OpKind, before: &mut Vec<Op>) -> Value {
        let scalar = match kind {
            OpKind::Bitcast(to, _) | OpKind::Convert(to, _) => to,
            OpKind::Binary(_, a, _) => self.function.scalar(a),
            _ => Scalar::U32,
        };
        self.function.push(before, scalar, kind)
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, transformed};

    fn check(text: &str, expected: expect_test::Expect) {
        let found = transformed(text, |function| {
            super::run(function);
            crate::dce::run(function);
        });
        expected.assert_eq(&found);
    }

    #[test]
    fn bits_become_signs() {
        let text = "
            %x: f32 = load scratch:f@0 %u: u32 = load scratch:u@0 %i: i32 = load scratch:i@0
            %0: u32 = constant 0 %1: u32 = constant 1 %i4: i32 = constant 4
            %n: f32 = negate %x
            %a: u32 = and %u, %1 %c: bool = not_equal %a, %0 %r: f32 = select %c, %n, %x
            %b: i32 = and %i, %i4 %d: bool = equal %b, %i4 %s: f32 = select %d, %x, %n
            %e: bool = convert %a %t: f32 = select %e, %x, %n
            return scratch:f@0 = %r, scratch:f@1 = %s, scratch:f@2 = %t";
        check(
            text,
            expect![[r#"
            %0: u32 = constant 31
            %1: u32 = constant 29
            %2: u32 = constant 2147483648
            %6: f32 = negate %3
            %7: u32 = shift_left %4, %0
            %8: u32 = bitcast %3
            %9: u32 = xor %8, %7
            %10: f32 = bitcast %9
            %11: u32 = convert %5
            %12: u32 = shift_left %11, %1
            %13: u32 = and %12, %2
            %14: u32 = bitcast %6
            %15: u32 = xor %14, %13
            %16: f32 = bitcast %15
            %17: u32 = shift_left %4, %0
            %18: u32 = bitcast %6
            %19: u32 = xor %18, %17
            %20: f32 = bitcast %19
            return scratch:f@0 = %10, scratch:f@1 = %16, scratch:f@2 = %20
        "#]],
        );
    }

    #[test]
    fn two_numbers_a_bit_apart_are_one_comparison() {
        let text = "
            %u: u32 = load scratch:u@0 %i: i32 = load scratch:i@0
            %12: u32 = constant 12 %14: u32 = constant 14 %1: i32 = constant 1 %m: i32 = constant -1
            %2: i32 = constant 2
            %a: bool = equal %u, %12 %b: bool = equal %14, %u %c: bool = or %a, %b
            %d: bool = equal %i, %1 %e: bool = equal %i, %m %f: bool = or %d, %e
            %g: bool = equal %i, %2 %h: bool = or %d, %g
            return scratch:b@0 = %c, scratch:b@1 = %f, scratch:b@2 = %h";
        check(
            text,
            expect![[r#"
            %0: u32 = constant 4294967293
            %1: u32 = constant 12
            %4: i32 = constant 1
            %5: i32 = constant -1
            %6: i32 = constant 2
            %7: u32 = and %2, %0
            %8: bool = equal %7, %1
            %9: bool = equal %3, %4
            %10: bool = equal %3, %5
            %11: bool = or %9, %10
            %12: bool = equal %3, %6
            %13: bool = or %9, %12
            return scratch:b@0 = %8, scratch:b@1 = %11, scratch:b@2 = %13
        "#]],
        );
    }

    #[test]
    fn other_choices_stay() {
        let text = "
            %x: f32 = load scratch:f@0 %y: f32 = load scratch:f@1 %u: u32 = load scratch:u@0
            %0: u32 = constant 0 %3: u32 = constant 3
            %n: f32 = negate %x %a: u32 = and %u, %3
            %c: bool = not_equal %a, %0 %r: f32 = select %c, %n, %x
            %d: bool = less %u, %3 %s: f32 = select %d, %n, %x
            return scratch:f@0 = %r, scratch:f@1 = %s";
        let unchanged = transformed(text, |_| ());
        assert_eq!(transformed(text, super::run), unchanged);
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
