//! The choice of the requests that are deferred, and what takes their place.

use std::collections::{BTreeSet, HashMap};

use rtsl_ir::{Effect, Function, IndexVec, Op, OpKind, Query, Scalar, Value, Values, VariableKind};
use rtsl_spec::COLOR_COMPONENTS;

use super::factors::Factor;
use super::flow::{Event, Flow, Gap, is_quiet_call};
use super::placing::{Placed, Wanted, place};
use super::reason::{Kept, Reason, Refusal, Request};
use super::spread::{Scope, Spreading};

/// The output that light is added to.
const COLOR: &str = "rt_SampleColor";

/// A change of an operation.
pub(super) enum Edit {
    /// A traced ray is removed; another operation takes its place.
    Spawned,
    /// The operation is among those that are inserted earlier.
    Moved,
    /// A call of `shade` becomes one of its own part, with these weights.
    OwnShade(Vec<Value>),
    /// A light sample becomes one that nothing blocks, with these results.
    Unshadowed(Values),
    /// A branch that is executed for a light contributes what it adds.
    Contributing(Contribution),
}

/// The contribution of a branch for a light.
pub(super) struct Contribution {
    /// The point, the direction of the light, and the limit.
    pub ray: [Value; 7],
    pub sums: Vec<Addend>,
}

/// A result of a branch that is what the other side yields, plus light.
pub(super) struct Addend {
    /// The index of the result.
    pub position: usize,
    /// The value that the other side yields.
    pub sum: Value,
    /// The component of the colour that it reaches and the factor by which it does, unless that is 1; `None` if it
    /// reaches none.
    pub reached: Option<(u32, Option<Value>)>,
}

/// The changes of a function.
pub(super) struct Plan {
    /// By the number of the operation in the order of the text.
    pub edits: HashMap<u32, Edit>,
    /// Operations that are added, in order.
    pub insertions: HashMap<Gap, Vec<Op>>,
    /// The types of the function's values and of those that are added.
    pub types: Vec<Scalar>,
    /// For each value of the function, true if it depends on what is deferred.
    pub depends: IndexVec<Value, bool>,
    pub deferred: Vec<Request>,
    pub kept: Vec<Kept>,
}

impl Plan {
    pub fn of(function: &Function) -> Plan {
        let flow = Flow::of(function);
        let count = function.values.len();
        let mut planning = Planning {
            spreading: Spreading::new(flow),
            plan: Plan {
                edits: HashMap::new(),
                insertions: HashMap::new(),
                types: function.values.clone(),
                depends: IndexVec::filled(count, false),
                deferred: Vec::new(),
                kept: Vec::new(),
            },
            used: IndexVec::filled(count, false),
        };
        for number in 0..planning.spreading.flow.nodes.len() as u32 {
            planning.request(number);
        }
        planning.plan
    }
}

struct Planning<'f> {
    spreading: Spreading<'f>,
    plan: Plan,
    /// For each value, true if a factor depends on it.
    used: IndexVec<Value, bool>,
}

/// The ways of values to the colour.
#[derive(Default)]
struct Reached {
    /// For each value, the component of the colour and the factor; `None` if it does not reach it.
    factors: Vec<Option<(u32, Factor)>>,
    /// The values that depend on them.
    values: BTreeSet<Value>,
}

impl Planning<'_> {
    fn request(&mut self, number: u32) {
        let op = self.spreading.flow.node(number).op;
        let (request, outcome) = match op.kind {
            OpKind::Trace { .. } => (Request::Trace, self.trace(number, op)),
            OpKind::Query(Query::Shade, _) => (Request::Shade, self.shade(number, op)),
            OpKind::LightSample { .. } => (Request::Light, self.light(number, op)),
            _ => return,
        };
        let Err(Refusal { reason, at }) = outcome else {
            return self.plan.deferred.push(request);
        };
        let place = |value| self.spreading.flow.function.names.place(value);
        let (place, cause) = (place(op.results.get(0)), at.and_then(place));
        self.plan.kept.push(Kept { request, reason, place, cause });
    }

    fn trace(&mut self, number: u32, op: &Op) -> Result<(), Refusal> {
        let OpKind::Trace { origin, direction, limit, weight: _ } = op.kind else { return Ok(()) };
        let reached = self.components(number, op.results)?;
        let factors = factors_of(&reached);
        if factors.iter().any(|factor| *factor != Factor::Zero) {
            let gap = self.spreading.flow.node(number).gap;
            let mut placed = self.place(&factors, gap, true)?;
            self.defer(&reached, &placed)?;
            let rays = origin.into_iter().chain(direction).chain([limit]);
            let operands = rays.chain(placed.factors.iter().copied()).collect();
            let kind = OpKind::Query(Query::Spawn, operands);
            placed.ops.push(Op { results: Values::default(), precise: false, kind });
            self.insert(placed);
        }
        self.plan.edits.insert(number, Edit::Spawned);
        Ok(())
    }

    fn shade(&mut self, number: u32, op: &Op) -> Result<(), Refusal> {
        let reached = self.components(number, op.results)?;
        let gap = self.spreading.flow.node(number).gap;
        let placed = self.place(&factors_of(&reached), gap, false)?;
        self.defer(&reached, &placed)?;
        self.plan.edits.insert(number, Edit::OwnShade(placed.factors.clone()));
        self.insert(placed);
        Ok(())
    }

    /// Follows the components of an answer, each of which may reach the same component of the colour.
    fn components(&mut self, number: u32, results: Values) -> Result<Reached, Refusal> {
        let node = self.spreading.flow.node(number);
        let scope = Scope {
            at: node.start,
            from: node.start,
            until: self.spreading.flow.end(),
            known: self.spreading.flow.known_in(node.gap),
        };
        let mut reached = Reached::default();
        for (component, value) in (0..COLOR_COMPONENTS).zip(results.iter()) {
            self.follow_to_color(value, &scope, &mut reached)?;
            if let Some(Some((other, _))) = reached.factors.last()
                && *other != component
            {
                return Err(Refusal::of(Reason::Mixed, None));
            }
        }
        Ok(reached)
    }

    /// Follows a value to the colour.
    fn follow_to_color(
        &mut self,
        value: Value,
        scope: &Scope,
        reached: &mut Reached,
    ) -> Result<(), Refusal> {
        let way = self.spreading.follow(value, scope)?;
        let function = self.spreading.flow.function;
        let mut found = None;
        for (output, yielded) in function.outputs.iter().zip(&function.body.yields) {
            let factor = way.factor(*yielded);
            if factor == Factor::Zero {
                continue;
            }
            let variable = function.variable(output.variable);
            if variable.kind != VariableKind::State || variable.name != COLOR {
                return Err(Refusal::of(Reason::OtherOutput, Some(*yielded)));
            }
            if found.replace((output.component, factor)).is_some() {
                return Err(Refusal::of(Reason::Mixed, Some(*yielded)));
            }
        }
        reached.factors.push(found);
        reached.values.extend(way.values());
        Ok(())
    }

    fn place(&mut self, factors: &[Factor], gap: Gap, may_wait: bool) -> Result<Placed, Refusal> {
        let Spreading { flow, factors: expressions, .. } = &self.spreading;
        let wanted = Wanted { expressions, factors, gap, may_wait };
        let placed = place(flow, &wanted, &mut self.plan.types);
        placed.ok_or(Refusal::of(Reason::UnknownFactor, None))
    }

    /// Marks the values that depend on a request and those that its factors depend on: none may be both.
    fn defer(&mut self, reached: &Reached, placed: &Placed) -> Result<(), Refusal> {
        let is_new = |value: &&Value| reached.values.contains(value);
        if let Some(value) = placed.used.iter().find(|value| self.plan.depends[**value]) {
            return Err(Refusal::of(Reason::DeferredFactor, Some(*value)));
        }
        if let Some(value) = placed.used.iter().find(is_new) {
            return Err(Refusal::of(Reason::Multiplied, Some(*value)));
        }
        if let Some(value) = reached.values.iter().find(|value| self.used[**value]) {
            return Err(Refusal::of(Reason::Multiplied, Some(*value)));
        }
        reached.values.iter().for_each(|value| self.plan.depends[*value] = true);
        placed.used.iter().for_each(|value| self.used[*value] = true);
        Ok(())
    }

    fn insert(&mut self, placed: Placed) {
        for (number, gap) in placed.moves {
            let op = self.spreading.flow.node(number).op.clone();
            self.spreading.flow.move_to(number, gap);
            self.plan.edits.insert(number, Edit::Moved);
            self.plan.insertions.entry(gap).or_default().push(op);
        }
        self.plan.insertions.entry(placed.gap).or_default().extend(placed.ops);
    }

    fn light(&mut self, number: u32, op: &Op) -> Result<(), Refusal> {
        let branch = self.branch_of(number, op)?;
        let node = self.spreading.flow.node(branch);
        let OpKind::If { then, otherwise, .. } = &node.op.kind else { return Ok(()) };
        let (results, end) = (node.op.results, node.end);
        let inside = Gap { region: node.first_region, position: then.ops.len() as u32 };
        self.check_body(number, branch)?;
        let scope = Scope {
            at: end,
            from: end,
            until: self.spreading.flow.end(),
            known: self.spreading.flow.known_in(inside),
        };
        let mut reached = Reached::default();
        let mut sums = Vec::new();
        for (position, result) in results.iter().enumerate() {
            let sum = otherwise.yields[position];
            if then.yields[position] != sum && self.spreading.flow.is_needed(result) {
                let values = self.added_to(branch, position, sum)?;
                self.follow_to_color(result, &scope, &mut reached)?;
                reached.values.extend(values);
                sums.push((position, sum));
            }
        }
        let factors = factors_of(&reached);
        let mut placed = self.place(&factors, inside, false)?;
        let own: Vec<Value> = sums.iter().map(|(_, sum)| *sum).chain(op.results.iter()).collect();
        placed.used.extend(self.used_in(branch, &own));
        reached.values.extend(op.results.iter());
        self.defer(&reached, &placed)?;
        self.contribute(number, branch, sums, &reached, placed);
        Ok(())
    }

    /// Returns the branch that is executed if the light reaches the point.
    fn branch_of(&self, number: u32, op: &Op) -> Result<u32, Refusal> {
        let flow = &self.spreading.flow;
        let mut results = op.results.iter();
        let found = results.next();
        let used = Refusal::of(Reason::SampleUsed, found);
        let &[moment] = found.map_or(&[][..], |found| flow.uses(found)) else { return Err(used) };
        let Event::Start(branch) = flow.event(moment) else { return Err(used) };
        let node = flow.node(branch);
        if !matches!(node.op.kind, OpKind::If { condition, .. } if Some(condition) == found) {
            return Err(used);
        }
        let is_inside = |value: Value| {
            let mut uses = flow.uses(value).iter();
            uses.all(|it| node.start < *it && *it < node.middle || *it == node.end)
        };
        match results.all(is_inside) && flow.node(number).gap.region == node.gap.region {
            true => Ok(branch),
            false => Err(used),
        }
    }

    /// Checks that a branch only computes.
    fn check_body(&self, number: u32, branch: u32) -> Result<(), Refusal> {
        let flow = &self.spreading.flow;
        let node = flow.node(branch);
        let inner = flow.nodes.iter().skip(number as usize + 1);
        for inner in
            inner.skip_while(|it| it.start <= node.start).take_while(|it| it.start < node.middle)
        {
            let at = inner.op.results.iter().next();
            match &inner.op.kind {
                OpKind::Report(..) => {}
                OpKind::ReferenceCall(_) if is_quiet_call(inner.op) => {}
                kind => match kind.effect(&flow.function.variables) {
                    Effect::None | Effect::ReadsLocal(_) => {}
                    Effect::WritesLocal(_) => return Err(Refusal::of(Reason::BodySets, at)),
                    Effect::Host => return Err(Refusal::of(Reason::BodyAsks, at)),
                },
            }
        }
        Ok(())
    }

    /// Checks that a branch yields a sum with something added, and returns the values in it that depend on the sum.
    fn added_to(
        &mut self,
        branch: u32,
        position: usize,
        sum: Value,
    ) -> Result<Vec<Value>, Refusal> {
        let node = self.spreading.flow.node(branch);
        let OpKind::If { then, .. } = &node.op.kind else { return Ok(Vec::new()) };
        let (results, yields, gap) = (node.op.results, &then.yields, node.gap);
        let sets = Err(Refusal::of(Reason::BodySets, Some(yields[position])));
        let is_sum = self.spreading.flow.function.scalar(sum) == Scalar::F32
            && self.spreading.flow.is_visible(sum, gap);
        if !is_sum {
            return sets;
        }
        let scope =
            Scope { at: node.start, from: node.start, until: node.middle, known: Vec::new() };
        let way = self.spreading.follow(sum, &scope)?;
        for (index, result) in results.iter().enumerate() {
            let expected = if index == position { Factor::One } else { Factor::Zero };
            if self.spreading.flow.is_needed(result) && way.factor(yields[index]) != expected {
                return sets;
            }
        }
        Ok(way.values().filter(|value| *value != sum).collect())
    }

    /// Returns the values from outside a branch that it uses, but for its own.
    fn used_in(&self, branch: u32, own: &[Value]) -> Vec<Value> {
        let flow = &self.spreading.flow;
        let node = flow.node(branch);
        let OpKind::If { then, .. } = &node.op.kind else { return Vec::new() };
        let mut used = Vec::new();
        then.for_each_use(&mut |value| {
            if !own.contains(&value) && flow.is_visible(value, node.gap) {
                used.push(value);
            }
        });
        used
    }

    fn contribute(
        &mut self,
        number: u32,
        branch: u32,
        sums: Vec<(usize, Value)>,
        reached: &Reached,
        placed: Placed,
    ) {
        let OpKind::LightSample { point, .. } = self.spreading.flow.node(number).op.kind else {
            return;
        };
        let query = Query::UnshadowedLight;
        let first = self.plan.types.len() as u32;
        self.plan.types.extend(query.result_scalars());
        let results = Values { first, count: self.plan.types.len() as u32 - first };
        let [x, y, z] = point;
        let direction = |component: u32| results.get(1 + component);
        let ray =
            [x, y, z, direction(0), direction(1), direction(2), results.get(results.count - 1)];
        let factors = reached.factors.iter().zip(&placed.factors);
        let sums = sums.into_iter().zip(factors).map(|((position, sum), (reached, value))| {
            let factor = |factor| if factor == Factor::One { None } else { Some(*value) };
            let reached = reached.map(|(component, of)| (component, factor(of)));
            Addend { position, sum, reached }
        });
        let contribution = Contribution { ray, sums: sums.collect() };
        self.plan.edits.insert(number, Edit::Unshadowed(results));
        self.plan.edits.insert(branch, Edit::Contributing(contribution));
        self.insert(placed);
    }
}

fn factors_of(reached: &Reached) -> Vec<Factor> {
    let factors = reached.factors.iter();
    factors.map(|reached| reached.map_or(Factor::Zero, |(_, factor)| factor)).collect()
}
