//! The way of a request's answer through a method: every value that depends on it, and by which factor.

use std::collections::{BTreeSet, HashMap};

use rtsl_ir::{BinaryOp, Op, OpKind, UnaryOp, Value};

use super::factors::{Factor, Factors};
use super::flow::{Event, Flow, Moment, Node};
use super::reason::{Reason, Refusal};

/// The greatest number of operations on the way of a component of an answer.
const MAX_STEPS: usize = 1024;

/// The part of the text in which a value is followed.
pub(super) struct Scope {
    /// The moment at which the answer comes: it is in the loops around this moment.
    pub at: Moment,
    /// The first moment of the scope.
    pub from: Moment,
    /// The first moment behind it.
    pub until: Moment,
    /// The bools that are known where the answer comes from.
    pub known: Vec<(Value, bool)>,
}

/// The way of a value.
#[derive(Default)]
pub(super) struct Way {
    /// The values in the scope that the value reaches, by these factors.
    factors: HashMap<Value, Factor>,
    /// Values of further iterations of loops, which also depend on it.
    pub carried: Vec<Value>,
}

impl Way {
    pub fn factor(&self, of: Value) -> Factor {
        self.factors.get(&of).copied().unwrap_or(Factor::Zero)
    }

    /// Returns all values that depend on the value.
    pub fn values(&self) -> impl Iterator<Item = Value> {
        self.factors.keys().chain(&self.carried).copied()
    }
}

/// The values of a loop's further iterations that depend on a carried one to which the loop only adds.
type Sums = HashMap<(u32, usize), Result<Vec<Value>, Refusal>>;

/// Follows values.
pub(super) struct Spreading<'f> {
    pub flow: Flow<'f>,
    pub factors: Factors,
    sums: Sums,
}

impl<'f> Spreading<'f> {
    pub fn new(flow: Flow<'f>) -> Self {
        let factors = Factors::of(flow.function);
        Spreading { flow, factors, sums: HashMap::new() }
    }

    /// Follows a value through the scope.
    pub fn follow(&mut self, value: Value, scope: &Scope) -> Result<Way, Refusal> {
        let mut step =
            Step { spreading: self, scope, way: Way::default(), pending: BTreeSet::new() };
        step.reach(value, Factor::One);
        for _ in 0..MAX_STEPS {
            let Some(moment) = step.pending.pop_first() else { return Ok(step.way) };
            match step.spreading.flow.event(moment) {
                Event::Start(number) => step.start(number)?,
                Event::End(number) => step.end(number)?,
                Event::Outputs => {}
            }
        }
        match step.pending.is_empty() {
            true => Ok(step.way),
            false => Err(Refusal::of(Reason::TooLong, None)),
        }
    }

    /// Checks that a loop only adds to a carried value, and returns the values of further iterations that depend on it.
    fn sum(&mut self, number: u32, position: usize) -> Result<Vec<Value>, Refusal> {
        if let Some(known) = self.sums.get(&(number, position)) {
            return known.clone();
        }
        let found = self.added_to(number, position);
        self.sums.insert((number, position), found.clone());
        found
    }

    fn added_to(&mut self, number: u32, position: usize) -> Result<Vec<Value>, Refusal> {
        let &Node { op, start, end, .. } = self.flow.node(number);
        let OpKind::Loop { body, .. } = &op.kind else { return Ok(Vec::new()) };
        let scope = Scope { at: start, from: start, until: end, known: Vec::new() };
        let way = self.follow(body.params[position], &scope)?;
        for (index, next) in body.yields.iter().skip(1).enumerate() {
            let expected = if index == position { Factor::One } else { Factor::Zero };
            if self.flow.is_needed(body.params[index]) && way.factor(*next) != expected {
                return Err(Refusal::of(Reason::Repeated, Some(*next)));
            }
        }
        Ok(way.values().collect())
    }
}

/// Follows one value.
struct Step<'a, 'f> {
    spreading: &'a mut Spreading<'f>,
    scope: &'a Scope,
    way: Way,
    /// Moments that use reached values.
    pending: BTreeSet<Moment>,
}

impl<'f> Step<'_, 'f> {
    fn reach(&mut self, value: Value, factor: Factor) {
        if factor != Factor::Zero {
            self.way.factors.insert(value, factor);
            let range = self.scope.from..self.scope.until;
            let uses = self.spreading.flow.uses(value).iter();
            self.pending.extend(uses.filter(|moment| range.contains(moment)));
        }
    }

    fn start(&mut self, number: u32) -> Result<(), Refusal> {
        let op = self.spreading.flow.node(number).op;
        if let OpKind::Loop { initial, .. } = &op.kind {
            return self.enter_loop(number, op, initial);
        }
        let factor = self.combined(op)?;
        self.reach(op.results.get(0), factor);
        Ok(())
    }

    /// Returns the factor of an operation's result.
    fn combined(&mut self, op: &Op) -> Result<Factor, Refusal> {
        let at = op.results.iter().next();
        let refused = |reason| Err(Refusal::of(reason, at));
        Ok(match op.kind {
            OpKind::Binary(BinaryOp::Add, a, b) => self.added(a, b),
            OpKind::Binary(BinaryOp::Subtract, a, b) => {
                let (a, b) = (self.way.factor(a), self.way.factor(b));
                let b = self.spreading.factors.negated(b);
                self.spreading.factors.sum(a, b)
            }
            OpKind::Unary(UnaryOp::Negate, a) => {
                let a = self.way.factor(a);
                self.spreading.factors.negated(a)
            }
            OpKind::Binary(BinaryOp::Multiply, a, b) => self.multiplied(a, b, at)?,
            OpKind::Fma(a, b, c) => {
                let product = self.multiplied(a, b, at)?;
                let c = self.way.factor(c);
                self.spreading.factors.sum(product, c)
            }
            OpKind::Binary(BinaryOp::Divide, a, b) => match self.way.factor(b) {
                Factor::Zero => {
                    let a = self.way.factor(a);
                    self.spreading.factors.quotient(a, b)
                }
                _ => return refused(Reason::Divisor),
            },
            OpKind::Select(condition, a, b) => self.chosen(condition, a, b),
            OpKind::Compare(..) => return refused(Reason::Compared),
            OpKind::Store(..) => return Err(Refusal::of(Reason::Stored, None)),
            OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightSample { .. }
            | OpKind::Query(..)
            | OpKind::ReferenceCall(_) => return refused(Reason::Asked),
            _ => return refused(Reason::Argument),
        })
    }

    fn added(&mut self, a: Value, b: Value) -> Factor {
        let (a, b) = (self.way.factor(a), self.way.factor(b));
        self.spreading.factors.sum(a, b)
    }

    fn multiplied(&mut self, a: Value, b: Value, at: Option<Value>) -> Result<Factor, Refusal> {
        match (self.way.factor(a), self.way.factor(b)) {
            (factor, Factor::Zero) => Ok(self.spreading.factors.product(factor, b)),
            (Factor::Zero, factor) => Ok(self.spreading.factors.product(factor, a)),
            _ => Err(Refusal::of(Reason::Multiplied, at)),
        }
    }

    /// Returns the factor of one of two values that a bool selects.
    fn chosen(&mut self, condition: Value, then: Value, otherwise: Value) -> Factor {
        let (then, otherwise) = (self.way.factor(then), self.way.factor(otherwise));
        match self.scope.known.iter().find(|(known, _)| *known == condition) {
            Some((_, true)) => then,
            Some((_, false)) => otherwise,
            None => self.spreading.factors.choice(condition, then, otherwise),
        }
    }

    fn enter_loop(&mut self, number: u32, op: &Op, initial: &[Value]) -> Result<(), Refusal> {
        for (position, value) in initial.iter().enumerate() {
            self.leave_loop(number, op, position, *value)?;
        }
        Ok(())
    }

    /// Passes a value to a result of a loop that only adds to it.
    fn leave_loop(
        &mut self,
        number: u32,
        op: &Op,
        position: usize,
        value: Value,
    ) -> Result<(), Refusal> {
        let OpKind::Loop { body, .. } = &op.kind else { return Ok(()) };
        let factor = self.way.factor(value);
        if factor != Factor::Zero && self.spreading.flow.is_needed(body.params[position]) {
            let carried = self.spreading.sum(number, position)?;
            self.way.carried.extend(carried);
            self.reach(op.results.get(position as u32), factor);
        }
        Ok(())
    }

    /// Passes what the regions of an operation yield to its results.
    fn end(&mut self, number: u32) -> Result<(), Refusal> {
        let &Node { op, start, end, .. } = self.spreading.flow.node(number);
        match &op.kind {
            OpKind::If { condition, then, otherwise } => {
                for (position, result) in op.results.iter().enumerate() {
                    if self.spreading.flow.is_needed(result) {
                        let (then, otherwise) = (then.yields[position], otherwise.yields[position]);
                        let factor = self.chosen(*condition, then, otherwise);
                        self.reach(result, factor);
                    }
                }
            }
            OpKind::Loop { body, .. } => {
                let is_inside = start < self.scope.at && self.scope.at < end;
                for (position, value) in body.yields.iter().skip(1).enumerate() {
                    let is_reached = self.way.factor(*value) != Factor::Zero;
                    if is_reached && self.spreading.flow.is_needed(body.params[position]) {
                        if !is_inside {
                            return Err(Refusal::of(Reason::Repeated, Some(*value)));
                        }
                        self.leave_loop(number, op, position, *value)?;
                    }
                }
            }
            _ => {}
        }
        Ok(())
    }
}
