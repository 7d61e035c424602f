//! Complementary results: where two bools that an `if` yields are always opposite, one becomes the negation of the
//! other.
//!
//! Flags such as "has returned" and "goes on" are set on every way through nested branches.
//! [`simplify`](crate::simplify) knows each by itself; as negations of each other, a branch on one decides those on the
//! other.

use std::collections::HashMap;

use rtsl_ir::{Constant, Function, Op, OpKind, Region, Scalar, UnaryOp, Value};

use crate::substitution::Substitution;

/// The greatest number of bools of one `if` that are compared with each other.
const MAX_BOOLS: usize = 16;

/// Negates one of each two complementary results in `function`.
pub fn run(function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    let mut complements = Complements {
        function,
        constants: HashMap::new(),
        opposites: HashMap::new(),
        substitution: Substitution::default(),
    };
    complements.region(&mut body);
    let Complements { function, substitution, .. } = complements;
    substitution.keep_names(&mut function.names);
    function.body = body;
}

struct Complements<'a> {
    function: &'a mut Function,
    constants: HashMap<Value, bool>,
    /// The operands of negations by their results.
    opposites: HashMap<Value, Value>,
    substitution: Substitution,
}

impl Complements<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            self.substitution.apply_to_operands(&mut op.kind);
            op.kind.regions_mut().for_each(|region| self.region(region));
            match op.kind {
                OpKind::Constant(Constant::Bool(value)) => {
                    self.constants.insert(op.results.get(0), value);
                }
                OpKind::Unary(UnaryOp::Not, of) if self.function.scalar(of) == Scalar::Bool => {
                    self.opposites.insert(op.results.get(0), of);
                }
                _ => {}
            }
            let negated = self.complements(&op);
            ops.push(op);
            for (first, second) in negated {
                let not =
                    self.function.push(&mut ops, Scalar::Bool, OpKind::Unary(UnaryOp::Not, first));
                self.opposites.insert(not, first);
                self.substitution.set(second, not);
            }
        }
        region.ops = ops;
        self.substitution.apply_to_yields(region);
    }

    /// Returns the pairs of complementary results of an `if`; each result is the second of one pair at most.
    fn complements(&self, op: &Op) -> Vec<(Value, Value)> {
        let OpKind::If { then, otherwise, .. } = &op.kind else { return Vec::new() };
        let results = op.results.iter().zip(then.yields.iter().zip(&otherwise.yields));
        let bools = results.filter(|(result, _)| self.function.scalar(*result) == Scalar::Bool);
        let bools: Vec<(Value, (&Value, &Value))> = bools.take(MAX_BOOLS).collect();
        let mut pairs: Vec<(Value, Value)> = Vec::new();
        for (index, (second, (then, otherwise))) in bools.iter().enumerate() {
            let first =
                bools[..index].iter().find(|(first, (then_of_first, otherwise_of_first))| {
                    !pairs.iter().any(|(_, second)| second == first)
                        && self.are_opposite(**then_of_first, **then)
                        && self.are_opposite(**otherwise_of_first, **otherwise)
                });
            pairs.extend(first.map(|(first, _)| (*first, *second)));
        }
        pairs
    }

    fn are_opposite(&self, a: Value, b: Value) -> bool {
        match (self.constants.get(&a), self.constants.get(&b)) {
            (Some(a), Some(b)) => a != b,
            _ => self.opposites.get(&a) == Some(&b) || self.opposites.get(&b) == Some(&a),
        }
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, transformed};

    #[test]
    fn opposite_flags_of_nested_branches_become_one() {
        let text = "
            %t: bool = constant true %f: bool = constant false
            %c: bool = load scratch:b@0 %x: f32 = load scratch:f@0
            %d: bool = equal %x, %x
            %left: bool, %y: f32, %stays: bool = if %c {
                %a: bool, %b: bool = if %d { yield %t, %f } else { yield %f, %t }
                yield %a, %x, %b
            } else { yield %t, %x, %f }
            %r: f32 = select %stays, %x, %y
            return scratch:f@0 = %r";
        expect![[r#"
            %0: bool = constant true
            %1: bool = constant false
            %4: bool = equal %3, %3
            %5: bool, %6: f32, %7: bool = if %2 {
              %8: bool, %9: bool = if %4 {
                yield %0, %1
              } else {
                yield %1, %0
              }
              %10: bool = not %8
              yield %8, %3, %10
            } else {
              yield %0, %3, %1
            }
            %11: bool = not %5
            %12: f32 = select %11, %3, %6
            return scratch:f@0 = %12
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn flags_that_agree_somewhere_stay() {
        let text = "
            %t: bool = constant true %f: bool = constant false
            %c: bool = load scratch:b@0 %x: f32 = load scratch:f@0
            %a: bool, %b: bool = if %c { yield %t, %f } else { yield %f, %f }
            %y: f32 = select %a, %x, %x %r: f32 = select %b, %x, %y
            return scratch:f@0 = %r";
        expect![[r#"
            %0: bool = constant true
            %1: bool = constant false
            %4: bool, %5: bool = if %2 {
              yield %0, %1
            } else {
              yield %1, %1
            }
            %6: f32 = select %4, %3, %3
            %7: f32 = select %5, %3, %6
            return scratch:f@0 = %7
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn results_are_preserved() {
        check_preserves(super::run);
    }
}
