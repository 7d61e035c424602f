//! Code that may suspend, and its joins.

use rtsl_ir::{Constant, Op, OpKind, Region, Value, Values};

use crate::SplitError;
use crate::code::Code;

/// The paths that have left the straight way: they have suspended, or the function has ended for them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Left {
    Never,
    /// Those for which a bool is true.
    If(Value),
    Always,
}

/// The values that a run of operations passes on, and the paths that it does not.
#[derive(Clone, Debug)]
pub(crate) struct Flow {
    pub left: Left,
    /// The values that the paths that go on yield; arbitrary for those that have left, and none if all have.
    pub values: Vec<Value>,
}

impl Flow {
    /// Returns the flow from which all paths have left.
    pub fn ended() -> Flow {
        Flow { left: Left::Always, values: Vec::new() }
    }

    /// Returns a flow of all paths, with these values.
    pub fn on(values: Vec<Value>) -> Flow {
        Flow { left: Left::Never, values }
    }

    fn has_ended(&self) -> bool {
        self.left == Left::Always
    }
}

/// One side of an `if`.
pub(crate) struct Side {
    pub ops: Vec<Op>,
    pub flow: Flow,
}

/// A writer of code that may suspend.
pub(crate) trait Flowing: Sized {
    fn code(&mut self) -> &mut Code;

    /// Writes one side of an `if`.
    fn side(
        &mut self,
        write: impl FnOnce(&mut Self) -> Result<Flow, SplitError>,
    ) -> Result<Side, SplitError> {
        self.continued(Vec::new(), write)
    }

    /// Writes more of a side of an `if`.
    fn continued(
        &mut self,
        ops: Vec<Op>,
        write: impl FnOnce(&mut Self) -> Result<Flow, SplitError>,
    ) -> Result<Side, SplitError> {
        self.code().open(ops)?;
        let flow = write(self)?;
        Ok(Side { ops: self.code().close(), flow })
    }

    /// Writes what follows a flow, for the paths that have not left it.
    fn after(
        &mut self,
        flow: Flow,
        rest: impl FnOnce(&mut Self, Vec<Value>) -> Result<Flow, SplitError>,
    ) -> Result<Flow, SplitError> {
        match flow.left {
            Left::Always => Ok(Flow::ended()),
            Left::Never => rest(self, flow.values),
            Left::If(left) => {
                let start = self.code().value_count();
                let ended = Side { ops: Vec::new(), flow: Flow::ended() };
                let others = self.side(|it| rest(it, flow.values))?;
                Ok(self.code().join(start, left, ended, others))
            }
        }
    }

    /// Joins the sides of an `if` and writes what follows it. If all paths of one side have left, what follows becomes
    /// a part of the other. `start` is the number of values before the sides.
    fn fork(
        &mut self,
        start: u32,
        condition: Value,
        then: Side,
        otherwise: Side,
        rest: impl FnOnce(&mut Self, Vec<Value>) -> Result<Flow, SplitError>,
    ) -> Result<Flow, SplitError> {
        match (then.flow.has_ended(), otherwise.flow.has_ended()) {
            (true, true) => Ok(self.code().join(start, condition, then, otherwise)),
            (false, false) => {
                let flow = self.code().join(start, condition, then, otherwise);
                self.after(flow, rest)
            }
            (true, false) => {
                let Side { ops, flow } = otherwise;
                let otherwise = self.continued(ops, |it| it.after(flow, rest))?;
                Ok(self.code().join(start, condition, then, otherwise))
            }
            (false, true) => {
                let Side { ops, flow } = then;
                let then = self.continued(ops, |it| it.after(flow, rest))?;
                Ok(self.code().join(start, condition, then, otherwise))
            }
        }
    }
}

impl Code {
    /// Adds an `if` of two sides; `start` is the number of values before them.
    pub fn join(&mut self, start: u32, condition: Value, then: Side, otherwise: Side) -> Flow {
        let flows = [&then.flow, &otherwise.flow];
        let count = flows.iter().map(|flow| flow.values.len()).max().unwrap_or(0);
        let mut yields = [Vec::with_capacity(count + 1), Vec::with_capacity(count + 1)];
        // For each value, one that is the same on both sides, if there is one; other values are yielded, in order.
        let mut same = Vec::with_capacity(count);
        for index in 0..count {
            let sides = flows.map(|flow| flow.values.get(index).copied());
            let common = self.common(start, sides);
            same.push(common);
            if common.is_none() {
                self.yield_both(&mut yields, sides);
            }
        }
        let left = flows.map(|flow| flow.left);
        let is_mixed = left.contains(&Left::Never) && left.contains(&Left::Always);
        let is_flagged = !is_mixed && left[0] != left[1] || matches!(left[0], Left::If(_));
        if is_flagged {
            for (yields, left) in yields.iter_mut().zip(left) {
                yields.push(self.flag(left));
            }
        }
        let scalars: Vec<_> = yields[0].iter().map(|value| self.scalar(*value)).collect();
        let [a, b] = yields;
        let then = Region { params: Vec::new(), ops: then.ops, yields: a };
        let otherwise = Region { params: Vec::new(), ops: otherwise.ops, yields: b };
        let results = self.push(OpKind::If { condition, then, otherwise }, false, &scalars);
        let left = match left {
            [_, _] if is_flagged => Left::If(results.get(results.count - 1)),
            [Left::Always, Left::Never] => Left::If(condition),
            [Left::Never, Left::Always] => Left::If(self.not(condition)),
            [left, _] => left,
        };
        Flow { left, values: filled(same, results) }
    }

    /// Returns a value that both sides may be said to yield: a side that all paths have left yields anything.
    fn common(&self, start: u32, sides: [Option<Value>; 2]) -> Option<Value> {
        match sides {
            [Some(a), Some(b)] => (a == b).then_some(a),
            [Some(one), None] | [None, Some(one)] => {
                let is_outside = one.0 < start || self.known(one).is_some();
                is_outside.then_some(one)
            }
            [None, None] => None,
        }
    }

    fn yield_both(&mut self, yields: &mut [Vec<Value>; 2], sides: [Option<Value>; 2]) {
        let scalar = sides.into_iter().flatten().next().map(|value| self.scalar(value));
        let Some(scalar) = scalar else { return };
        for (yields, value) in yields.iter_mut().zip(sides) {
            yields.push(value.unwrap_or_else(|| self.constant(Constant::zero(scalar))));
        }
    }

    /// Returns a bool that is true for the paths that have left.
    pub fn flag(&mut self, left: Left) -> Value {
        match left {
            Left::Never => self.bool(false),
            Left::If(value) => value,
            Left::Always => self.bool(true),
        }
    }

    /// Returns the number of values so far.
    pub fn value_count(&self) -> u32 {
        self.function.values.len() as u32
    }
}

/// Fills the gaps with results, in order.
fn filled(values: Vec<Option<Value>>, results: Values) -> Vec<Value> {
    let mut results = results.iter();
    values.into_iter().filter_map(|value| value.or_else(|| results.next())).collect()
}
