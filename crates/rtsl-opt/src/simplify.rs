//! Folding: computes operations on constants, applies exact algebra and removes decided control flow.
//!
//! - An operation whose operands are constants becomes the constant that the interpreter would compute; others are
//!   rewritten by the rules of the `algebra` module.
//! - An `if` with a known condition becomes its region. Inside the regions of any other its condition is known, and
//!   earlier selects by it are the chosen side.
//! - An `if` whose regions yield the same value gives that value.
//! - A loop that never repeats becomes its body; a carried value that never changes becomes its initial value.
//!
//! Unused operations are left to dead code elimination.

use std::collections::HashMap;

use rtsl_ir::{Constant, Function, IndexVec, Op, OpKind, Region, UnaryOp, Value};

use crate::algebra::{Definition, Facts, Simplified, simplify};
use crate::substitution::Substitution;

/// The greatest number of successive rules applied to an operation.
const MAX_STEPS: u32 = 8;

/// The greatest number of selects by a condition that are replaced where it is known, the last ones.
const MAX_CHOSEN: usize = 32;

/// Folds the operations of `function`.
pub fn run(function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    let mut folding = Folding {
        known: IndexVec::filled(function.values.len(), None),
        definitions: IndexVec::filled(function.values.len(), None),
        selected: HashMap::new(),
        function,
        substitution: Substitution::default(),
    };
    folding.region(&mut body);
    let substitution = folding.substitution;
    substitution.keep_names(&mut function.names);
    function.body = body;
}

struct Folding<'a> {
    function: &'a Function,
    known: IndexVec<Value, Option<Constant>>,
    definitions: IndexVec<Value, Option<Definition>>,
    /// The selects so far by their conditions: results, and both sides.
    selected: HashMap<Value, Vec<(Value, [Value; 2])>>,
    substitution: Substitution,
}

impl Folding<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        self.ops(std::mem::take(&mut region.ops), &mut ops);
        region.ops = ops;
        self.substitution.apply_to_yields(region);
    }

    fn ops(&mut self, ops: Vec<Op>, out: &mut Vec<Op>) {
        for mut op in ops {
            self.substitution.apply_to_operands(&mut op.kind);
            match op.kind {
                OpKind::If { .. } => self.fold_if(op, out),
                OpKind::Loop { .. } => self.fold_loop(op, out),
                _ => self.fold_plain(op, out),
            }
        }
    }

    /// Folds an operation without regions.
    fn fold_plain(&mut self, mut op: Op, out: &mut Vec<Op>) {
        for _ in 0..MAX_STEPS {
            let facts = Facts {
                scalars: &self.function.values,
                variables: &self.function.variables,
                known: &self.known,
                definitions: &self.definitions,
            };
            match simplify(&op.kind, &facts) {
                None => break,
                Some(Simplified::Value(value)) => {
                    self.substitution.set(op.results.get(0), value);
                    return;
                }
                Some(Simplified::Constant(constant)) => op.kind = OpKind::Constant(constant),
                Some(Simplified::Kind(kind)) => {
                    op.kind = kind;
                    self.substitution.apply_to_operands(&mut op.kind);
                }
            }
        }
        if op.results.count == 1 {
            let index = op.results.get(0);
            self.definitions[index] = Definition::of(&op.kind);
            if let OpKind::Constant(constant) = op.kind {
                self.known[index] = Some(constant);
            }
            if let OpKind::Select(condition, a, b) = op.kind {
                self.selected.entry(condition).or_default().push((op.results.get(0), [a, b]));
            }
        }
        out.push(op);
    }

    fn fold_if(&mut self, mut op: Op, out: &mut Vec<Op>) {
        let OpKind::If { condition, then, otherwise } = &mut op.kind else { return };
        if let Some(known) = self.known[*condition] {
            let chosen = if known.bits() != 0 { then } else { otherwise };
            let Region { ops, yields, .. } = std::mem::take(chosen);
            self.ops(ops, out);
            self.substitution.set_all(op.results, yields);
            return;
        }
        let condition = *condition;
        self.assuming(condition, true, |folding| folding.region(then));
        self.assuming(condition, false, |folding| folding.region(otherwise));
        for (result, (a, b)) in op.results.iter().zip(then.yields.iter().zip(&otherwise.yields)) {
            if a == b {
                self.substitution.set(result, *a);
            }
        }
        out.push(op);
    }

    /// Runs `work` under the assumption that a bool is `is`.
    fn assuming(&mut self, condition: Value, is: bool, work: impl FnOnce(&mut Self)) {
        let opposite = match self.definitions[condition] {
            Some(Definition::Unary(UnaryOp::Not, opposite)) => Some(opposite),
            _ => None,
        };
        let facts = [(Some(condition), is), (opposite, !is)];
        let facts = facts.into_iter().filter_map(|(value, is)| Some((value?, is)));
        let facts: Vec<(Value, bool)> = facts.collect();
        let known = facts
            .iter()
            .map(|(value, is)| (*value, self.known[*value].replace(Constant::Bool(*is))));
        let known: Vec<_> = known.collect();
        let chosen: Vec<(Value, Value)> =
            facts.iter().flat_map(|(value, is)| self.chosen(*value, *is)).collect();
        for (result, side) in &chosen {
            self.substitution.set(*result, *side);
        }
        work(self);
        for (result, _) in chosen {
            self.substitution.unset(result);
        }
        for (value, known) in known {
            self.known[value] = known;
        }
    }

    /// Returns the selects by a condition, with the side chosen if it is `is`.
    fn chosen(&self, condition: Value, is: bool) -> impl Iterator<Item = (Value, Value)> {
        let selected = self.selected.get(&condition).into_iter().flatten();
        selected
            .rev()
            .take(MAX_CHOSEN)
            .map(move |(result, sides)| (*result, sides[usize::from(!is)]))
    }

    fn fold_loop(&mut self, mut op: Op, out: &mut Vec<Op>) {
        let OpKind::Loop { initial, body } = &mut op.kind else { return };
        for (index, first) in initial.iter().enumerate() {
            let next = body.yields[index + 1];
            if next == body.params[index] || self.substitution.get(next) == *first {
                self.substitution.set(body.params[index], *first);
                self.substitution.set(op.results.get(index as u32), *first);
            }
        }
        // A loop known to run once is folded once, as the body that replaces it.
        if !self.runs_once(body) {
            self.region(body);
        }
        if !self.runs_once(body) {
            out.push(op);
            return;
        }
        for (param, first) in body.params.iter().zip(initial) {
            self.substitution.set(*param, *first);
        }
        let Region { ops, yields, .. } = std::mem::take(body);
        self.ops(ops, out);
        self.substitution.set_all(op.results, yields.into_iter().skip(1));
    }

    fn runs_once(&self, body: &Region) -> bool {
        let again = self.substitution.get(body.yields[0]);
        self.known[again] == Some(Constant::Bool(false))
    }
}

#[cfg(test)]
mod tests {
    use expect_test::{Expect, expect};

    use crate::testing::{check_preserves, transformed};

    /// Folds and then eliminates dead code.
    fn check(text: &str, expected: Expect) {
        let folded = transformed(text, |function| {
            super::run(function);
            crate::dce::run(function);
        });
        expected.assert_eq(&folded);
    }

    #[test]
    fn constants_are_computed() {
        let text = "
            %2: f32 = constant 2 %3: f32 = constant 3 %s: f32 = add %2, %3 %q: f32 = sqrt %s
            %i: i32 = convert %q %z: i32 = constant 0 %d: i32 = divide %i, %z
            return scratch:f@0 = %q, scratch:i@0 = %i, scratch:i@1 = %d";
        check(
            text,
            expect![[r#"
                %0: f32 = constant 2.236068
                %1: i32 = constant 2
                %2: i32 = constant 0
                return scratch:f@0 = %0, scratch:i@0 = %1, scratch:i@1 = %2
            "#]],
        );
    }

    #[test]
    fn a_select_is_one_side_where_its_condition_is_known() {
        let text = "
            %c: bool = load scratch:b@0 %x: f32 = load scratch:f@0 %y: f32 = load scratch:f@1
            %s: f32 = select %c, %x, %y %n: bool = not %c
            %r: f32 = if %n {
                %a: f32 = sqrt %s yield %a
            } else { %b: f32 = negate %s yield %b }
            %t: f32 = abs %s
            return scratch:f@0 = %r, scratch:f@1 = %t";
        check(
            text,
            expect![[r#"
                %3: f32 = select %0, %1, %2
                %4: bool = not %0
                %5: f32 = if %4 {
                  %6: f32 = sqrt %2
                  yield %6
                } else {
                  %7: f32 = negate %1
                  yield %7
                }
                %8: f32 = abs %3
                return scratch:f@0 = %5, scratch:f@1 = %8
            "#]],
        );
    }

    #[test]
    fn floats_keep_their_bits() {
        let text = "
            %x: f32 = load scratch:f@0 %0: f32 = constant 0 %n: f32 = constant -0.0
            %1: f32 = constant 1
            %a: f32 = add %x, %0 %b: f32 = add %x, %n %c: f32 = multiply %x, %0
            %d: f32 = subtract %x, %x %e: f32 = multiply %x, %1
            return scratch:f@0 = %a, scratch:f@1 = %b, scratch:f@2 = %c, scratch:f@3 = %d";
        check(
            text,
            expect![[r#"
                %1: f32 = constant 0.0
                %2: f32 = add %0, %1
                %3: f32 = multiply %0, %1
                %4: f32 = subtract %0, %0
                return scratch:f@0 = %2, scratch:f@1 = %0, scratch:f@2 = %3, scratch:f@3 = %4
            "#]],
        );
    }

    #[test]
    fn negations_and_flags() {
        let text = "
            %x: f32 = load scratch:f@0 %y: f32 = load scratch:f@1 %c: bool = load scratch:b@0
            %nx: f32 = negate %x %a: f32 = add %y, %nx %b: f32 = negate %nx
            %t: bool = constant true %f: bool = constant false
            %s: bool = select %c, %f, %t %r: f32 = select %s, %x, %y
            %k: i32 = convert %c %z: i32 = constant 0 %l: bool = not_equal %k, %z
            return scratch:f@0 = %a, scratch:f@1 = %b, scratch:f@2 = %r, scratch:b@1 = %l";
        check(
            text,
            expect![[r#"
                %3: f32 = subtract %1, %0
                %4: f32 = select %2, %1, %0
                return scratch:f@0 = %3, scratch:f@1 = %0, scratch:f@2 = %4, scratch:b@1 = %2
            "#]],
        );
    }

    #[test]
    fn choices_by_one_condition() {
        let text = "
            %c: bool = load scratch:b@0 %d: bool = load scratch:b@1
            %x: f32 = load scratch:f@0 %y: f32 = load scratch:f@1 %z: f32 = load scratch:f@2
            %inner: f32 = select %c, %x, %y %outer: f32 = select %c, %inner, %z
            %or: bool = select %c, %c, %d %and: bool = select %c, %d, %c
            return scratch:f@0 = %outer, scratch:b@0 = %or, scratch:b@1 = %and";
        check(
            text,
            expect![[r#"
                %4: f32 = select %0, %2, %3
                %5: bool = or %0, %1
                %6: bool = and %0, %1
                return scratch:f@0 = %4, scratch:b@0 = %5, scratch:b@1 = %6
            "#]],
        );
    }

    #[test]
    fn indices_become_constant_and_are_clamped() {
        let text = "
            %i: i32 = constant 9 %j: i32 = constant -1
            %a: f32 = load member:m@%i %b: f32 = load member:m@%j
            %c: f32 = load buffer:t@%i %d: f32 = load buffer:t@%j
            return scratch:f@0 = %a, scratch:f@1 = %b, scratch:f@2 = %c, scratch:f@3 = %d";
        check(
            text,
            expect![[r#"
                %0: i32 = constant 9
                %1: f32 = load member:m@2
                %2: f32 = load member:m@0
                %3: f32 = load buffer:t@%0
                %4: f32 = load buffer:t@0
                return scratch:f@0 = %1, scratch:f@1 = %2, scratch:f@2 = %3, scratch:f@3 = %4
            "#]],
        );
    }

    #[test]
    fn conditions_are_known_inside() {
        let text = "
            %c: bool = load scratch:b@0 %x: f32 = load scratch:f@0 %y: f32 = load scratch:f@1
            %n: bool = not %c
            %r: f32 = if %n {
                %s: f32 = if %c { yield %x } else { yield %y }
                yield %s
            } else {
                %s2: f32 = select %c, %x, %y
                yield %s2
            }
            return scratch:f@0 = %r";
        check(
            text,
            expect![[r#"
                %3: bool = not %0
                %4: f32 = if %3 {
                  yield %2
                } else {
                  yield %1
                }
                return scratch:f@0 = %4
            "#]],
        );
    }

    #[test]
    fn a_loop_that_runs_once_is_its_body() {
        let text = "
            %x: f32 = load scratch:f@0 %f: bool = constant false
            %r: f32 = loop (%p: f32 = %x) {
                %q: f32 = negate %p %q2: f32 = negate %q %s: f32 = add %q2, %q2
                repeat %f, %s
            }
            return scratch:f@0 = %r";
        check(
            text,
            expect![[r#"
                %1: f32 = add %0, %0
                return scratch:f@0 = %1
            "#]],
        );
    }

    #[test]
    fn unchanged_carried_values_are_removed() {
        let text = "
            %x: f32 = load scratch:f@0 %c: bool = load scratch:b@0
            %r: f32, %s: f32, %q: f32 = loop (%p: f32 = %x, %k: f32 = %x, %m: f32 = %x) {
                %q2: f32 = add %p, %k
                %q3: f32 = add %q2, %m
                repeat %c, %q3, %k, %x
            }
            %t: f32 = add %s, %q
            return scratch:f@0 = %r, scratch:f@1 = %t";
        check(
            text,
            expect![[r#"
                %2: f32 = loop (%3: f32 = %0) {
                  %4: f32 = add %3, %0
                  %5: f32 = add %4, %0
                  repeat %1, %5
                }
                %6: f32 = add %0, %0
                return scratch:f@0 = %2, scratch:f@1 = %6
            "#]],
        );
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
