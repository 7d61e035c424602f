//! Removal of what no linked stage and no host needs: slots, requests of paths that have ended, and outputs of the
//! integrator that its host does not read.
//!
//! The methods that are linked with stages do not read everything that an integrator keeps for them: the width of rays
//! matters to textures only. A slot is needed if a stage computes anything else from it than slots that are not
//! needed themselves.

use std::collections::BTreeSet;

use rtsl_ir::{Constant, Function, Op, OpKind, Output, Query, Region, Scalar, Value, VariableKind};
use rtsl_opt::{dce, dead_outputs};
use rtsl_stages::{Port, SlotId};

use crate::next_stages::NextStages;
use crate::stage::first_of;

/// Removes unread slots from the stages of an integrator, linked for all surfaces of a scene, and other outputs that no
/// one needs, those of the integrator with `unread` names among them. Each function comes with the index of its stage.
///
/// No one reads the requests of paths that wait for the stages `answered`.
pub fn remove(
    functions: &mut [(usize, &mut Function)],
    unread: &BTreeSet<&str>,
    answered: &BTreeSet<i32>,
) {
    functions.iter_mut().for_each(|(_, function)| forget_unread_widths(function));
    let forget = |(_, function): &mut (usize, &mut Function)| {
        forget_needless_outputs(function, unread, answered);
    };
    functions.iter_mut().for_each(forget);
    let stages = functions.iter().map(|(stage, _)| stage + 1).max().unwrap_or(0);
    let next: Vec<NextStages> =
        functions.iter().map(|(_, function)| NextStages::of(function)).collect();
    // By stage, the slots whose values are needed when it begins.
    let mut needed = vec![BTreeSet::new(); stages];
    loop {
        let known: usize = needed.iter().map(BTreeSet::len).sum();
        for ((stage, function), next) in functions.iter().zip(&next) {
            let mut reduced = Function::clone(function);
            let later = slots_of(next, &needed);
            keep(&mut reduced, &later);
            let stored = stored_slots(function);
            needed[*stage].extend(loaded_slots(&reduced));
            // The stage leaves the others as they are.
            needed[*stage].extend(later.difference(&stored));
        }
        if needed.iter().map(BTreeSet::len).sum::<usize>() == known {
            break;
        }
    }
    for ((_, function), next) in functions.iter_mut().zip(&next) {
        keep(function, &slots_of(next, &needed));
        function.renumber();
    }
}

/// Returns the slots that the stages after a function need.
fn slots_of(next: &NextStages, needed: &[BTreeSet<SlotId>]) -> BTreeSet<SlotId> {
    let is_next = |stage: usize| match next {
        NextStages::Any => true,
        NextStages::Of(stages) => stages.contains(&stage),
    };
    let stages = needed.iter().enumerate().filter(|(stage, _)| is_next(*stage));
    stages.flat_map(|(_, slots)| slots).copied().collect()
}

/// Removes the requests of a stage after which all paths have ended or wait for stages that are `answered`, and outputs
/// with `unread` names.
fn forget_needless_outputs(
    function: &mut Function,
    unread: &BTreeSet<&str>,
    answered: &BTreeSet<i32>,
) {
    let next = NextStages::of(function);
    let ends = next.is_among(&BTreeSet::new());
    let is_answered = next.is_among(answered);
    let outputs = || function.outputs.iter().zip(&function.body.yields);
    let is_needed = |output: &Output| {
        let variable = function.variable(output.variable);
        match Port::of(variable) {
            Some(Port::Request(_)) => !ends && !is_answered,
            Some(Port::Surface(_)) => !ends,
            Some(_) => true,
            None => variable.kind != VariableKind::Scratch || !unread.contains(&*variable.name),
        }
    };
    let read: Vec<bool> = outputs().map(|(output, _)| is_needed(output)).collect();
    dead_outputs::run(function, &read);
    dce::run(function);
}

/// Removes outputs to other slots than these.
fn keep(function: &mut Function, needed: &BTreeSet<SlotId>) {
    let outputs = function.outputs.iter();
    let is_needed = |port| !matches!(port, Some(Port::Frame(slot)) if !needed.contains(&slot));
    let read: Vec<bool> =
        outputs.map(|output| is_needed(Port::of(function.variable(output.variable)))).collect();
    dead_outputs::run(function, &read);
    dce::run(function);
}

fn stored_slots(function: &Function) -> BTreeSet<SlotId> {
    let ports = function.outputs.iter().map(|output| Port::of(function.variable(output.variable)));
    let slots = ports.filter_map(|port| match port {
        Some(Port::Frame(slot)) => Some(slot),
        _ => None,
    });
    slots.collect()
}

fn loaded_slots(function: &Function) -> BTreeSet<SlotId> {
    let mut slots = BTreeSet::new();
    function.body.for_each_op(&mut |op| {
        if let OpKind::Load(variable, _) = op.kind
            && let Some(Port::Frame(slot)) = Port::of(function.variable(variable))
        {
            slots.insert(slot);
        }
    });
    slots
}

/// Replaces the width of rays by 0 in queries for properties of surfaces whose footprints no one reads.
fn forget_unread_widths(function: &mut Function) {
    let mut used: BTreeSet<Value> = BTreeSet::new();
    function.body.for_each_use(&mut |value| {
        used.insert(value);
    });
    let mut ops = Vec::new();
    let zero = function.push(&mut ops, Scalar::F32, OpKind::Constant(Constant::F32(0.0)));
    let query = Query::SurfaceProperties;
    let [width, spread] = ["width", "spread"].map(|name| first_of(query.operands(), name));
    let footprint = ["du", "dv"].map(|name| first_of(query.results(), name) as u32);
    let mut body = std::mem::take(&mut function.body);
    let mut forget = |op: &mut Op| {
        let OpKind::Query(Query::SurfaceProperties, operands) = &mut op.kind else { return };
        if !footprint.iter().any(|index| used.contains(&op.results.get(*index))) {
            (operands[width], operands[spread]) = (zero, zero);
        }
    };
    for_each_op_mut(&mut body, &mut forget);
    ops.append(&mut body.ops);
    body.ops = ops;
    function.body = body;
}

fn for_each_op_mut(region: &mut Region, visit: &mut impl FnMut(&mut Op)) {
    for op in &mut region.ops {
        visit(op);
        op.kind.regions_mut().for_each(|region| for_each_op_mut(region, visit));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn function(text: &str) -> Function {
        text.parse().unwrap_or_else(|error| panic!("{error}\n{text}"))
    }

    /// Returns the names of the variables that a function stores.
    fn stored(function: &Function) -> Vec<&str> {
        let outputs = function.outputs.iter();
        outputs.map(|output| function.variable(output.variable).name.as_str()).collect()
    }

    /// The second stage reads slot 0, and leaves slot 2 to the third; what it computes of slot 3 is for slot 3 alone,
    /// and slot 1 is for an output that the host does not read.
    #[test]
    fn slots_are_kept_for_the_stages_that_read_them() {
        let mut stages = [
            "function f.0 scratch frame.0: f32[1] scratch frame.1: f32[1] scratch frame.2: f32[1]
            scratch frame.3: f32[1] scratch next: i32[1] state rt_HitDistance: f32[1] {
                %x: f32 = load state:rt_HitDistance@0 %n: i32 = constant 1
                return scratch:frame.0@0 = %x, scratch:frame.1@0 = %x, scratch:frame.2@0 = %x,
                    scratch:frame.3@0 = %x, scratch:next@0 = %n
            }",
            "function f.1 scratch frame.0: f32[1] scratch frame.3: f32[1] scratch request.0: f32[1]
            scratch next: i32[1] {
                %x: f32 = load scratch:frame.0@0 %y: f32 = load scratch:frame.3@0
                %z: f32 = add %y, %y %zero: f32 = constant 0.0 %again: bool = less %x, %zero
                %one: i32 = constant 1 %two: i32 = constant 2 %n: i32 = select %again, %one, %two
                return scratch:frame.3@0 = %z, scratch:request.0@0 = %x, scratch:next@0 = %n
            }",
            "function f.2 scratch frame.1: f32[1] scratch frame.2: f32[1] scratch next: i32[1]
            scratch read: f32[1] scratch unread: f32[1] state rt_HitDistance: f32[1] {
                %x: f32 = load scratch:frame.2@0 %y: f32 = load scratch:frame.1@0 %n: i32 = constant -1
                return state:rt_HitDistance@0 = %x, scratch:next@0 = %n, scratch:read@0 = %x,
                    scratch:unread@0 = %y
            }",
        ]
        .map(function);
        remove(
            &mut stages.iter_mut().enumerate().collect::<Vec<_>>(),
            &BTreeSet::from(["unread"]),
            &BTreeSet::new(),
        );
        assert_eq!(stored(&stages[0]), ["frame.0", "frame.2", "next"]);
        assert_eq!(stored(&stages[1]), ["request.0", "next"]);
        assert_eq!(stored(&stages[2]), ["rt_HitDistance", "next", "read"]);
    }

    /// Paths have ended after the first stage, so no one reads its request; the second stage goes on.
    #[test]
    fn requests_of_ended_paths_are_not_stored() {
        let stage = |next: &str| {
            function(&format!(
                "function f scratch request.0: f32[1] scratch next: i32[1] state rt_HitDistance: f32[1] {{
                    %x: f32 = load state:rt_HitDistance@0 %n: i32 = constant {next}
                    return scratch:request.0@0 = %x, scratch:next@0 = %n
                }}"
            ))
        };
        let none = BTreeSet::new();
        let mut ended = stage("-1");
        forget_needless_outputs(&mut ended, &BTreeSet::new(), &none);
        assert_eq!(stored(&ended), ["next"]);
        let mut goes_on = stage("1");
        let all = stored(&goes_on).len();
        forget_needless_outputs(&mut goes_on, &BTreeSet::new(), &none);
        assert_eq!(stored(&goes_on).len(), all);
        let mut answered = stage("1");
        forget_needless_outputs(&mut answered, &BTreeSet::new(), &BTreeSet::from([1]));
        assert_eq!(stored(&answered).len(), all - 1);
        assert!(!stored(&answered).contains(&"request.0"));
    }
}
