//! Suspension points: where they lie in the regions of a function.

use std::collections::BTreeMap;

use rtsl_ir::{Function, IndexVec, Op, OpKind, Query, Region, Value};

use crate::ResumedBy;

/// The identity of a point: the first result of its operation. All operations that may suspend have results.
pub(crate) type PointId = Value;

/// A region on the way from the body of the function to a point, and the index in it of the operation that leads on,
/// or is the point's.
#[derive(Clone, Copy)]
pub(crate) struct Level<'a> {
    pub region: &'a Region,
    pub index: usize,
    /// The number of the region, in the order of the text.
    pub number: usize,
}

impl<'a> Level<'a> {
    /// Returns the operation that leads on.
    pub fn op(self) -> &'a Op {
        &self.region.ops[self.index]
    }
}

/// A point where a function may suspend.
pub(crate) struct Point<'a> {
    /// The event that resumes it: [`ResumedBy::Dispatch`] for a query about a surface, before which it suspends.
    pub event: ResumedBy,
    /// The regions around it, the body of the function first.
    pub levels: Vec<Level<'a>>,
    /// The surface that it names: that of the query, or of the first query that follows an answer.
    pub surface: Option<[Value; 3]>,
}

impl<'a> Point<'a> {
    /// Returns the operation.
    pub fn op(&self) -> &'a Op {
        self.levels[self.levels.len() - 1].op()
    }

    /// Returns the index, in the innermost region, of the first operation after the point.
    pub fn after(&self) -> usize {
        let Level { index, .. } = self.levels[self.levels.len() - 1];
        // A stage that has been dispatched starts with the query.
        if self.event == ResumedBy::Dispatch { index } else { index + 1 }
    }

    /// Returns the operands of the request, by their ports.
    pub fn request(&self) -> impl Iterator<Item = (u32, Value)> {
        self.event.request().iter().copied().zip(operands(self.op()))
    }
}

/// Returns the operands of an operation.
pub(crate) fn operands(op: &Op) -> Vec<Value> {
    let mut operands = Vec::new();
    op.kind.for_each_operand(|value| operands.push(value));
    operands
}

/// Returns object, instance and element of the surface that a query is about whose answer needs its classes.
pub(crate) fn queried_surface(kind: &OpKind) -> Option<[Value; 3]> {
    match kind {
        OpKind::Query(query, operands) if query.is_of_surface() && *query != Query::Shade => {
            operands.first_chunk::<3>().copied()
        }
        _ => None,
    }
}

/// True if the operation itself may suspend.
pub(crate) fn is_point(op: &Op) -> bool {
    ResumedBy::of(&op.kind).is_some() || queried_surface(&op.kind).is_some()
}

/// True if an operation of the region, or of regions in it, may suspend.
pub(crate) fn has_point(region: &Region) -> bool {
    let mut found = false;
    region.for_each_op(&mut |op| found |= is_point(op));
    found
}

/// The places where values are defined.
pub(crate) struct Scopes {
    /// For each value the number of the region that defines it, and the index of the first operation that sees it.
    homes: IndexVec<Value, Option<(usize, usize)>>,
}

impl Scopes {
    /// Returns the level of a point at which a value is defined, if the value is visible at the point.
    pub fn level(&self, point: &Point<'_>, value: Value) -> Option<usize> {
        let (number, first) = self.homes[value]?;
        point.levels.iter().position(|level| level.number == number && first <= level.index)
    }
}

/// Returns all points of a function.
pub(crate) fn find(function: &Function) -> (BTreeMap<PointId, Point<'_>>, Scopes) {
    let mut finder = Finder {
        points: BTreeMap::new(),
        levels: Vec::new(),
        scopes: Scopes { homes: IndexVec::filled(function.values.len(), None) },
        regions: 0,
    };
    finder.region(&function.body);
    (finder.points, finder.scopes)
}

struct Finder<'a> {
    points: BTreeMap<PointId, Point<'a>>,
    levels: Vec<Level<'a>>,
    /// The values found so far.
    scopes: Scopes,
    /// The number of regions so far.
    regions: usize,
}

impl<'a> Finder<'a> {
    fn region(&mut self, region: &'a Region) {
        let number = self.regions;
        self.regions += 1;
        region.params.iter().for_each(|value| self.scopes.homes[*value] = Some((number, 0)));
        for (index, op) in region.ops.iter().enumerate() {
            self.levels.push(Level { region, index, number });
            if is_point(op) {
                self.point(op);
            }
            op.kind.regions().for_each(|region| self.region(region));
            self.levels.pop();
            let home = Some((number, index + 1));
            op.results.iter().for_each(|value| self.scopes.homes[value] = home);
        }
    }

    fn point(&mut self, op: &'a Op) {
        let event = ResumedBy::of(&op.kind).unwrap_or(ResumedBy::Dispatch);
        let mut point = Point { event, levels: self.levels.clone(), surface: None };
        point.surface = match event {
            ResumedBy::Dispatch => queried_surface(&op.kind),
            ResumedBy::Occluded | ResumedBy::Trace | ResumedBy::LightSample | ResumedBy::Shade => {
                following_surface(&point, &self.scopes)
            }
            // The runtime sorts by the surface that was found.
            ResumedBy::NearestHit | ResumedBy::Start => None,
        };
        self.points.insert(op.results.get(0), point);
    }
}

/// Returns the surface of the first query about one that follows a point in the text, if the surface is visible at the
/// point.
fn following_surface(point: &Point<'_>, scopes: &Scopes) -> Option<[Value; 3]> {
    let mut from = point.after();
    for (depth, level) in point.levels.iter().enumerate().rev() {
        let mut found = scan(&level.region.ops[from..]);
        let outer = depth.checked_sub(1).map(|depth| point.levels[depth]);
        if found == Scan::Nothing
            && let Some(outer) = outer
            && let OpKind::Loop { body, .. } = &outer.op().kind
        {
            found = scan(&body.ops);
            // The values that the body defines will be others then.
            if let Scan::Surface(surface) = found {
                let is_inside = |it: &Value| scopes.level(point, *it).is_none_or(|it| it >= depth);
                let is_param = |it: &Value| body.params.contains(it);
                if surface.iter().any(|it| is_inside(it) && !is_param(it)) {
                    return None;
                }
            }
            found = found.replaced(&body.params, &body.yields[1..]);
        }
        match found {
            Scan::Surface(surface) => {
                let is_visible = surface.iter().all(|it| scopes.level(point, *it).is_some());
                return is_visible.then_some(surface);
            }
            Scan::Suspends => return None,
            Scan::Nothing => from = outer?.index + 1,
        }
    }
    None
}

/// The first of these in a run of operations: a query about a surface, or a certain suspension.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Scan {
    Nothing,
    Surface([Value; 3]),
    Suspends,
}

impl Scan {
    /// Replaces parameters of a loop by the values that they have.
    fn replaced(self, params: &[Value], by: &[Value]) -> Scan {
        let Scan::Surface(surface) = self else { return self };
        Scan::Surface(surface.map(|value| {
            params.iter().position(|param| *param == value).map_or(value, |index| by[index])
        }))
    }
}

fn scan(ops: &[Op]) -> Scan {
    for op in ops {
        if let Some(surface) = queried_surface(&op.kind) {
            return Scan::Surface(surface);
        }
        let found = match &op.kind {
            kind if ResumedBy::of(kind).is_some() => Scan::Suspends,
            OpKind::If { then, otherwise, .. } => match (scan(&then.ops), scan(&otherwise.ops)) {
                (Scan::Surface(surface), _) | (_, Scan::Surface(surface)) => Scan::Surface(surface),
                (Scan::Suspends, Scan::Suspends) => Scan::Suspends,
                _ => Scan::Nothing,
            },
            OpKind::Loop { initial, body } => scan(&body.ops).replaced(&body.params, initial),
            _ => Scan::Nothing,
        };
        if found != Scan::Nothing {
            return found;
        }
    }
    Scan::Nothing
}

/// Returns the operation that defines each value, other than parameters of loops.
pub(crate) fn definitions(function: &Function) -> IndexVec<Value, Option<&Op>> {
    let mut definitions = IndexVec::filled(function.values.len(), None);
    function.body.for_each_op(&mut |op| {
        op.results.iter().for_each(|value| definitions[value] = Some(op));
    });
    definitions
}
