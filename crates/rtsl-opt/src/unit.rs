//! Unit vectors: replaces the sum of the squares of their components by 1.
//!
//! The caller guarantees that the variables hold unit vectors. Because of rounding the sum is only nearly 1, so this
//! changes results. Folding then reduces a vector's length to 1 and a normalised vector to the vector itself.

use std::collections::HashMap;

use rtsl_ir::{
    BinaryOp, Constant, Function, Index, Op, OpKind, Region, Scalar, UnaryOp, Value, VariableId,
};

/// Replaces the squared lengths of these variables, three f32 each, by 1.
pub fn run(function: &mut Function, vectors: &[VariableId]) {
    let mut body = std::mem::take(&mut function.body);
    let mut squares =
        Squares { vectors, components: HashMap::new(), squares: HashMap::new(), function };
    squares.region(&mut body);
    function.body = body;
}

/// A component index of a vector variable, or a bit mask of components.
type Part = (VariableId, u32);

/// The mask of all three components.
const ALL: u32 = 0b111;

struct Squares<'a> {
    vectors: &'a [VariableId],
    /// Values that are a component of a vector, or its negative.
    components: HashMap<Value, Part>,
    /// Values that are sums of the squares of different components, as bit masks.
    squares: HashMap<Value, Part>,
    function: &'a mut Function,
}

impl Squares<'_> {
    fn region(&mut self, region: &mut Region) {
        for op in &mut region.ops {
            op.kind.regions_mut().for_each(|region| self.region(region));
            self.op(op);
        }
    }

    fn op(&mut self, op: &mut Op) {
        let Some(result) = op.results.iter().next() else { return };
        if let Some(component) = self.component(&op.kind) {
            self.components.insert(result, component);
        }
        if op.precise {
            return;
        }
        match self.sum(&op.kind) {
            Some((_, ALL)) => op.kind = OpKind::Constant(Constant::F32(1.0)),
            Some(sum) => {
                self.squares.insert(result, sum);
            }
            None => {}
        }
    }

    fn component(&self, kind: &OpKind) -> Option<Part> {
        match *kind {
            OpKind::Load(variable, Index::Constant(index)) => {
                self.vectors.contains(&variable).then_some((variable, index))
            }
            OpKind::Unary(UnaryOp::Negate, a) => self.components.get(&a).copied(),
            _ => None,
        }
    }

    fn sum(&self, kind: &OpKind) -> Option<Part> {
        match *kind {
            OpKind::Binary(BinaryOp::Multiply, a, b) => self.square(a, b),
            OpKind::Fma(a, b, c) => disjoint(self.square(a, b)?, *self.squares.get(&c)?),
            OpKind::Binary(BinaryOp::Add, a, b) if self.function.scalar(a) == Scalar::F32 => {
                disjoint(*self.squares.get(&a)?, *self.squares.get(&b)?)
            }
            _ => None,
        }
    }

    fn square(&self, a: Value, b: Value) -> Option<Part> {
        let (variable, index) = *self.components.get(&a)?;
        (self.components.get(&b) == Some(&(variable, index))).then_some((variable, 1 << index))
    }
}

/// Returns the union of two masks if they belong to one vector and are disjoint.
fn disjoint((a, left): Part, (b, right): Part) -> Option<Part> {
    (a == b && left & right == 0).then_some((a, left | right))
}

#[cfg(test)]
mod tests {
    use expect_test::expect;
    use rtsl_ir::VariableKind;

    use crate::testing::transformed;

    #[test]
    fn the_square_of_the_length_is_one() {
        let text = "
            %x: f32 = load member:m@0 %y: f32 = load member:m@1 %z: f32 = load member:m@2
            %f: f32 = load scratch:f@0
            %nx: f32 = negate %x
            %xx: f32 = multiply %nx, %nx %xy: f32 = fma %y, %y, %xx %dot: f32 = fma %z, %z, %xy
            %length: f32 = approximate_sqrt %dot
            %inverse: f32 = approximate_inverse_sqrt %dot %unit: f32 = multiply %y, %inverse
            %xz: f32 = fma %z, %z, %xx %twice: f32 = fma %x, %x, %xz
            %yf: f32 = fma %y, %f, %xz %sum: f32 = precise fma %z, %z, %xy
            return scratch:f@0 = %length, scratch:f@1 = %unit, scratch:f@2 = %twice,
                scratch:f@3 = %yf, member:m@0 = %sum";
        let found = transformed(text, |function| {
            let vector = function.find_variable(VariableKind::Member, "m").unwrap();
            super::run(function, &[vector]);
            crate::simplify::run(function);
            crate::dce::run(function);
        });
        expect![[r#"
            %0: f32 = load member:m@0
            %1: f32 = load member:m@1
            %2: f32 = load member:m@2
            %4: f32 = multiply %0, %0
            %5: f32 = fma %1, %1, %4
            %6: f32 = constant 1.0
            %7: f32 = fma %2, %2, %4
            %8: f32 = fma %0, %0, %7
            %9: f32 = fma %1, %3, %7
            %10: f32 = precise fma %2, %2, %5
            return scratch:f@0 = %6, scratch:f@1 = %1, scratch:f@2 = %8, scratch:f@3 = %9, member:m@0 = %10
        "#]].assert_eq(&found);
    }
}
