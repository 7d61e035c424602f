//! Merging of rare branches: independent rare cases become one branch.
//!
//! A logarithm handles zero, infinity and NaN in a rarely taken branch. The logarithms of three colours have three such
//! branches, which prevent interleaving the computations: constants are loaded again for each, and every branch is a
//! test. So the branches become one:
//!
//! ```text
//! s = seldom(c)    x = if s { a } else { b }
//! t = seldom(d)    y = if t { e } else { f }
//!
//! u = seldom(c | d)    x, y = if u { select(c, a, b), select(d, e, f) } else { b, f }
//! ```
//!
//! Operations of the common case move before the branch, and operations that use the first result move after those that
//! the last condition needs. Only operations without effects are reordered; operations with effects are barriers.

use std::collections::HashMap;

use rtsl_ir::{BinaryOp, Effect, Function, Op, OpKind, Region, Scalar, UnaryOp, Value, Variable};

use crate::substitution::Substitution;

/// The greatest number of operations between a branch and the next merged with it: values that wait for it occupy
/// registers.
const MAX_DISTANCE: usize = 128;

/// Merges the rare branches of `function`.
pub fn run(function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    let (seldom, substitution) = Default::default();
    let mut joining = Joining { function, seldom, substitution };
    joining.region(&mut body);
    let substitution = joining.substitution;
    substitution.keep_names(&mut function.names);
    body.for_each_use_mut(&mut |value| *value = substitution.get(*value));
    function.body = body;
}

struct Joining<'a> {
    function: &'a mut Function,
    /// Conditions that are rarely true, and the bool that each equals.
    seldom: HashMap<Value, Value>,
    substitution: Substitution,
}

impl Joining<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        let mut free = Vec::new();
        for mut op in std::mem::take(&mut region.ops) {
            for region in op.kind.regions_mut() {
                self.region(region);
            }
            if let OpKind::Unary(UnaryOp::Seldom, condition) = op.kind {
                self.seldom.insert(op.results.get(0), condition);
            }
            if has_effect(&op, &self.function.variables) {
                self.join(std::mem::take(&mut free), &mut ops);
                ops.push(op);
            } else {
                free.push(op);
            }
        }
        self.join(free, &mut ops);
        region.ops = ops;
    }

    /// Merges branches among operations that may be reordered.
    fn join(&mut self, free: Vec<Op>, ops: &mut Vec<Op>) {
        let groups = self.groups(&free);
        if groups.is_empty() {
            return ops.extend(free);
        }
        let mut group_of: Vec<Option<usize>> = vec![None; free.len()];
        for (number, group) in groups.iter().enumerate() {
            group.iter().for_each(|index| group_of[*index] = Some(number));
        }
        let mut stages: Vec<Stage> = groups.iter().map(|_| Stage::default()).collect();
        stages.push(Stage::default());
        let mut depths = Depths::default();
        for (op, group) in free.into_iter().zip(group_of) {
            match group {
                Some(number) => {
                    depths.set(&op, number + 1);
                    stages[number].branches.push(op);
                }
                None => {
                    let depth = depths.of(&op);
                    depths.set(&op, depth);
                    stages[depth].others.push(op);
                }
            }
        }
        for stage in stages {
            ops.extend(stage.others);
            self.push_joined(stage.branches, ops);
        }
    }

    /// Returns the groups of branches to merge, by their indices: no group depends on a later one.
    fn groups(&self, free: &[Op]) -> Vec<Vec<usize>> {
        let mut levels: Vec<Vec<usize>> = Vec::new();
        let mut depths = Depths::default();
        for (index, op) in free.iter().enumerate() {
            let level = depths.of(op);
            let is_rare = self.is_rare(op);
            if is_rare {
                levels.resize_with(levels.len().max(level + 1), Vec::new);
                levels[level].push(index);
            }
            depths.set(op, level + usize::from(is_rare));
        }
        let is_near = |a: &usize, b: &usize| b - a <= MAX_DISTANCE;
        let groups = levels.iter().flat_map(|level| level.chunk_by(is_near));
        groups.filter(|group| group.len() > 1).map(<[usize]>::to_vec).collect()
    }

    /// True for a rare branch without branches or loops inside.
    fn is_rare(&self, op: &Op) -> bool {
        match &op.kind {
            OpKind::If { condition, then, otherwise } => {
                let mut inside = then.ops.iter().chain(&otherwise.ops);
                self.seldom.contains_key(condition)
                    && inside.all(|op| op.kind.regions().next().is_none())
            }
            _ => false,
        }
    }

    fn push_joined(&mut self, branches: Vec<Op>, ops: &mut Vec<Op>) {
        let mut any: Option<Value> = None;
        let (mut rare, mut usual) = (Region::default(), Region::default());
        let mut replaced = Vec::new();
        for op in branches {
            let OpKind::If { condition, then, otherwise } = op.kind else { continue };
            let condition = self.seldom[&condition];
            any = Some(match any {
                Some(any) => {
                    let kind = OpKind::Binary(BinaryOp::Or, any, condition);
                    self.function.push(ops, Scalar::Bool, kind)
                }
                None => condition,
            });
            ops.extend(otherwise.ops);
            rare.ops.extend(then.ops);
            for (a, b) in then.yields.into_iter().zip(&otherwise.yields) {
                let (scalar, kind) = (self.function.scalar(a), OpKind::Select(condition, a, *b));
                rare.yields.push(self.function.push(&mut rare.ops, scalar, kind));
            }
            usual.yields.extend(otherwise.yields);
            replaced.extend(op.results.iter());
        }
        let Some(any) = any else { return };
        let kind = OpKind::Unary(UnaryOp::Seldom, any);
        let condition = self.function.push(ops, Scalar::Bool, kind);
        let scalars: Vec<Scalar> =
            replaced.iter().map(|value| self.function.scalar(*value)).collect();
        let results = self.function.new_values(&scalars);
        for (old, new) in replaced.into_iter().zip(results.iter()) {
            self.substitution.set(old, new);
        }
        let kind = OpKind::If { condition, then: rare, otherwise: usual };
        ops.push(Op { results, precise: false, kind });
    }
}

/// The operations between one merged branch and the next, and those in the next.
#[derive(Default)]
struct Stage {
    others: Vec<Op>,
    branches: Vec<Op>,
}

/// For each value, the number of branches on the dependency path to it; 0 for values from elsewhere.
#[derive(Default)]
struct Depths {
    of: HashMap<Value, usize>,
}

impl Depths {
    /// Returns the greatest number of any operand, regions included.
    fn of(&self, op: &Op) -> usize {
        let mut greatest = 0;
        let mut visit = |value: Value| greatest = greatest.max(*self.of.get(&value).unwrap_or(&0));
        op.kind.for_each_operand(&mut visit);
        op.kind.regions().for_each(|region| region.for_each_use(&mut visit));
        greatest
    }

    fn set(&mut self, op: &Op, depth: usize) {
        for result in op.results.iter().filter(|_| depth > 0) {
            self.of.insert(result, depth);
        }
    }
}

/// True if an operation or its regions have effects or may not end.
fn has_effect(op: &Op, variables: &[Variable]) -> bool {
    match &op.kind {
        OpKind::If { then, otherwise, .. } => {
            then.ops.iter().chain(&otherwise.ops).any(|op| has_effect(op, variables))
        }
        OpKind::Loop { .. } => true,
        kind => kind.effect(variables) != Effect::None,
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use super::*;
    use crate::testing::{check_preserves, transformed};

    #[test]
    fn rare_branches_side_by_side_become_one() {
        let text = "
            %x: f32 = load scratch:f@0 %y: f32 = load scratch:f@1
            %0: f32 = constant 0 %1: f32 = constant 1
            %c: bool = less %x, %0 %s: bool = seldom %c
            %a: f32 = if %s { %n: f32 = negate %x yield %n } else { yield %x }
            %b: f32 = add %a, %1
            %d: bool = less %y, %0 %t: bool = seldom %d
            %e: f32 = if %t { yield %0 } else { yield %y }
            %f: f32 = add %e, %b
            return scratch:f@0 = %f, scratch:f@1 = %b";
        expect![[r#"
            %2: f32 = constant 0.0
            %3: f32 = constant 1.0
            %4: bool = less %0, %2
            %5: bool = seldom %4
            %6: bool = less %1, %2
            %7: bool = seldom %6
            %8: bool = or %4, %6
            %9: bool = seldom %8
            %10: f32, %11: f32 = if %9 {
              %12: f32 = negate %0
              %13: f32 = select %4, %12, %0
              %14: f32 = select %6, %2, %1
              yield %13, %14
            } else {
              yield %0, %1
            }
            %15: f32 = add %10, %3
            %16: f32 = add %11, %15
            return scratch:f@0 = %16, scratch:f@1 = %15
        "#]]
        .assert_eq(&transformed(text, run));
    }

    #[test]
    fn each_depth_has_its_own() {
        let text = "
            %x: f32 = load scratch:f@0 %y: f32 = load scratch:f@1 %0: f32 = constant 0
            %c: bool = less %x, %0 %s: bool = seldom %c
            %a: f32 = if %s { yield %0 } else { yield %x }
            %d: bool = greater %a, %y %t: bool = seldom %d
            %b: f32 = if %t { yield %0 } else { yield %a }
            %e: bool = less %y, %0 %u: bool = seldom %e
            %f: f32 = if %u { yield %0 } else { yield %y }
            %g: bool = greater %f, %x %v: bool = seldom %g
            %h: f32 = if %v { yield %0 } else { yield %f }
            return scratch:f@0 = %b, scratch:f@1 = %h";
        expect![[r#"
            %2: f32 = constant 0.0
            %3: bool = less %0, %2
            %4: bool = seldom %3
            %5: bool = less %1, %2
            %6: bool = seldom %5
            %7: bool = or %3, %5
            %8: bool = seldom %7
            %9: f32, %10: f32 = if %8 {
              %11: f32 = select %3, %2, %0
              %12: f32 = select %5, %2, %1
              yield %11, %12
            } else {
              yield %0, %1
            }
            %13: bool = greater %9, %1
            %14: bool = seldom %13
            %15: bool = greater %10, %0
            %16: bool = seldom %15
            %17: bool = or %13, %15
            %18: bool = seldom %17
            %19: f32, %20: f32 = if %18 {
              %21: f32 = select %13, %2, %9
              %22: f32 = select %15, %2, %10
              yield %21, %22
            } else {
              yield %9, %10
            }
            return scratch:f@0 = %19, scratch:f@1 = %20
        "#]]
        .assert_eq(&transformed(text, run));
    }

    #[test]
    fn dependent_branches_and_effects_keep_them_apart() {
        let text = "
            %x: f32 = load scratch:f@0 %y: f32 = load scratch:f@1 %0: f32 = constant 0
            %c: bool = less %x, %0 %s: bool = seldom %c
            %a: f32 = if %s { yield %0 } else { yield %x }
            %d: bool = greater %a, %y %t: bool = seldom %d
            %b: f32 = if %t { yield %0 } else { yield %a }
            store local:s@0, %b
            %e: bool = less %y, %0 %u: bool = seldom %e
            %f: f32 = if %u { yield %0 } else { yield %y }
            return scratch:f@0 = %b, scratch:f@1 = %f";
        let unchanged = transformed(text, |_| ());
        assert_eq!(transformed(text, run), unchanged);
    }

    /// Marks all conditions as rarely true.
    fn make_rare(function: &mut Function, region: &mut Region) {
        for mut op in std::mem::take(&mut region.ops) {
            for region in op.kind.regions_mut() {
                make_rare(function, region);
            }
            if let OpKind::If { condition, .. } = &mut op.kind {
                let kind = OpKind::Unary(UnaryOp::Seldom, *condition);
                *condition = function.push(&mut region.ops, Scalar::Bool, kind);
            }
            region.ops.push(op);
        }
    }

    #[test]
    fn keeps_results() {
        let joined = std::cell::Cell::new(0);
        check_preserves(|function| {
            let mut body = std::mem::take(&mut function.body);
            make_rare(function, &mut body);
            function.body = body;
            let before = function.values.len();
            run(function);
            joined.set(joined.get() + u32::from(function.values.len() > before));
        });
        assert!(joined.get() > 2, "joined in {} functions", joined.get());
    }
}
