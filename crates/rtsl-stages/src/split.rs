//! Splitting, step by step.

use std::collections::BTreeMap;

use rtsl_ir::{Function, Variable, VariableKind};
use rtsl_opt::unchanged::{self, VariableScalar};
use rtsl_opt::{complements, dce, gvn, mem2reg, simplify};

use crate::emit::{self, Draft, Plan, next_values};
use crate::live::{Kept, Live, Liveness};
use crate::points::{self, Level, Point, PointId};
use crate::slots::Slots;
use crate::verify::{self, VerifyError};
use crate::{
    Port, ResumedBy, SlotId, Stage, Stages, Surface, common_queries, late_loads, stored, undefined,
};

/// The greatest number of points where a function may suspend.
pub const MAX_POINTS: usize = 1024;

/// The greatest number of slots of a frame.
pub const MAX_SLOTS: usize = 4096;

/// The greatest number of operations of all stages together, before they are optimised.
pub const MAX_OPERATIONS: u32 = 1 << 20;

/// The greatest product of points and operations of a function, which bounds the time to find live values.
const MAX_USES: usize = 1 << 26;

/// The reason a function cannot be split.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SplitError {
    /// Paths that go on would have to store nothing.
    #[error("a function that accepts hits cannot be split")]
    Accepted,
    /// It has a variable whose name belongs to the interface of stages.
    #[error("scratch `{0}` has the name of a variable of stages")]
    Reserved(String),
    /// It has too many points.
    #[error(
        "a function may wait for the renderer at no more than {MAX_POINTS} places, and this one does at {0}"
    )]
    Points(usize),
    /// It keeps too many values.
    #[error("a suspended path may keep no more than {MAX_SLOTS} numbers, and this one keeps {0}")]
    Slots(usize),
    /// A stage is nested too deeply.
    #[error(
        "places that wait for the renderer follow each other in more than {} nested branches",
        rtsl_ir::MAX_NESTING
    )]
    Nesting,
    /// The stages are too large.
    #[error("the stages have more than {MAX_OPERATIONS} operations")]
    Operations,
    /// A fault of this crate: the stages are not as they must be.
    #[error("invalid stages: {0}")]
    Invalid(#[from] VerifyError),
}

/// Splits a verified function into stages, of which none waits for the renderer.
///
/// Contraction, budgets and weights of rays are settled before: for each path the stages compute the same results to
/// the bit (but for the bits of NaNs) as the function, and make the same requests in the same order.
pub fn split(function: &Function) -> Result<Stages, SplitError> {
    let _span = tracing::debug_span!("split", function = function.name).entered();
    check_variables(function)?;
    let mut function = function.clone();
    if common_queries::run(&mut function) {
        let passes: [rtsl_opt::Pass; 3] = [simplify::run, gvn::run, dce::run];
        passes.iter().for_each(|pass| pass(&mut function));
    }
    late_loads::run(&mut function);
    function.renumber();
    let mut plan = Plan::new(&function)?;
    let reached = reached_points(&plan)?;
    plan.lives.retain(|id, _| reached.contains(id));
    let slots = Slots::shared(&function, &plan.lives);
    if slots.slots.len() > MAX_SLOTS {
        return Err(SplitError::Slots(slots.slots.len()));
    }
    let stages = write(&plan, &slots, &reached)?;
    let stages = Stages { name: function.name.clone(), slots: slots.slots, stages };
    verify::verify(&stages)?;
    Ok(stages)
}

fn check_variables(function: &Function) -> Result<(), SplitError> {
    for variable in &function.variables {
        if variable.kind == VariableKind::Accepted {
            return Err(SplitError::Accepted);
        }
        let is_scratch = variable.kind == VariableKind::Scratch;
        let is_placeholder = is_scratch && variable.name.starts_with(undefined::PREFIX);
        if Port::of(variable).is_some() || is_placeholder {
            return Err(SplitError::Reserved(variable.name.clone()));
        }
    }
    Ok(())
}

impl<'a> Plan<'a> {
    fn new(function: &'a Function) -> Result<Plan<'a>, SplitError> {
        let (mut count, mut operations) = (0, 0);
        function.body.for_each_op(&mut |op| {
            count += usize::from(points::is_point(op));
            operations += 1;
        });
        if count > MAX_POINTS {
            return Err(SplitError::Points(count));
        }
        if count * operations > MAX_USES {
            return Err(SplitError::Operations);
        }
        let (points, scopes) = points::find(function);
        let liveness = Liveness::new(function, scopes);
        let lives = liveness.of_points(&points);
        let most = lives.values().map(|live| live.kept.len()).max().unwrap_or(0);
        if most > MAX_SLOTS {
            return Err(SplitError::Slots(most));
        }
        let start = vec![Level { region: &function.body, index: 0, number: 0 }];
        Ok(Plan { function, points, liveness, lives, start })
    }
}

/// Returns the points where some stage suspends, in the order in which stages lead to them.
///
/// Only a query about a surface that a stage does not know suspends, so the points follow from the stages. They are
/// written once for that, each value in a slot of its own. Only folding makes out some ways as impossible.
fn reached_points(plan: &Plan<'_>) -> Result<Vec<PointId>, SplitError> {
    let slots = Slots::separate(plan.function, &plan.lives);
    let indices = plan.points.keys().map(|id| (*id, id.0 as i32)).collect();
    let mut reached: Vec<PointId> = Vec::new();
    let mut next = None;
    let mut left = MAX_OPERATIONS;
    loop {
        let mut draft = emit::stage(plan, &slots, &indices, next, String::new(), left)?;
        left = draft.left;
        decide_branches(&mut draft.function);
        for index in next_values(&draft) {
            let id = u32::try_from(index).ok().map(rtsl_ir::Value);
            reached.extend(id.filter(|id| !reached.contains(id)));
        }
        let done = next.map_or(0, |id| 1 + reached.iter().position(|it| *it == id).unwrap_or(0));
        match reached.get(done) {
            Some(id) => next = Some(*id),
            None => return Ok(reached),
        }
    }
}

/// Removes ways that no path goes, so that both drafts of a stage lead to the same points.
fn decide_branches(function: &mut Function) {
    complements::run(function);
    simplify::run(function);
}

/// Writes the stages: the start, then those of the points.
fn write(plan: &Plan<'_>, slots: &Slots, points: &[PointId]) -> Result<Vec<Stage>, SplitError> {
    let (mut stages, drafts) = drafts(plan, slots, points)?;
    for draft in &drafts {
        if cfg!(debug_assertions)
            && let Err(message) = stored::check(draft, &stages)
        {
            panic!("{message}\n{}", draft.function);
        }
    }
    let functions: Vec<Function> = drafts.into_iter().map(|it| finished(it, &stages)).collect();
    for (stage, function) in stages.iter_mut().zip(functions) {
        stage.function = function;
        stage.settle_surface();
    }
    Ok(stages)
}

/// Returns the drafts of the stages, and the stages without their functions.
fn drafts(
    plan: &Plan<'_>,
    slots: &Slots,
    points: &[PointId],
) -> Result<(Vec<Stage>, Vec<Draft>), SplitError> {
    let name = |index: usize| format!("{}.{index}", plan.function.name);
    let indices: BTreeMap<PointId, i32> = points.iter().copied().zip(1..).collect();
    let mut drafts = Vec::with_capacity(points.len() + 1);
    let mut left = MAX_OPERATIONS;
    for (index, point) in [None].into_iter().chain(points.iter().copied().map(Some)).enumerate() {
        let draft = emit::stage(plan, slots, &indices, point, name(index), left)?;
        left = draft.left;
        drafts.push(draft);
    }
    let mut stages: Vec<Stage> = vec![stage(None, &Live::default(), slots, name(0))];
    stages.extend(
        points
            .iter()
            .zip(1..)
            .map(|(id, index)| stage(Some(&plan.points[id]), &plan.lives[id], slots, name(index))),
    );
    drafts.iter_mut().for_each(|draft| decide_branches(&mut draft.function));
    Ok((stages, drafts))
}

/// Returns a stage whose function has yet to be written.
fn stage(point: Option<&Point<'_>>, live: &Live, slots: &Slots, name: String) -> Stage {
    let mut kept: Vec<SlotId> = live.kept.iter().map(|kept: &Kept| slots.of(*kept)).collect();
    kept.sort_unstable();
    Stage {
        function: Function::new(name),
        resumed_by: point.map_or(ResumedBy::Start, |point| point.event),
        surface: point.and_then(|it| it.surface).map_or(Surface::None, |_| Surface::Request),
        live: kept,
    }
}

impl Stage {
    /// A search's answer is its stage's surface if the stage asks about it.
    fn settle_surface(&mut self) {
        let mut asks = false;
        self.function
            .body
            .for_each_op(&mut |op| asks |= points::queried_surface(&op.kind).is_some());
        if self.resumed_by == ResumedBy::NearestHit && asks {
            self.surface = Surface::Answer;
        }
    }
}

/// Optimises a draft by the passes that preserve results to the bit.
fn finished(mut draft: Draft, stages: &[Stage]) -> Function {
    let placeholders = undefined::mark(&mut draft, stages);
    let Draft { mut function, .. } = draft;
    // A run promotes as many locals as its limit lets it, and the next one others, once those are removed.
    for _ in 0..=draft.ports.len() / 256 {
        mem2reg::run(&mut function);
        dce::run(&mut function);
    }
    undefined::choose(&mut function, &placeholders);
    let passes: [rtsl_opt::Pass; 4] = [dce::run, simplify::run, gvn::run, simplify::run];
    passes.iter().for_each(|pass| pass(&mut function));
    let requests: Vec<VariableScalar> =
        unchanged::outputs(&function).filter(|(it, _)| is_request(it)).collect();
    unchanged::run(&mut function);
    let left: Vec<VariableScalar> = unchanged::outputs(&function).collect();
    unchanged::restore(&mut function, requests.iter().filter(|it| !left.contains(it)));
    dce::run(&mut function);
    function.renumber();
    function
}

/// True for a surface, which a stage may get by request and pass on: requests are stored even so.
fn is_request(variable: &Variable) -> bool {
    matches!(Port::of(variable), Some(Port::Surface(_)))
}

#[cfg(test)]
mod tests {
    use rtsl_ir::{Op, OpKind};

    use super::*;

    /// Keeps `x` in the frame where one of two branches suspends.
    const TEXT: &str = "function f state rt_HitDistance: f32[1] {
        %one: f32 = constant 1.0
        %x: f32 = rand
        %c: bool = less %x, %one
        %y: f32 = if %c {
            %o: bool = occluded %x, %x, %x, %x, %x, %x, %x
            %z: f32 = select %o, %x, %one
            yield %z
        } else { yield %x }
        %s: f32 = add %x, %y
        return state:rt_HitDistance@0 = %s }";

    /// A draft that does not store what is live is found, though its function is valid.
    #[test]
    fn missing_stores_are_found() {
        let function: Function = TEXT.parse().unwrap();
        let mut plan = Plan::new(&function).unwrap();
        let points = reached_points(&plan).unwrap();
        plan.lives.retain(|id, _| points.contains(id));
        let slots = Slots::shared(&function, &plan.lives);
        let (stages, mut drafts) = drafts(&plan, &slots, &points).unwrap();
        assert_eq!(stored::check(&drafts[0], &stages), Ok(()));
        let ports = drafts[0].ports.clone();
        let is_stored_slot = |op: &Op| match op.kind {
            OpKind::Store(local, ..) => matches!(ports.get(&local), Some(Port::Frame(_))),
            _ => false,
        };
        for op in &mut drafts[0].function.body.ops {
            let regions = op.kind.regions_mut();
            regions.for_each(|region| region.ops.retain(|op| !is_stored_slot(op)));
        }
        rtsl_ir::verify::verify(&drafts[0].function).unwrap();
        let message = stored::check(&drafts[0], &stages).unwrap_err();
        assert_eq!(message, "f.0 does not store slot 0, which is live in f.1");
    }
}
