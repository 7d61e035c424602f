//! Range analysis of indices: an index known to lie inside a variable need not be clamped again.
//!
//! A forward analysis in one pass, since values are defined before their uses; carried values of loops are unbounded.
//! It tracks [`Interval`]s, and upper bounds relative to the lengths of buffers. It ignores masks, so its results also
//! hold in lanes that are off.

use rtsl_ir::{BinaryOp, IndexVec, Interval, Scalar, Value, VariableId, VariableKind};

use crate::Kernel;
use crate::kernel::{OpKind, Region};

/// The known bounds of an integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Range {
    interval: Interval,
    /// The upper bound relative to the length of a buffer, if known.
    within: Option<Bound>,
}

/// An upper bound: the length of a buffer minus a constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Bound {
    buffer: VariableId,
    below: i64,
}

impl From<Interval> for Range {
    fn from(interval: Interval) -> Range {
        Range { interval, within: None }
    }
}

/// The ranges of the values of a kernel.
pub struct Ranges {
    /// The range of each value; `None` for f32.
    of: IndexVec<Value, Option<Range>>,
}

impl Ranges {
    /// Analyses `kernel`.
    pub fn new(kernel: &Kernel) -> Ranges {
        let unknown = kernel.values.iter().map(|ty| Interval::all(ty.scalar).map(Range::from));
        let mut ranges = Ranges { of: unknown.collect() };
        ranges.region(kernel, &kernel.prologue);
        ranges.region(kernel, &kernel.body);
        ranges
    }

    /// True if `index` is always the index of a scalar of the variable. For an empty buffer the index may be -1.
    pub fn is_inside(&self, kernel: &Kernel, index: Value, variable: VariableId) -> bool {
        let Some(Range { interval, within }) = self.get(index) else { return false };
        let declared = &kernel.variable(variable).variable;
        match declared.kind {
            // An index of an element is an index of a scalar only if elements have one scalar.
            VariableKind::Buffer => {
                let below = within.is_some_and(|it| it.buffer == variable && it.below >= 1);
                below && declared.len == 1 && interval.low >= -1
            }
            VariableKind::State
            | VariableKind::Scratch
            | VariableKind::Member
            | VariableKind::Parameter
            | VariableKind::Local
            | VariableKind::Accepted => {
                interval.low >= 0 && interval.high < i64::from(declared.len)
            }
        }
    }

    fn get(&self, value: Value) -> Option<Range> {
        self.of[value]
    }

    fn region(&mut self, kernel: &Kernel, region: &Region) {
        for op in &region.ops {
            op.kind.regions().for_each(|region| self.region(kernel, region));
            if op.results.count == 1
                && let result = op.results.get(0)
                && let Some(range) = self.result(kernel, &op.kind)
            {
                self.of[result] = Some(range);
            }
        }
    }

    /// Returns the bounds of the result of an operation that its type does not imply.
    fn result(&self, kernel: &Kernel, kind: &OpKind) -> Option<Range> {
        let scalar = |value: Value| kernel.ty(value).scalar;
        match kind {
            OpKind::Constant(constant) => Interval::of(*constant).map(Range::from),
            OpKind::Length(buffer) => Some(Range {
                interval: Interval { low: 0, high: i64::from(i32::MAX) },
                within: Some(Bound { buffer: *buffer, below: 0 }),
            }),
            OpKind::Binary(op, a, b) => self.binary(*op, *a, *b, scalar(*a)),
            OpKind::Select(_, a, b) => {
                Some(self.get(*a)?.interval.hull(self.get(*b)?.interval).into())
            }
            OpKind::Convert(to, a) => {
                let a = (scalar(*a), self.get(*a));
                let interval = Interval::convert(a.0, *to, a.1.map(|range| range.interval))?;
                let within = a.1.filter(|range| range.interval == interval);
                Some(Range { interval, within: within.and_then(|range| range.within) })
            }
            _ => None,
        }
    }

    fn binary(&self, op: BinaryOp, a: Value, b: Value, scalar: Scalar) -> Option<Range> {
        let (a, b) = (self.get(a)?, self.get(b)?);
        let interval = Interval::binary(op, scalar, a.interval, b.interval)?;
        let within = match op {
            BinaryOp::Min => a.within.or(b.within),
            BinaryOp::Subtract if b.interval.low > 0 && Some(interval) != Interval::all(scalar) => {
                a.within.map(|bound| Bound { below: b.interval.low, ..bound })
            }
            _ => None,
        };
        Some(Range { interval, within })
    }
}

#[cfg(test)]
mod tests {
    use rtsl_ir::{Function, Index, VariableKind};

    use super::*;
    use rtsl_abi::{CallMode, Layout};

    /// True if the index of the only load with a dynamic one is known to be inside.
    fn is_inside(index: &str) -> bool {
        let text = format!(
            "function f buffer b: f32[1] buffer wide: f32[2] member t: f32[4] scratch n: i32[1]
            scratch u: u32[1] scratch r: f32[1] {{
                %zero: i32 = constant 0 %one: i32 = constant 1 %three: i32 = constant 3
                %mask: u32 = constant 3
                %n: i32 = load scratch:n@0 %u: u32 = load scratch:u@0
                {index}
                return scratch:r@0 = %x
            }}"
        );
        let function: Function = text.parse().unwrap_or_else(|error| panic!("{error}"));
        rtsl_ir::verify::verify(&function).unwrap_or_else(|error| panic!("{error}"));
        let variables =
            |kind| function.variables.iter().filter(move |variable| variable.kind == kind);
        let layout = Layout::new(
            variables(VariableKind::Member),
            variables(VariableKind::Buffer),
            variables(VariableKind::Scratch),
        );
        let kernel = crate::lower(&function, &layout, CallMode::Stream, 8).unwrap();
        let ranges = Ranges::new(&kernel);
        let inside = kernel.body.ops.iter().find_map(|op| match op.kind {
            OpKind::Load(variable, Index::Dynamic(index)) => {
                Some(ranges.is_inside(&kernel, index, variable))
            }
            _ => None,
        });
        inside.expect("a load")
    }

    #[test]
    fn clamped_and_masked_indices_are_inside() {
        for index in [
            "%m: i32 = max %n, %zero %i: i32 = min %m, %three %x: f32 = load member:t@%i",
            "%i: i32 = and %n, %three %x: f32 = load member:t@%i",
            "%m: u32 = and %u, %mask %i: i32 = convert %m %x: f32 = load member:t@%i",
            "%a: i32 = and %n, %one %b: i32 = and %n, %one %s: i32 = add %a, %b
             %i: i32 = add %s, %one %x: f32 = load member:t@%i",
            "%l: i32 = length buffer:b %last: i32 = subtract %l, %one
             %m: i32 = max %n, %zero %i: i32 = min %m, %last %x: f32 = load buffer:b@%i",
        ] {
            assert!(is_inside(index), "{index}");
        }
    }

    #[test]
    fn indices_that_may_be_outside_are_not_inside() {
        for index in [
            "%x: f32 = load member:t@%n",
            "%i: i32 = min %n, %three %x: f32 = load member:t@%i",
            "%i: i32 = max %n, %zero %x: f32 = load member:t@%i",
            "%m: u32 = min %u, %mask %i: i32 = convert %m %j: i32 = add %i, %one
             %x: f32 = load member:t@%j",
            "%a: i32 = and %n, %three %i: i32 = add %a, %one %x: f32 = load member:t@%i",
            "%a: i32 = and %n, %three %i: i32 = subtract %a, %one %x: f32 = load member:t@%i",
            // Not bounded by the last element, or by the length of another buffer.
            "%l: i32 = length buffer:b %m: i32 = max %n, %zero %i: i32 = min %m, %l
             %x: f32 = load buffer:b@%i",
            "%l: i32 = length buffer:wide %last: i32 = subtract %l, %one
             %m: i32 = max %n, %zero %i: i32 = min %m, %last %x: f32 = load buffer:b@%i",
            // An element of two scalars.
            "%l: i32 = length buffer:wide %last: i32 = subtract %l, %one
             %m: i32 = max %n, %zero %i: i32 = min %m, %last %x: f32 = load buffer:wide@%i",
            "%l: i32 = length buffer:b %last: i32 = subtract %l, %one
             %i: i32 = min %n, %last %x: f32 = load buffer:b@%i",
        ] {
            assert!(!is_inside(index), "{index}");
        }
    }
}
