//! Contraction of multiply and add to fma: the only pass that changes rounding.
//!
//! # The rule
//!
//! An f32 `add` or `subtract` that is not `precise`, with an operand that is an f32 `multiply` that is not `precise`,
//! becomes one `fma`:
//!
//! ```text
//! a * b + c   fma(a, b, c)          c + a * b   fma(a, b, c)
//! a * b - c   fma(a, b, -c)         c - a * b   fma(-a, b, c)
//! ```
//!
//! If both operands are such multiplies, the first is contracted, unless its factors depend on the object only
//! (constants and members) and those of the second do not: then the second is. A product of the object's values is thus
//! computed once for all rays. The number of uses of a product and its position do not matter.
//!
//! This pass runs before all others, so that the contracted operations depend on the lowered function alone: not on the
//! results of another pass, on the backend, or on the level of optimisation. All passes after it preserve results to
//! the bit. With `--math=strict` it does not run.

use rtsl_ir::{
    BinaryOp, Function, Index, IndexVec, Op, OpKind, Region, Scalar, UnaryOp, Value, VariableKind,
};

/// Contracts the operations of `function`.
pub fn run(function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    let products = IndexVec::filled(function.values.len(), None);
    let of_object = IndexVec::filled(function.values.len(), false);
    Contraction { function, products, of_object }.region(&mut body);
    function.body = body;
}

struct Contraction<'a> {
    function: &'a mut Function,
    /// For each value that is a product, its factors.
    products: IndexVec<Value, Option<(Value, Value)>>,
    /// For each value, true if it is computed from constants and members only.
    of_object: IndexVec<Value, bool>,
}

impl Contraction<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            for region in op.kind.regions_mut() {
                self.region(region);
            }
            if self.is_of_object(&op.kind) {
                self.of_object[op.results.get(0)] = true;
            }
            self.op(&mut op, &mut ops);
            ops.push(op);
        }
        region.ops = ops;
    }

    fn is_of_object(&self, kind: &OpKind) -> bool {
        match kind {
            OpKind::Constant(_) => true,
            OpKind::Load(variable, Index::Constant(_)) => {
                match self.function.variable(*variable).kind {
                    VariableKind::Member | VariableKind::Parameter => true,
                    VariableKind::State
                    | VariableKind::Scratch
                    | VariableKind::Buffer
                    | VariableKind::Local
                    | VariableKind::Accepted => false,
                }
            }
            OpKind::Unary(..) | OpKind::Binary(..) | OpKind::Fma(..) | OpKind::Convert(..) => {
                let mut all = true;
                kind.for_each_operand(|value| all &= self.of_object[value]);
                all
            }
            _ => false,
        }
    }

    /// Contracts an operation; operations that it needs are appended to `before`.
    fn op(&mut self, op: &mut Op, before: &mut Vec<Op>) {
        let OpKind::Binary(operator, a, b) = op.kind else { return };
        if op.precise || self.function.scalar(a) != Scalar::F32 {
            return;
        }
        let subtract = match operator {
            BinaryOp::Multiply => {
                self.products[op.results.get(0)] = Some((a, b));
                return;
            }
            BinaryOp::Add => false,
            BinaryOp::Subtract => true,
            _ => return,
        };
        let left = self.product(a).filter(|_| !self.second_is_better(a, b));
        if let Some((x, y)) = left {
            let addend = if subtract { self.negated(b, before) } else { b };
            op.kind = OpKind::Fma(x, y, addend);
        } else if let Some((x, y)) = self.product(b) {
            let factor = if subtract { self.negated(x, before) } else { x };
            op.kind = OpKind::Fma(factor, y, a);
        }
    }

    /// True if of two products only the first can be computed once for all rays.
    fn second_is_better(&self, a: Value, b: Value) -> bool {
        let of_object = |value: Value| self.of_object[value];
        self.product(b).is_some() && of_object(a) && !of_object(b)
    }

    /// Returns the factors of a product; negations added by this pass do not count.
    fn product(&self, value: Value) -> Option<(Value, Value)> {
        self.products.get(value).copied().flatten()
    }

    fn negated(&mut self, value: Value, before: &mut Vec<Op>) -> Value {
        self.function.push(before, Scalar::F32, OpKind::Unary(UnaryOp::Negate, value))
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::transformed;

    #[test]
    fn sums_and_differences_of_products() {
        let text = "
            %a: f32 = load scratch:f@0 %b: f32 = load scratch:f@1 %c: f32 = load scratch:f@2
            %p: f32 = multiply %a, %b
            %q: f32 = multiply %b, %c
            %sum: f32 = add %p, %c
            %sum_right: f32 = add %c, %p
            %difference: f32 = subtract %p, %c
            %difference_right: f32 = subtract %c, %p
            %both: f32 = subtract %p, %q
            return";
        expect![[r#"
            %3: f32 = multiply %0, %1
            %4: f32 = multiply %1, %2
            %5: f32 = fma %0, %1, %2
            %6: f32 = fma %0, %1, %2
            %7: f32 = negate %2
            %8: f32 = fma %0, %1, %7
            %9: f32 = negate %0
            %10: f32 = fma %9, %1, %2
            %11: f32 = negate %4
            %12: f32 = fma %0, %1, %11
            return
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn products_of_the_object_are_added_to_others() {
        let text = "
            %a: f32 = load scratch:f@0 %m: f32 = load member:m@0 %n: f32 = load member:m@1
            %2: f32 = constant 2
            %object: f32 = multiply %m, %2 %other: f32 = multiply %n, %m
            %product: f32 = multiply %n, %a
            %r: f32 = add %object, %product
            %s: f32 = subtract %object, %product
            %t: f32 = add %object, %other
            return";
        expect![[r#"
            %1: f32 = load member:m@0
            %2: f32 = load member:m@1
            %3: f32 = constant 2.0
            %4: f32 = multiply %1, %3
            %5: f32 = multiply %2, %1
            %6: f32 = multiply %2, %0
            %7: f32 = fma %2, %0, %4
            %8: f32 = negate %2
            %9: f32 = fma %8, %0, %4
            %10: f32 = fma %1, %3, %5
            return
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn precise_and_integers_are_left_alone() {
        let text = "
            %a: f32 = load scratch:f@0 %i: i32 = load scratch:i@0
            %p: f32 = multiply %a, %a
            %sum: f32 = precise add %p, %a
            %q: f32 = precise multiply %a, %a
            %r: f32 = add %q, %a
            %j: i32 = multiply %i, %i
            %k: i32 = add %j, %i
            return";
        expect![[r#"
            %2: f32 = multiply %0, %0
            %3: f32 = precise add %2, %0
            %4: f32 = precise multiply %0, %0
            %5: f32 = add %4, %0
            %6: i32 = multiply %1, %1
            %7: i32 = add %6, %1
            return
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn across_regions() {
        let text = "
            %a: f32 = load scratch:f@0 %c: bool = load scratch:b@0
            %p: f32 = multiply %a, %a
            %s: f32 = if %c { %t: f32 = add %a, %p yield %t } else { yield %a }
            return scratch:f@0 = %s";
        expect![[r#"
            %2: f32 = multiply %0, %0
            %3: f32 = if %1 {
              %4: f32 = fma %0, %0, %0
              yield %4
            } else {
              yield %0
            }
            return scratch:f@0 = %3
        "#]]
        .assert_eq(&transformed(text, super::run));
    }
}
