//! The operations of a function in the order of the text, and where values are defined and used.

use std::collections::BTreeSet;

use rtsl_ir::{Effect, Function, IndexVec, Op, OpKind, Region, Scalar, Value};

use rtsl_spec::Method;

use crate::conditions::Conditions;
use crate::dce;

/// A position in the text: the start or the end of an operation, or the end of the function. The end of an operation
/// with regions is behind them.
pub(super) type Moment = u32;

/// The event of a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    /// The operation with this number reads its operands.
    Start(u32),
    /// Its regions yield.
    End(u32),
    /// The function yields its outputs.
    Outputs,
}

/// A gap between two operations: before the operation at this position of a region, or at its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Gap {
    pub region: u32,
    pub position: u32,
}

/// An operation.
pub(super) struct Node<'f> {
    pub op: &'f Op,
    /// The gap before it.
    pub gap: Gap,
    pub start: Moment,
    /// The moment behind the first of its regions.
    pub middle: Moment,
    pub end: Moment,
    /// The number of the first of its regions.
    pub first_region: u32,
}

/// The definition of a value.
#[derive(Clone, Copy)]
struct Definition {
    /// The first gap in which it is visible.
    visible: Gap,
    /// The number of the operation; `None` for a parameter of a region.
    op: Option<u32>,
}

pub(super) struct Flow<'f> {
    pub function: &'f Function,
    /// The operations in the order of the text.
    pub nodes: Vec<Node<'f>>,
    /// For each region the number of the operation that holds it.
    owners: Vec<Option<u32>>,
    events: Vec<Event>,
    definitions: IndexVec<Value, Option<Definition>>,
    uses: IndexVec<Value, Vec<Moment>>,
    /// For each value, true if more than reports need it; `None` if all are needed.
    needed: Option<IndexVec<Value, bool>>,
    conditions: Conditions,
    /// The operations that have moved to an earlier gap.
    moved: BTreeSet<u32>,
}

impl<'f> Flow<'f> {
    pub fn of(function: &'f Function) -> Self {
        let count = function.values.len();
        let mut flow = Flow {
            function,
            nodes: Vec::new(),
            owners: Vec::new(),
            events: Vec::new(),
            definitions: IndexVec::filled(count, None),
            uses: IndexVec::filled(count, Vec::new()),
            needed: dce::needed_beside_reports(function),
            conditions: Conditions::default(),
            moved: BTreeSet::new(),
        };
        flow.region(&function.body, None);
        let end = flow.happen(Event::Outputs);
        for value in &function.body.yields {
            flow.use_at(*value, end);
        }
        flow
    }

    fn happen(&mut self, event: Event) -> Moment {
        self.events.push(event);
        self.events.len() as Moment - 1
    }

    fn region(&mut self, region: &'f Region, owner: Option<u32>) {
        let number = self.owners.len() as u32;
        self.owners.push(owner);
        let gap = |position| Gap { region: number, position };
        for param in &region.params {
            self.definitions[*param] = Some(Definition { visible: gap(0), op: None });
        }
        for (position, op) in (0..).zip(&region.ops) {
            let defined =
                Definition { visible: gap(position + 1), op: Some(self.nodes.len() as u32) };
            for result in op.results.iter() {
                self.definitions[result] = Some(defined);
            }
            self.op(op, gap(position));
        }
    }

    fn op(&mut self, op: &'f Op, gap: Gap) {
        let number = self.nodes.len() as u32;
        let start = self.happen(Event::Start(number));
        let first_region = self.owners.len() as u32;
        self.nodes.push(Node { op, gap, start, middle: start, end: start, first_region });
        if op.results.count == 1 && self.function.scalar(op.results.get(0)) == Scalar::Bool {
            self.conditions.remember(op);
        }
        if !self.is_ignored(op) {
            op.kind.for_each_operand(|value| self.use_at(value, start));
        }
        if op.kind.regions().next().is_none() {
            return;
        }
        for (index, region) in op.kind.regions().enumerate() {
            self.region(region, Some(number));
            if index == 0 {
                self.nodes[number as usize].middle = self.events.len() as Moment;
            }
        }
        let end = self.happen(Event::End(number));
        self.nodes[number as usize].end = end;
        for value in op.kind.regions().flat_map(|region| &region.yields) {
            self.use_at(*value, end);
        }
    }

    /// True if only reports need the operation.
    pub fn is_ignored(&self, op: &Op) -> bool {
        let is_pure = op.kind.effect(&self.function.variables) == Effect::None
            && op.kind.regions().next().is_none();
        matches!(op.kind, OpKind::Report(..))
            || is_pure && op.results.iter().all(|result| !self.is_needed(result))
    }

    pub fn is_needed(&self, value: Value) -> bool {
        self.needed.as_ref().is_none_or(|needed| needed[value])
    }

    fn use_at(&mut self, value: Value, moment: Moment) {
        let uses = &mut self.uses[value];
        if uses.last() != Some(&moment) {
            uses.push(moment);
        }
    }

    /// Returns the moments at which a value is used, in order.
    pub fn uses(&self, value: Value) -> &[Moment] {
        &self.uses[value]
    }

    pub fn event(&self, moment: Moment) -> Event {
        self.events[moment as usize]
    }

    /// Returns the moment of the function's outputs.
    pub fn end(&self) -> Moment {
        self.events.len() as Moment - 1
    }

    pub fn node(&self, number: u32) -> &Node<'f> {
        &self.nodes[number as usize]
    }

    /// Returns the operation that computes a value, if an operation does.
    pub fn definition(&self, value: Value) -> Option<&'f Op> {
        let op = self.definitions[value]?.op?;
        Some(self.node(op).op)
    }

    /// Returns the numbers of the operations around a gap, the innermost first, and whether it is in the first of their
    /// regions.
    pub fn around(&self, gap: Gap) -> impl Iterator<Item = (u32, bool)> {
        let mut region = gap.region;
        std::iter::from_fn(move || {
            let owner = self.owners[region as usize]?;
            let node = self.node(owner);
            let is_first = region == node.first_region;
            region = node.gap.region;
            Some((owner, is_first))
        })
    }

    /// True if the value can be used in the gap.
    pub fn is_visible(&self, value: Value, gap: Gap) -> bool {
        self.nearest(value, gap).is_some_and(|(at, visible)| visible <= at)
    }

    /// Returns the first gap of the same region in which the value is visible, if there is one.
    pub fn visible_later(&self, value: Value, gap: Gap) -> Option<Gap> {
        let definition = self.definitions[value]?;
        (definition.visible.region == gap.region).then_some(definition.visible)
    }

    /// Returns the position of the gap, or of the operation around it, in the region that defines the value, and the
    /// position from which the value is visible there.
    fn nearest(&self, value: Value, gap: Gap) -> Option<(u32, u32)> {
        let visible = self.definitions[value]?.visible;
        let outer = self.around(gap).map(|(owner, _)| self.node(owner).gap);
        let found = std::iter::once(gap).chain(outer).find(|it| it.region == visible.region)?;
        Some((found.position, visible.position))
    }

    /// Returns the gap in the region that defines a value that is, or is around, this gap; `None` if this gap is not in
    /// that region.
    pub fn earlier_gap(&self, value: Value, gap: Gap) -> Option<Gap> {
        let region = self.definitions[value]?.visible.region;
        let (position, _) = self.nearest(value, gap)?;
        Some(Gap { region, position })
    }

    /// Returns the number of the operation that computes a value, if it can be executed earlier.
    pub fn movable(&self, value: Value) -> Option<u32> {
        let number = self.definitions[value]?.op.filter(|number| !self.moved.contains(number))?;
        let node = self.node(number);
        let inner = self.nodes[number as usize..].iter().take_while(|it| it.start <= node.end);
        // Reports come earlier then: a traced method defers what the same method defers that is not traced.
        let is_free = |op: &Op| {
            let is_report = matches!(op.kind, OpKind::Report(..));
            is_report || op.kind.effect(&self.function.variables) == Effect::None
        };
        inner.map(|it| it.op).all(|op| is_free(op) || is_quiet_call(op)).then_some(number)
    }

    /// Returns the values from outside an operation that it or its regions use.
    pub fn operands_from_outside(&self, number: u32) -> Vec<Value> {
        let node = self.node(number);
        let mut operands = Vec::new();
        node.op.kind.for_each_operand(|value| operands.push(value));
        for region in node.op.kind.regions() {
            region.for_each_use(&mut |value| {
                if self.is_visible(value, node.gap) {
                    operands.push(value);
                }
            });
        }
        operands
    }

    /// Moves an operation to an earlier gap.
    pub fn move_to(&mut self, number: u32, gap: Gap) {
        self.moved.insert(number);
        for result in self.node(number).op.results.iter() {
            self.definitions[result] = Some(Definition { visible: gap, op: Some(number) });
        }
    }

    /// Returns what is known of bools in a gap, since it is in branches.
    pub fn known_in(&self, gap: Gap) -> Vec<(Value, bool)> {
        let mut known = Vec::new();
        for (owner, is_first) in self.around(gap) {
            if let OpKind::If { condition, .. } = self.node(owner).op.kind {
                known.extend(self.conditions.conclusions(condition, is_first));
            }
        }
        known
    }
}

/// True for calls of other objects that compute. Linking has replaced them before methods are changed; a method that is
/// examined alone has them.
pub(super) fn is_quiet_call(op: &Op) -> bool {
    matches!(&op.kind, OpKind::ReferenceCall(call) if call.method != Method::Shade)
}
