//! Value numbering: removes redundant computations.
//!
//! An operation without effects that equals an earlier one, in its region or in an enclosing one, is replaced by that
//! one's result (Click and Cooper's dominator-scoped numbering; regions form the dominator tree). All constants move to
//! the start of the function, so that equal ones in different regions are one value. Operands of commutative operations
//! are sorted first.

use std::collections::HashMap;

use rtsl_ir::{
    BinaryOp, CompareOp, Constant, ConstantPool, Effect, Function, Index, Op, OpKind, Region,
    Scalar, UnaryOp, Value, Values, VariableId,
};

use crate::substitution::Substitution;

/// Numbers the values of `function`.
pub fn run(function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    let mut numbering = Numbering {
        constants: ConstantPool::default(),
        function,
        seen: HashMap::new(),
        scope: Vec::new(),
        substitution: Substitution::default(),
    };
    numbering.region(&mut body);
    numbering.substitution.keep_names(&mut numbering.function.names);
    let constants = numbering.constants;
    function.body = body;
    constants.define_in(function);
}

/// The computation of an operation: equal keys have equal results.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Key {
    Unary(UnaryOp, Value),
    Binary(BinaryOp, Value, Value),
    Compare(CompareOp, Value, Value),
    Select(Value, Value, Value),
    Fma(Value, Value, Value),
    Convert(Scalar, Value),
    Bitcast(Scalar, Value),
    Load(VariableId, Index),
    Length(VariableId),
    LightCount,
    Ambient,
}

struct Numbering<'a> {
    constants: ConstantPool,
    function: &'a mut Function,
    /// The results of the visible operations. Used for lookup only, so the iteration order cannot affect results. The
    /// bool marks precise operations, which are distinct from others for passes that treat them differently.
    seen: HashMap<(Key, bool), Values>,
    /// The keys added in the open regions, in order.
    scope: Vec<(Key, bool)>,
    substitution: Substitution,
}

impl Numbering<'_> {
    fn region(&mut self, region: &mut Region) {
        let outside = self.scope.len();
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            self.substitution.apply_to_operands(&mut op.kind);
            for region in op.kind.regions_mut() {
                self.region(region);
            }
            if self.is_new(&mut op) {
                ops.push(op);
            }
        }
        region.ops = ops;
        self.substitution.apply_to_yields(region);
        for key in self.scope.drain(outside..) {
            self.seen.remove(&key);
        }
    }

    /// Records an operation and returns true, or substitutes the results of an equal one and returns false.
    fn is_new(&mut self, op: &mut Op) -> bool {
        if let OpKind::Constant(constant) = op.kind {
            self.pool(op.results, constant);
            return false;
        }
        if let OpKind::Binary(operator, a, b) = &mut op.kind
            && is_commutative(*operator)
            && *b < *a
        {
            std::mem::swap(a, b);
        }
        if op.kind.effect(&self.function.variables) != Effect::None {
            return true;
        }
        let Some(key) = key(&op.kind) else { return true };
        let key = (key, op.precise && precision_matters(&op.kind));
        if let Some(results) = self.seen.get(&key) {
            self.substitution.set_all(op.results, results.iter());
            return false;
        }
        self.seen.insert(key, op.results);
        self.scope.push(key);
        true
    }

    fn pool(&mut self, results: Values, constant: Constant) {
        let value = self.constants.intern(&mut self.function.values, constant);
        self.substitution.set(results.get(0), value);
    }
}

/// True if a pass treats the operation differently when it is precise.
fn precision_matters(kind: &OpKind) -> bool {
    matches!(
        kind,
        OpKind::Unary(UnaryOp::Sqrt, _)
            | OpKind::Binary(
                BinaryOp::Add | BinaryOp::Subtract | BinaryOp::Multiply | BinaryOp::Divide,
                ..
            )
    )
}

/// True for commutative operators. `min` and `max` are not: operand order matters for NaN and for zeros.
fn is_commutative(op: BinaryOp) -> bool {
    match op {
        BinaryOp::Add
        | BinaryOp::Multiply
        | BinaryOp::And
        | BinaryOp::Or
        | BinaryOp::Xor
        | BinaryOp::MultiplyHigh => true,
        BinaryOp::Subtract
        | BinaryOp::Divide
        | BinaryOp::Remainder
        | BinaryOp::Min
        | BinaryOp::Max
        | BinaryOp::ShiftLeft
        | BinaryOp::ShiftRight => false,
    }
}

/// Returns the key of an operation; `None` if it has regions or effects.
pub(crate) fn key(kind: &OpKind) -> Option<Key> {
    match *kind {
        OpKind::Unary(op, a) => Some(Key::Unary(op, a)),
        OpKind::Binary(op, a, b) => Some(Key::Binary(op, a, b)),
        OpKind::Compare(op, a, b) => Some(Key::Compare(op, a, b)),
        OpKind::Select(condition, a, b) => Some(Key::Select(condition, a, b)),
        OpKind::Fma(a, b, c) => Some(Key::Fma(a, b, c)),
        OpKind::Convert(to, a) => Some(Key::Convert(to, a)),
        OpKind::Bitcast(to, a) => Some(Key::Bitcast(to, a)),
        OpKind::Load(variable, index) => Some(Key::Load(variable, index)),
        OpKind::Length(variable) => Some(Key::Length(variable)),
        OpKind::LightCount => Some(Key::LightCount),
        OpKind::Ambient => Some(Key::Ambient),
        OpKind::Constant(_)
        | OpKind::Store(..)
        | OpKind::If { .. }
        | OpKind::Loop { .. }
        | OpKind::Trace { .. }
        | OpKind::Occluded { .. }
        | OpKind::LightSample { .. }
        | OpKind::Rand
        | OpKind::Query(..)
        | OpKind::Seed(_)
        | OpKind::Derivative(..)
        | OpKind::ChainRule(..)
        | OpKind::ReferenceCall(_)
        | OpKind::IsSet(..)
        | OpKind::ReferenceCount(_)
        | OpKind::Report(..)
        | OpKind::ReportBudget => None,
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, transformed};

    #[test]
    fn values_are_visible_in_nested_but_not_in_sibling_regions() {
        let text = "
            %c: bool = load scratch:b@0 %x: f32 = load member:m@0
            %a: f32 = if %c {
                %y: f32 = load member:m@0 %one: f32 = constant 1
                %z: f32 = add %one, %y yield %z
            } else {
                %y2: f32 = load member:m@0 %one2: f32 = constant 1
                %z2: f32 = add %y2, %one2 yield %z2
            }
            %m: f32 = min %x, %a %n: f32 = min %a, %x
            %r: f32 = rand %s: f32 = rand
            return scratch:f@0 = %a, scratch:f@1 = %m, scratch:f@2 = %n, scratch:f@3 = %s";
        expect![[r#"
            %0: f32 = constant 1.0
            %2: f32 = load member:m@0
            %3: f32 = if %1 {
              %4: f32 = add %2, %0
              yield %4
            } else {
              %5: f32 = add %2, %0
              yield %5
            }
            %6: f32 = min %2, %3
            %7: f32 = min %3, %2
            %8: f32 = rand
            %9: f32 = rand
            return scratch:f@0 = %3, scratch:f@1 = %6, scratch:f@2 = %7, scratch:f@3 = %9
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn precise_distinguishes_only_arithmetic() {
        let text = "
            %x: f32 = load scratch:f@0 %y: f32 = load scratch:f@1
            %a: f32 = multiply %x, %y %b: f32 = precise multiply %x, %y
            %c: bool = less %x, %y %d: bool = precise less %x, %y
            return scratch:f@0 = %a, scratch:f@1 = %b, scratch:b@0 = %c, scratch:b@1 = %d";
        expect![[r#"
            %2: f32 = multiply %0, %1
            %3: f32 = precise multiply %0, %1
            %4: bool = less %0, %1
            return scratch:f@0 = %2, scratch:f@1 = %3, scratch:b@0 = %4, scratch:b@1 = %4
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn loads_of_locals_are_not_the_same_after_a_store() {
        let text = "
            %i: i32 = load scratch:i@0
            %a: i32 = load local:r@%i
            store local:r@0, %i
            %b: i32 = load local:r@%i
            return scratch:i@0 = %a, scratch:i@1 = %b";
        expect![[r#"
            %1: i32 = load local:r@%0
            store local:r@0, %0
            %2: i32 = load local:r@%0
            return scratch:i@0 = %1, scratch:i@1 = %2
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
