//! If-conversion: replaces a short `if` without effects by its operations and a select for each result.
//!
//! Both regions must consist of operations without effects and regions, with a cost of at most [`MAX_COST`] together,
//! plus one for each result. Inner `if`s are converted first, so that their operations and selects count. A condition
//! marked as rarely true keeps its branch.

use std::collections::HashSet;

use rtsl_ir::{
    BinaryOp, Effect, Function, Index, Op, OpKind, Region, UnaryOp, Value, Values, Variable,
};

/// The cost of both regions, in simple operations, up to which a branch is more expensive.
pub const MAX_COST: u32 = 8;

/// Converts the short `if`s of `function`.
pub fn run(function: &mut Function) {
    let mut body = std::mem::take(&mut function.body);
    Conversion { variables: &function.variables, seldom: HashSet::new() }.region(&mut body);
    function.body = body;
}

struct Conversion<'a> {
    variables: &'a [Variable],
    /// Conditions that are rarely true.
    seldom: HashSet<Value>,
}

impl Conversion<'_> {
    fn region(&mut self, region: &mut Region) {
        let mut ops = Vec::with_capacity(region.ops.len());
        for mut op in std::mem::take(&mut region.ops) {
            for region in op.kind.regions_mut() {
                self.region(region);
            }
            match op.kind {
                OpKind::Unary(UnaryOp::Seldom, _) => {
                    self.seldom.insert(op.results.get(0));
                    ops.push(op);
                }
                OpKind::If { condition, then, otherwise }
                    if !self.seldom.contains(&condition) && self.is_short(&then, &otherwise) =>
                {
                    ops.extend(then.ops);
                    ops.extend(otherwise.ops);
                    let pairs = then.yields.into_iter().zip(otherwise.yields);
                    for (result, (a, b)) in op.results.iter().zip(pairs) {
                        ops.push(select(result, condition, a, b));
                    }
                }
                _ => ops.push(op),
            }
        }
        region.ops = ops;
    }

    fn is_short(&self, then: &Region, otherwise: &Region) -> bool {
        let mut total = then.yields.len() as u32;
        for op in then.ops.iter().chain(&otherwise.ops) {
            let Some(cost) = cost(&op.kind, self.variables) else { return false };
            total += cost;
            if total > MAX_COST {
                return false;
            }
        }
        total <= MAX_COST
    }
}

fn select(result: Value, condition: Value, a: Value, b: Value) -> Op {
    let results = Values { first: result.0, count: 1 };
    Op { results, precise: false, kind: OpKind::Select(condition, a, b) }
}

/// Returns the cost in simple operations; `None` if the operation must not be speculated or is expensive.
fn cost(kind: &OpKind, variables: &[Variable]) -> Option<u32> {
    if kind.effect(variables) != Effect::None {
        return None;
    }
    match kind {
        OpKind::Constant(_) => Some(0),
        OpKind::Unary(
            UnaryOp::ApproximateReciprocal
            | UnaryOp::ApproximateInverseSqrt
            | UnaryOp::ApproximateSqrt,
            _,
        ) => Some(4),
        OpKind::Unary(UnaryOp::Sqrt, _)
        | OpKind::Binary(BinaryOp::Divide | BinaryOp::Remainder, ..) => Some(6),
        OpKind::Unary(..)
        | OpKind::Binary(..)
        | OpKind::Compare(..)
        | OpKind::Select(..)
        | OpKind::Fma(..)
        | OpKind::Convert(..)
        | OpKind::Bitcast(..) => Some(1),
        OpKind::Load(_, Index::Constant(_)) | OpKind::Length(_) | OpKind::LightCount => Some(1),
        OpKind::Load(_, Index::Dynamic(_)) => Some(6),
        OpKind::Ambient
        | OpKind::If { .. }
        | OpKind::Loop { .. }
        | OpKind::IsSet(..)
        | OpKind::ReferenceCount(_) => None,
        OpKind::Store(..)
        | OpKind::Trace { .. }
        | OpKind::Occluded { .. }
        | OpKind::LightSample { .. }
        | OpKind::Rand
        | OpKind::Query(..)
        | OpKind::Seed(_)
        | OpKind::Derivative(..)
        | OpKind::ChainRule(..)
        | OpKind::ReferenceCall(_)
        | OpKind::Report(..)
        | OpKind::ReportBudget => None,
    }
}

#[cfg(test)]
mod tests {
    use expect_test::expect;

    use crate::testing::{check_preserves, transformed};

    #[test]
    fn short_regions_are_selected_from_inside_out() {
        let text = "
            %c: bool = load scratch:b@0 %d: bool = load scratch:b@1 %x: f32 = load scratch:f@0
            %r: f32 = if %c {
                %s: f32 = if %d { %a: f32 = negate %x yield %a } else { yield %x }
                yield %s
            } else { %b: f32 = abs %x yield %b }
            return scratch:f@0 = %r";
        expect![[r#"
            %3: f32 = negate %2
            %4: f32 = select %1, %3, %2
            %5: f32 = abs %2
            %6: f32 = select %0, %4, %5
            return scratch:f@0 = %6
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn effects_and_long_regions_stay() {
        let text = "
            %c: bool = load scratch:b@0 %x: f32 = load scratch:f@0
            if %c { store local:s@0, %x yield } else { yield }
            %r: f32 = if %c {
                %a: f32 = sqrt %x %b: f32 = sqrt %a yield %b
            } else { yield %x }
            return scratch:f@0 = %r";
        expect![[r#"
            if %0 {
              store local:s@0, %1
              yield
            } else {
              yield
            }
            %2: f32 = if %0 {
              %3: f32 = sqrt %1
              %4: f32 = sqrt %3
              yield %4
            } else {
              yield %1
            }
            return scratch:f@0 = %2
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn seldom_true_stays_a_branch() {
        let text = "
            %c: bool = load scratch:b@0 %x: f32 = load scratch:f@0 %s: bool = seldom %c
            %r: f32 = if %s { %a: f32 = abs %x yield %a } else { yield %x }
            return scratch:f@0 = %r";
        expect![[r#"
            %2: bool = seldom %0
            %3: f32 = if %2 {
              %4: f32 = abs %1
              yield %4
            } else {
              yield %1
            }
            return scratch:f@0 = %3
        "#]]
        .assert_eq(&transformed(text, super::run));
    }

    #[test]
    fn keeps_results() {
        check_preserves(super::run);
    }
}
