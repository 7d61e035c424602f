//! Simplifies loop-carried values that are dead after the loop.
//!
//! A carried value whose result is unused matters only if the loop repeats, so its next value may be simplified under
//! the assumption that the loop's condition is true. `for (...; i++) { if (done) break; }` becomes a loop that repeats
//! unless `done`, with a counter that is unchanged if `done`. After this pass the counter is simply incremented. For
//! one ray this saves a select; for packets much more: rays that are still in the loop have made the same number of
//! iterations, so the counter is uniform.

use std::collections::{HashMap, HashSet};

use rtsl_ir::{
    BinaryOp, Constant, ConstantPool, Function, IndexVec, OpKind, Region, UnaryOp, Value, Values,
};

/// Simplifies the carried values of the loops of `function`.
pub fn run(function: &mut Function) {
    let mut used = IndexVec::filled(function.values.len(), false);
    function.body.for_each_use(&mut |value| used[value] = true);
    let mut known = HashMap::new();
    function.body.for_each_op(&mut |op| {
        if let OpKind::Constant(constant) = op.kind {
            known.insert(op.results.get(0), constant);
        }
    });
    let mut pool = ConstantPool::of(function);
    let mut body = std::mem::take(&mut function.body);
    let mut pass = Pass { used, known, pool: &mut pool, function };
    pass.region(&mut body);
    function.body = body;
    pool.define_in(function);
}

struct Pass<'a> {
    /// For each value, true if it is used.
    used: IndexVec<Value, bool>,
    known: HashMap<Value, Constant>,
    pool: &'a mut ConstantPool,
    function: &'a mut Function,
}

impl Pass<'_> {
    fn region(&mut self, region: &mut Region) {
        for op in &mut region.ops {
            let results = op.results;
            for region in op.kind.regions_mut() {
                self.region(region);
            }
            if let OpKind::Loop { body, .. } = &mut op.kind {
                self.simplify(results, body);
            }
        }
    }

    fn simplify(&mut self, results: Values, body: &mut Region) {
        let Some((again, next)) = body.yields.split_first() else { return };
        let facts = Facts::new(*again, body, &self.known);
        let mut simplified = Vec::with_capacity(body.yields.len());
        simplified.push(*again);
        for (result, next) in results.iter().zip(next) {
            let is_used = self.used[result];
            simplified.push(if is_used { *next } else { self.next(&facts, *next) });
        }
        body.yields = simplified;
    }

    fn next(&mut self, facts: &Facts<'_>, value: Value) -> Value {
        let value = facts.follow(value);
        match facts.truths.get(&value) {
            Some(truth) => self.pool.intern(&mut self.function.values, Constant::Bool(*truth)),
            None => value,
        }
    }
}

/// Facts about values at the end of a loop's body if the loop repeats.
struct Facts<'a> {
    /// The operations of the body itself, by their results.
    defined: HashMap<Value, (&'a OpKind, u32)>,
    truths: HashMap<Value, bool>,
}

impl<'a> Facts<'a> {
    fn new(again: Value, body: &'a Region, known: &HashMap<Value, Constant>) -> Self {
        let results = body.ops.iter().flat_map(|op| {
            op.results.iter().zip(0..).map(|(result, index)| (result, (&op.kind, index)))
        });
        let mut facts = Facts { defined: results.collect(), truths: HashMap::new() };
        let mut open = vec![(again, true)];
        // Each value is visited once. If two facts contradict each other the loop never repeats, and either may be
        // used.
        while let Some((value, truth)) = open.pop() {
            if facts.truths.insert(value, truth).is_none() {
                facts.conclude(value, truth, known, &mut open);
            }
        }
        facts
    }

    /// Adds the facts implied by a bool being `truth`.
    fn conclude(
        &self,
        value: Value,
        truth: bool,
        known: &HashMap<Value, Constant>,
        conclusions: &mut Vec<(Value, bool)>,
    ) {
        let Some((kind, _)) = self.defined.get(&value) else { return };
        let is_other = |value: &Value| known.get(value) == Some(&Constant::Bool(!truth));
        match kind {
            OpKind::Unary(UnaryOp::Not, a) => conclusions.push((*a, !truth)),
            OpKind::Binary(BinaryOp::And, a, b) if truth => {
                conclusions.extend([(*a, true), (*b, true)]);
            }
            OpKind::Binary(BinaryOp::Or, a, b) if !truth => {
                conclusions.extend([(*a, false), (*b, false)]);
            }
            OpKind::Select(condition, a, b) if is_other(a) => {
                conclusions.extend([(*condition, false), (*b, truth)]);
            }
            OpKind::Select(condition, a, b) if is_other(b) => {
                conclusions.extend([(*condition, true), (*a, truth)]);
            }
            _ => {}
        }
    }

    /// Returns the value that `value` equals under the facts, as far as selects and branches determine it.
    fn follow(&self, mut value: Value) -> Value {
        while let Some((kind, index)) = self.defined.get(&value) {
            let chosen = match kind {
                OpKind::Select(condition, a, b) => {
                    self.truths.get(condition).map(|truth| if *truth { *a } else { *b })
                }
                OpKind::If { condition, then, otherwise } => self
                    .truths
                    .get(condition)
                    .map(|truth| if *truth { then } else { otherwise })
                    .and_then(|side| yielded_from_outside(side, *index)),
                _ => None,
            };
            match chosen {
                Some(chosen) => value = chosen,
                None => break,
            }
        }
        value
    }
}

/// Returns the yield of a region if it is defined outside of it.
fn yielded_from_outside(region: &Region, index: u32) -> Option<Value> {
    let value = region.yields[index as usize];
    let mut inside = HashSet::new();
    region.for_each_op(&mut |op| inside.extend(op.results.iter()));
    (!inside.contains(&value)).then_some(value)
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, transformed};

    #[test]
    fn a_counter_counts_though_the_loop_may_be_left() {
        let text = "
            %x: f32 = load scratch:f@0
            %zero: i32 = constant 0 %one: i32 = constant 1 %ten: i32 = constant 10
            %false: bool = constant false
            %n: i32, %r: f32 = loop (%i: i32 = %zero, %y: f32 = %x) {
                %z: f32 = multiply %y, %y
                %done: bool = less %x, %z
                %next: i32 = add %i, %one
                %more: bool = less %next, %ten
                %kept: i32 = select %done, %i, %next
                %again: bool = select %done, %false, %more
                repeat %again, %kept, %z
            }
            return scratch:f@0 = %r";
        expect![[r#"
            %1: i32 = constant 0
            %2: i32 = constant 1
            %3: i32 = constant 10
            %4: bool = constant false
            %5: i32, %6: f32 = loop (%7: i32 = %1, %8: f32 = %0) {
              %9: f32 = multiply %8, %8
              %10: bool = less %0, %9
              %11: i32 = add %7, %2
              %12: bool = less %11, %3
              %13: i32 = select %10, %7, %11
              %14: bool = select %10, %4, %12
              repeat %14, %11, %9
            }
            return scratch:f@0 = %6
        "#]]
        .assert_eq(&transformed(text, super::run));
        let used = text.replace("%r\"", "%r").replace("return ", "return scratch:i@0 = %n, ");
        assert!(transformed(&used, super::run).contains("repeat %14, %13, %9"));
    }

    #[test]
    fn flags_become_constants_and_branches_are_followed() {
        let text = "
            %x: bool = load scratch:b@0 %y: bool = load scratch:b@1 %zero: i32 = constant 0
            %n: i32, %flag: bool = loop (%i: i32 = %zero, %f: bool = %x) {
                %stop: bool = or %f, %y
                %j: i32 = if %stop { %a: i32 = not %i yield %a } else { yield %zero }
                %again: bool = not %stop
                repeat %again, %j, %stop
            }
            return";
        expect![[r#"
            %0: bool = constant false
            %3: i32 = constant 0
            %4: i32, %5: bool = loop (%6: i32 = %3, %7: bool = %1) {
              %8: bool = or %7, %2
              %9: i32 = if %8 {
                %10: i32 = not %6
                yield %10
              } else {
                yield %3
              }
              %11: bool = not %8
              repeat %11, %3, %0
            }
            return
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
