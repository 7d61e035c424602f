//! Simplifies outputs for lanes that accept no hit.
//!
//! The outputs of a method that accepts hits are stored only in lanes that accept. In other lanes they may have any
//! value, so the selects that preserve the old value there, one for each condition on the way to the hit, are removed.

use std::collections::HashMap;

use rtsl_ir::{BinaryOp, Constant, UnaryOp, Value, VariableKind};

use crate::Kernel;
use crate::kernel::{Op, OpKind, Region};

/// Makes the outputs unspecified in lanes that accept no hit.
pub fn run(kernel: &mut Kernel) {
    let is_accepted = |variable| kernel.variable(variable).variable.kind == VariableKind::Accepted;
    let Some(accepted) = kernel.outputs.iter().position(|output| is_accepted(output.variable))
    else {
        return;
    };
    let mut body = std::mem::take(&mut kernel.body);
    let demanded: Vec<usize> = (0..body.yields.len()).filter(|at| *at != accepted).collect();
    let mut constants = HashMap::new();
    for op in &kernel.prologue.ops {
        if let OpKind::Constant(Constant::Bool(known)) = op.kind {
            constants.insert(op.results.get(0), known);
        }
    }
    relax(&mut body, accepted, &demanded, &constants);
    kernel.body = body;
}

/// Simplifies the yields `demanded` of a region, which matter only in lanes where the yield `accepted` is true.
fn relax(
    region: &mut Region,
    accepted: usize,
    demanded: &[usize],
    constants: &HashMap<Value, bool>,
) {
    let facts = Facts::new(region, region.yields[accepted], constants);
    let followed = demanded.iter().map(|at| facts.follow(region.yields[*at]));
    let followed: Vec<Value> = followed.collect();
    let inner = facts.branch();
    for (at, value) in demanded.iter().zip(followed) {
        region.yields[*at] = value;
    }
    remove_unused(region);
    if let Some((branch, accepted)) = inner {
        let yields: Vec<Value> = demanded.iter().map(|at| region.yields[*at]).collect();
        relax_branch(region, branch, accepted, &yields, constants);
    }
}

/// Likewise simplifies the results of a branch of `region`, which matter only in lanes where the branch's result
/// `accepted` is true, as far as only `yields` of the region use them.
fn relax_branch(
    region: &mut Region,
    branch: Value,
    accepted: usize,
    yields: &[Value],
    constants: &HashMap<Value, bool>,
) {
    let uses = Uses::of(region);
    let is_branch = |op: &&mut Op| op.results.count > 0 && op.results.get(0) == branch;
    let Some(op) = region.ops.iter_mut().find(is_branch) else { return };
    let only_yielded = |result: &Value| {
        let yielded = yields.iter().filter(|value| *value == result).count();
        yielded > 0 && uses.count(*result) == yielded
    };
    let results = op.results.iter().enumerate();
    let demanded: Vec<usize> = results
        .filter(|(at, result)| *at != accepted && only_yielded(result))
        .map(|(at, _)| at)
        .collect();
    if let OpKind::If { condition: _, then, otherwise } = &mut op.kind {
        relax(then, accepted, &demanded, constants);
        relax(otherwise, accepted, &demanded, constants);
    }
}

/// Known bools in the lanes that matter.
struct Facts<'a> {
    /// The operations of the region itself, by their results.
    defined: HashMap<Value, &'a Op>,
    truths: HashMap<Value, bool>,
}

impl<'a> Facts<'a> {
    fn new(region: &'a Region, accepted: Value, constants: &HashMap<Value, bool>) -> Self {
        let results = region.ops.iter().flat_map(|op| op.results.iter().map(move |it| (it, op)));
        let mut facts = Facts { defined: results.collect(), truths: HashMap::new() };
        let mut open = vec![(accepted, true)];
        // If two facts contradict each other no lane matters, and either may be used.
        while let Some((value, truth)) = open.pop() {
            if facts.truths.insert(value, truth).is_none() {
                facts.conclude(value, truth, constants, &mut open);
            }
        }
        facts
    }

    fn conclude(
        &self,
        value: Value,
        truth: bool,
        constants: &HashMap<Value, bool>,
        open: &mut Vec<(Value, bool)>,
    ) {
        let Some(op) = self.defined.get(&value) else { return };
        let is_other = |value: &Value| constants.get(value) == Some(&!truth);
        match &op.kind {
            OpKind::Unary(UnaryOp::Not, a) => open.push((*a, !truth)),
            OpKind::Binary(BinaryOp::And, a, b) if truth => open.extend([(*a, true), (*b, true)]),
            OpKind::Binary(BinaryOp::Or, a, b) if !truth => {
                open.extend([(*a, false), (*b, false)]);
            }
            OpKind::Select(condition, a, b) if is_other(a) => {
                open.extend([(*condition, false), (*b, truth)]);
            }
            OpKind::Select(condition, a, b) if is_other(b) => {
                open.extend([(*condition, true), (*a, truth)]);
            }
            _ => {}
        }
    }

    /// Returns the value that `value` equals in the lanes that matter, as far as selects determine it.
    fn follow(&self, mut value: Value) -> Value {
        while let Some(op) = self.defined.get(&value)
            && let OpKind::Select(condition, a, b) = &op.kind
            && let Some(truth) = self.truths.get(condition)
        {
            value = if *truth { *a } else { *b };
        }
        value
    }

    /// Returns a branch with a result that is true in the lanes that matter: the first of its results, and the index of
    /// that one.
    fn branch(&self) -> Option<(Value, usize)> {
        let results = self.truths.iter().filter(|(_, truth)| **truth).filter_map(|(value, _)| {
            let op = self.defined.get(value)?;
            let is_branch = matches!(op.kind, OpKind::If { .. });
            is_branch.then(|| (op.results.get(0), (value.0 - op.results.first) as usize))
        });
        results.min()
    }
}

/// The number of uses of values in a region and those nested in it.
pub(super) struct Uses(HashMap<Value, usize>);

impl Uses {
    pub(super) fn of(region: &Region) -> Uses {
        let mut uses = Uses(HashMap::new());
        uses.region(region);
        uses
    }

    fn region(&mut self, region: &Region) {
        for op in &region.ops {
            op.kind.for_each_operand(|operand| *self.0.entry(operand).or_default() += 1);
            op.kind.regions().for_each(|region| self.region(region));
        }
        region.yields.iter().for_each(|value| *self.0.entry(*value).or_default() += 1);
    }

    pub(super) fn count(&self, value: Value) -> usize {
        self.0.get(&value).copied().unwrap_or(0)
    }
}

/// Removes unused selects and their conditions.
pub(super) fn remove_unused(region: &mut Region) {
    let mut uses = Uses::of(region);
    let mut kept = Vec::with_capacity(region.ops.len());
    for op in std::mem::take(&mut region.ops).into_iter().rev() {
        let removable = matches!(
            op.kind,
            OpKind::Select(..)
                | OpKind::Compare(..)
                | OpKind::Unary(UnaryOp::Not, _)
                | OpKind::Binary(BinaryOp::And | BinaryOp::Or, ..)
        );
        if removable && op.results.iter().all(|result| uses.count(result) == 0) {
            op.kind.for_each_operand(|operand| {
                uses.0.entry(operand).and_modify(|count| *count -= 1);
            });
        } else {
            kept.push(op);
        }
    }
    kept.reverse();
    region.ops = kept;
}

#[cfg(test)]
mod tests {
    use expect_test::expect;
    use rtsl_ir::Function;

    use rtsl_abi::{CallMode, Layout};

    /// Lowers a function that offers a hit in a branch, with this end, and prints its body.
    fn lowered(end: &str) -> String {
        let text = format!(
            "function f state rt_HitDistance: f32[1] state rt_Epsilon: f32[1] accepted a: bool[1] {{
                %t: f32 = load state:rt_HitDistance@0 %x: f32 = load state:rt_Epsilon@0
                %false: bool = constant false %zero: f32 = constant 0.0
                %hits: bool = less %zero, %x
                %hit: bool, %d: f32 = if %hits {{
                    %a: f32 = sqrt %x %b: f32 = divide %t, %a %c: f32 = sqrt %b
                    %f: f32 = sqrt %c %g: f32 = sqrt %f %h: f32 = sqrt %g %e: f32 = sqrt %h
                    %near: bool = less %e, %t
                    %new: f32 = select %near, %e, %t
                    yield %near, %new
                }} else {{ yield %false, %t }}
                {end}
            }}"
        );
        let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}"));
        rtsl_ir::verify::verify(&function).unwrap_or_else(|error| panic!("{error}"));
        let kernel = crate::lower(&function, &Layout::default(), CallMode::Packet, 8).unwrap();
        let text = kernel.to_string();
        text[text.find("  chunk").unwrap()..].to_owned()
    }

    #[test]
    fn selects_of_old_values_go_on_every_level() {
        let text = lowered("return accepted:a@0 = %hit, state:rt_HitDistance@0 = %d");
        expect![[r#"
              chunk (%0: mask) {
                %1 = load rt_HitDistance[0] : f32xW
                %2 = load rt_Epsilon[0] : f32xW
                %5 = less %4, %2 : mask
                %6 = and %0, %5 : mask
                %7 = any %6 : bool
                %19, %20 = if %7 {
                  %8 = sqrt %2 : f32xW
                  %9 = divide %1, %8 : f32xW
                  %10 = sqrt %9 : f32xW
                  %11 = sqrt %10 : f32xW
                  %12 = sqrt %11 : f32xW
                  %13 = sqrt %12 : f32xW
                  %14 = sqrt %13 : f32xW
                  %15 = less %14, %1 : mask
                  %17 = and %5, %15 : mask
                  yield %17, %14
                } else {
                  yield %3, %1
                } : mask, f32xW
              }
              a[0] = %19
              rt_HitDistance[0] = %20
            }
        "#]]
        .assert_eq(&text);
    }

    #[test]
    fn values_that_are_used_otherwise_stay() {
        let text = lowered(
            "%far: bool = less %d, %x
            %both: bool = and %far, %hit
            return accepted:a@0 = %both, state:rt_HitDistance@0 = %d",
        );
        expect![[r#"
              chunk (%0: mask) {
                %1 = load rt_HitDistance[0] : f32xW
                %2 = load rt_Epsilon[0] : f32xW
                %5 = less %4, %2 : mask
                %6 = and %0, %5 : mask
                %7 = any %6 : bool
                %19, %20 = if %7 {
                  %8 = sqrt %2 : f32xW
                  %9 = divide %1, %8 : f32xW
                  %10 = sqrt %9 : f32xW
                  %11 = sqrt %10 : f32xW
                  %12 = sqrt %11 : f32xW
                  %13 = sqrt %12 : f32xW
                  %14 = sqrt %13 : f32xW
                  %15 = less %14, %1 : mask
                  %16 = select %15, %14, %1 : f32xW
                  %17 = and %5, %15 : mask
                  %18 = select %5, %16, %1 : f32xW
                  yield %17, %18
                } else {
                  yield %3, %1
                } : mask, f32xW
                %21 = less %20, %2 : mask
                %22 = and %21, %19 : mask
              }
              a[0] = %22
              rt_HitDistance[0] = %20
            }
        "#]]
        .assert_eq(&text);
    }
}
