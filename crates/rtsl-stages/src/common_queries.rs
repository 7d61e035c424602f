//! Makes one query of two that both branches of an `if` begin with, so that a path waits at one place instead of two.
//!
//! A stage has all that follows the place where a path waits. An integrator whose loop begins with the first search or
//! a further one would else have everything twice.
//!
//! The `if` becomes two. The first yields the operands of the query, and the values that a branch uses after it; the
//! other branch yields a placeholder for those. The second has the rest of the branches.

use std::collections::BTreeSet;

use rtsl_ir::{Constant, Function, Op, OpKind, Query, Region, Value, Values};

use crate::choices;

/// Merges the common queries of the branches of a function. Returns true if there are any.
pub(crate) fn run(function: &mut Function) -> bool {
    let mut body = std::mem::take(&mut function.body);
    let mut merging = Merging { function, placeholders: BTreeSet::new(), has_merged: false };
    merging.region(&mut body);
    let Merging { placeholders, has_merged, .. } = merging;
    if has_merged {
        choices::merge(&mut body, &placeholders);
    }
    function.body = body;
    has_merged
}

struct Merging<'a> {
    function: &'a mut Function,
    /// Constants that no one uses.
    placeholders: BTreeSet<Value>,
    has_merged: bool,
}

/// A branch that begins with a query.
struct Branch {
    region: Region,
    /// The index of the query among the region's operations.
    at: usize,
    query: Query,
    operands: Vec<Value>,
    /// The values defined before the query that are used after it.
    kept: Vec<Value>,
}

/// The results of the operations before the rest of an `if`.
struct Before {
    /// Those of the first `if`: the operands of the query, and what each branch keeps.
    chosen: Values,
    /// Those of the query.
    answers: Values,
    kept: [Vec<Value>; 2],
    first_kept: [u32; 2],
}

impl Merging<'_> {
    fn region(&mut self, region: &mut Region) {
        for mut op in std::mem::take(&mut region.ops) {
            op.kind.regions_mut().for_each(|inner| self.region(inner));
            let rest = self.divide(op, &mut region.ops);
            region.ops.push(rest);
        }
    }

    /// Divides an operation as often as both of its branches begin with a query; returns the rest.
    fn divide(&mut self, op: Op, to: &mut Vec<Op>) -> Op {
        let OpKind::If { condition, then, otherwise } = op.kind else { return op };
        let choice = |[then, otherwise]: [Region; 2]| OpKind::If { condition, then, otherwise };
        match (Branch::of(then), Branch::of(otherwise)) {
            (Ok(then), Ok(otherwise)) if then.query == otherwise.query => {
                let query = then.query;
                let before = self.results_before([&then, &otherwise]);
                let (then, then_rest) = self.divide_branch(then, 0, &before);
                let (otherwise, otherwise_rest) = self.divide_branch(otherwise, 1, &before);
                let Before { chosen, answers, first_kept: [operands, _], .. } = before;
                let operands = chosen.iter().take(operands as usize).collect();
                let made = |results, kind| Op { results, precise: false, kind };
                to.push(made(chosen, choice([then, otherwise])));
                to.push(made(answers, OpKind::Query(query, operands)));
                self.has_merged = true;
                self.divide(Op { kind: choice([then_rest, otherwise_rest]), ..op }, to)
            }
            (then, otherwise) => {
                let region =
                    |branch: Result<Branch, Region>| branch.map_or_else(|it| it, |it| it.region);
                Op { kind: choice([region(then), region(otherwise)]), ..op }
            }
        }
    }

    fn results_before(&mut self, branches: [&Branch; 2]) -> Before {
        let kept = branches.map(|branch| branch.kept.clone());
        let passed = branches[0].operands.iter().chain(kept.iter().flatten());
        let passed: Vec<_> = passed.map(|value| self.function.scalar(*value)).collect();
        let answers: Vec<_> = branches[0].query.result_scalars().collect();
        let operands = branches[0].operands.len() as u32;
        Before {
            chosen: self.function.new_values(&passed),
            answers: self.function.new_values(&answers),
            first_kept: [operands, operands + kept[0].len() as u32],
            kept,
        }
    }

    /// Divides a branch at its query.
    fn divide_branch(&mut self, branch: Branch, own: usize, before: &Before) -> (Region, Region) {
        let Branch { mut region, at, operands, .. } = branch;
        let mut rest = region.ops.split_off(at);
        let asked = rest.remove(0).results;
        let mut rest = Region { ops: rest, yields: region.yields, ..Region::default() };
        region.yields = operands;
        for (branch, values) in before.kept.iter().enumerate() {
            for value in values {
                let is_own = branch == own;
                let value = if is_own { *value } else { self.placeholder(*value, &mut region) };
                region.yields.push(value);
            }
        }
        rest.for_each_use_mut(&mut |value| {
            if let Some(index) = asked.iter().position(|it| it == *value) {
                *value = before.answers.get(index as u32);
            } else if let Some(index) = before.kept[own].iter().position(|it| it == value) {
                *value = before.chosen.get(before.first_kept[own] + index as u32);
            }
        });
        (region, rest)
    }

    /// Adds a placeholder for a value.
    fn placeholder(&mut self, value: Value, region: &mut Region) -> Value {
        let scalar = self.function.scalar(value);
        let zero = OpKind::Constant(Constant::zero(scalar));
        let placeholder = self.function.push(&mut region.ops, scalar, zero);
        self.placeholders.insert(placeholder);
        placeholder
    }
}

impl Branch {
    /// Finds the first query of a branch; returns the branch unchanged if a nested region may ask one before.
    fn of(region: Region) -> Result<Branch, Region> {
        let asks = |op: &Op| {
            let is_query = matches!(op.kind, OpKind::Query(..));
            is_query || op.kind.regions().any(|region| region.asks(|_| true))
        };
        let Some(at) = region.ops.iter().position(asks) else { return Err(region) };
        let OpKind::Query(query, operands) = &region.ops[at].kind else { return Err(region) };
        let (query, operands) = (*query, operands.clone());
        let before = region.ops[..at].iter().flat_map(|op| op.results.iter());
        let used = used_after(&region, at);
        let kept = before.filter(|value| used.contains(value)).collect();
        Ok(Branch { region, at, query, operands, kept })
    }
}

/// Returns the values that a region uses after an operation.
fn used_after(region: &Region, at: usize) -> BTreeSet<Value> {
    let mut used: BTreeSet<Value> = region.yields.iter().copied().collect();
    for op in &region.ops[at + 1..] {
        op.kind.for_each_operand(|value| {
            used.insert(value);
        });
        for region in op.kind.regions() {
            region.for_each_use(&mut |value| {
                used.insert(value);
            });
        }
    }
    used
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use super::*;

    fn merged(text: &str) -> String {
        let mut function: Function = text.parse().unwrap_or_else(|error| panic!("{error}\n{text}"));
        run(&mut function);
        function.renumber();
        rtsl_ir::verify::verify(&function).unwrap_or_else(|error| panic!("{error:?}\n{function}"));
        function.to_string()
    }

    #[test]
    fn branches_share_the_query_that_both_begin_with() {
        let text = "function f scratch out: f32[1] {
            %c: bool = constant true %x: f32 = constant 1.0 %i: i32 = constant 2
            %r: f32 = if %c {
                %y: f32 = add %x, %x
                %a: f32 = query sample %i
                %s: f32 = add %a, %y
                yield %s
            } else {
                %j: i32 = add %i, %i
                %b: f32 = query sample %j
                yield %b
            }
            return scratch:out@0 = %r
        }";
        expect![[r#"
            function f
            scratch out: f32[1]
            {
              %0: bool = constant true
              %1: f32 = constant 1.0
              %2: i32 = constant 2
              %3: i32, %4: f32 = if %0 {
                %5: f32 = add %1, %1
                yield %2, %5
              } else {
                %6: i32 = add %2, %2
                %7: f32 = constant 0.0
                yield %6, %7
              }
              %8: f32 = query sample %3
              %9: f32 = if %0 {
                %10: f32 = add %8, %4
                yield %10
              } else {
                yield %8
              }
              return scratch:out@0 = %9
            }
        "#]]
        .assert_eq(&merged(text));
    }

    /// Kept values are operands of the query, or take the place of one that the other branch has anyway.
    #[test]
    fn kept_values_share_results() {
        let text = "function f scratch out: f32[2] {
            %c: bool = constant true %i: i32 = constant 2 %x: f32 = constant 1.0
            %r: f32, %s: f32 = if %c {
                %a: f32 = query sample %i
                %p: f32, %q: f32 = query sample_pair %i
                yield %a, %x
            } else {
                %j: i32 = add %i, %i
                %y: f32 = add %x, %x
                %b: f32 = query sample %j
                %u: f32, %v: f32 = query sample_pair %j
                yield %b, %y
            }
            return scratch:out@0 = %r, scratch:out@1 = %s
        }";
        expect![[r#"
            function f
            scratch out: f32[2]
            {
              %0: bool = constant true
              %1: i32 = constant 2
              %2: f32 = constant 1.0
              %3: i32, %4: i32, %5: f32 = if %0 {
                %6: i32 = constant 0
                %7: f32 = constant 0.0
                yield %1, %6, %2
              } else {
                %8: i32 = add %1, %1
                %9: f32 = add %2, %2
                yield %8, %8, %9
              }
              %10: f32 = query sample %3
              %11: i32 = if %0 {
                yield %1
              } else {
                yield %3
              }
              %12: f32, %13: f32 = query sample_pair %3
              %14: f32, %15: f32 = if %0 {
                yield %10, %2
              } else {
                yield %10, %5
              }
              return scratch:out@0 = %14, scratch:out@1 = %5
            }
        "#]]
        .assert_eq(&merged(text));
    }

    #[test]
    fn other_branches_stay() {
        for text in [
            "%r: f32 = if %c { %a: f32 = query sample %i yield %a } else { yield %x }",
            "%r: f32 = if %c { %a: f32 = query sample %i yield %a } else {
                %p: f32, %q: f32 = query sample_pair %i yield %p
            }",
            "%r: f32 = if %c { %a: f32 = query sample %i yield %a } else {
                %e: f32 = if %c { %b: f32 = query sample %i yield %b } else { yield %x }
                %d: f32 = query sample %i yield %d
            }",
        ] {
            let text = format!(
                "function f scratch out: f32[1] {{ %c: bool = constant true %x: f32 = constant 1.0
                %i: i32 = constant 2 {text} return scratch:out@0 = %r }}"
            );
            let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}\n{text}"));
            assert_eq!(merged(&text), function.to_string());
        }
    }
}
