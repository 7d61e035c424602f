//! Approximation: turns divisions and square roots into products and approximate inverses.
//!
//! Only for programs that allow results to differ from machine to machine. Operations that are `precise` are unchanged,
//! and so are the bits of their operands if those are precise too.
//!
//! ```text
//! a / b            a * reciprocal(b)          so that divisions by one number share its inverse,
//!                                             which is computed once if all rays share it
//! a / constant     a * constant
//! a / sqrt(b)      a * inverse_sqrt(b)
//! a / (b sqrt(c))  a * (reciprocal(b) * inverse_sqrt(c))
//! sqrt(a)          approximate_sqrt(a)
//! ```
//!
//! A quotient then has the error of a rounded inverse and of a product. `a / a` may differ from 1, and the quotient is
//! 0 if the divisor is above 2^126.

use std::collections::HashMap;

use rtsl_ir::{BinaryOp, Constant, Function, Op, OpKind, Region, Scalar, UnaryOp, Value};

/// The greatest depth of nested factors of a divisor that are inverted separately.
const MAX_DEPTH: u32 = 4;

/// Approximates the operations of `function` that permit it.
pub fn run(function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    Approximation { function, definitions: HashMap::new() }.region(&mut body);
    function.body = body;
}

/// The definition of a value, as far as its inverse has a special form.
#[derive(Clone, Copy)]
enum Definition {
    Constant(f32),
    Negate(Value),
    Sqrt(Value),
    Product(Value, Value),
}

struct Approximation<'a> {
    function: &'a mut Function,
    definitions: HashMap<Value, Definition>,
}

impl Approximation<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            for region in op.kind.regions_mut() {
                self.region(region);
            }
            self.remember(&op);
            if !op.precise {
                self.op(&mut op, &mut ops);
            }
            ops.push(op);
        }
        region.ops = ops;
    }

    fn remember(&mut self, op: &Op) {
        let definition = match op.kind {
            OpKind::Constant(Constant::F32(constant)) => Definition::Constant(constant),
            OpKind::Unary(UnaryOp::Negate, a) => Definition::Negate(a),
            OpKind::Unary(UnaryOp::Sqrt, a) if !op.precise => Definition::Sqrt(a),
            OpKind::Binary(BinaryOp::Multiply, a, b) if !op.precise => Definition::Product(a, b),
            _ => return,
        };
        self.definitions.insert(op.results.get(0), definition);
    }

    /// Approximates an operation; operations that it needs are appended to `before`.
    fn op(&mut self, op: &mut Op, before: &mut Vec<Op>) {
        match op.kind {
            OpKind::Unary(UnaryOp::Sqrt, a) => {
                op.kind = OpKind::Unary(UnaryOp::ApproximateSqrt, a);
            }
            OpKind::Binary(BinaryOp::Divide, a, b) if self.function.scalar(a) == Scalar::F32 => {
                // Division by 0, or by a constant whose inverse is not a normal number, remains.
                if let Some(Definition::Constant(divisor)) = self.definitions.get(&b)
                    && !(1.0 / divisor).is_normal()
                {
                    return;
                }
                op.kind = match self.definitions.get(&a) {
                    Some(Definition::Constant(1.0)) => self.inverse(b, MAX_DEPTH, before),
                    _ => {
                        let kind = self.inverse(b, MAX_DEPTH, before);
                        OpKind::Binary(BinaryOp::Multiply, a, self.push(kind, before))
                    }
                };
            }
            _ => {}
        }
    }

    /// Returns the operation that computes `1 / value`, from inverses of its factors down to this depth.
    fn inverse(&mut self, value: Value, depth: u32, before: &mut Vec<Op>) -> OpKind {
        match self.definitions.get(&value).copied() {
            Some(Definition::Constant(constant)) => OpKind::Constant(Constant::F32(1.0 / constant)),
            Some(Definition::Negate(a)) if depth > 0 => {
                let kind = self.inverse(a, depth - 1, before);
                OpKind::Unary(UnaryOp::Negate, self.push(kind, before))
            }
            Some(Definition::Sqrt(a)) => OpKind::Unary(UnaryOp::ApproximateInverseSqrt, a),
            Some(Definition::Product(a, b))
                if depth > 0 && (self.is_root(a) || self.is_root(b)) =>
            {
                let factors = [a, b].map(|factor| {
                    let kind = self.inverse(factor, depth - 1, before);
                    self.push(kind, before)
                });
                OpKind::Binary(BinaryOp::Multiply, factors[0], factors[1])
            }
            Some(Definition::Negate(_) | Definition::Product(..)) | None => {
                OpKind::Unary(UnaryOp::ApproximateReciprocal, value)
            }
        }
    }

    fn is_root(&self, value: Value) -> bool {
        matches!(self.definitions.get(&value), Some(Definition::Sqrt(_)))
    }

    fn push(&mut self, kind: OpKind, before: &mut Vec<Op>) -> Value {
        self.function.push(before, Scalar::F32, kind)
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::transformed;

    fn approximated(text: &str) -> String {
        transformed(text, |function| {
            super::run(function);
            crate::gvn::run(function);
            crate::dce::run(function);
        })
    }

    #[test]
    fn quotients_share_the_inverse_of_their_divisor() {
        let text = "
            %a: f32 = load scratch:f@0 %b: f32 = load scratch:f@1 %m: f32 = load member:m@0
            %1: f32 = constant 1 %3: f32 = constant 3 %0: f32 = constant 0
            %n: f32 = negate %m
            %x: f32 = divide %a, %m %y: f32 = divide %b, %n %i: f32 = divide %1, %m
            %t: f32 = divide %a, %3 %z: f32 = divide %a, %0
            return scratch:f@0 = %x, scratch:f@1 = %y, scratch:f@2 = %i, scratch:f@3 = %t,
                member:m@0 = %z";
        expect![[r#"
            %0: f32 = constant 0.0
            %1: f32 = constant 0.33333334
            %4: f32 = load member:m@0
            %5: f32 = approximate_reciprocal %4
            %6: f32 = multiply %2, %5
            %7: f32 = negate %5
            %8: f32 = multiply %3, %7
            %9: f32 = multiply %2, %1
            %10: f32 = divide %2, %0
            return scratch:f@0 = %6, scratch:f@1 = %8, scratch:f@2 = %5, scratch:f@3 = %9, member:m@0 = %10
        "#]].assert_eq(&approximated(text));
    }

    #[test]
    fn roots_are_inverted_directly() {
        let text = "
            %a: f32 = load scratch:f@0 %b: f32 = load scratch:f@1 %m: f32 = load member:m@0
            %s: f32 = sqrt %b %q: f32 = divide %a, %s
            %p: f32 = multiply %m, %s %r: f32 = divide %a, %p
            return scratch:f@0 = %q, scratch:f@1 = %r, scratch:f@2 = %s";
        expect![[r#"
            %2: f32 = load member:m@0
            %3: f32 = approximate_sqrt %1
            %4: f32 = approximate_inverse_sqrt %1
            %5: f32 = multiply %0, %4
            %6: f32 = approximate_reciprocal %2
            %7: f32 = multiply %4, %6
            %8: f32 = multiply %0, %7
            return scratch:f@0 = %5, scratch:f@1 = %8, scratch:f@2 = %3
        "#]]
        .assert_eq(&approximated(text));
    }

    #[test]
    fn precise_operations_and_integers_stay() {
        let text = "
            %a: f32 = load scratch:f@0 %b: f32 = load scratch:f@1 %i: i32 = load scratch:i@0
            %s: f32 = precise sqrt %b %q: f32 = precise divide %a, %b
            %r: f32 = divide %a, %s %j: i32 = divide %i, %i
            return scratch:f@0 = %q, scratch:f@1 = %r, scratch:i@0 = %j";
        expect![[r#"
            %3: f32 = precise sqrt %1
            %4: f32 = precise divide %0, %1
            %5: f32 = approximate_reciprocal %3
            %6: f32 = multiply %0, %5
            %7: i32 = divide %2, %2
            return scratch:f@0 = %4, scratch:f@1 = %6, scratch:i@0 = %7
        "#]]
        .assert_eq(&approximated(text));
    }
}
