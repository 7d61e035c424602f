//! Which integers an index can be: what is known to lie inside a place need not be clamped again.
//!
//! A forward analysis in one pass, for values are defined before their uses; what loops carry is
//! unknown. Integers of both types are followed as i32: a u32 is known only while it is less than 2^31.

use rtsl_ir::{BinaryOp, Constant, PlaceId, PlaceKind, Scalar, Value};

use crate::Kernel;
use crate::kernel::{OpKind, Region};

/// What is known of an integer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Range {
    low: i32,
    high: i32,
    /// It is at most the length of this buffer.
    within: Option<Bound>,
}

/// At most the length of a buffer less something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Bound {
    buffer: PlaceId,
    below: i32,
}

impl Range {
    const UNKNOWN: Range = Range::new(i32::MIN, i32::MAX);

    const fn new(low: i32, high: i32) -> Range {
        Range { low, high, within: None }
    }

    /// Bounds that fit an i32, else nothing: the operation may wrap.
    fn fitting(low: i64, high: i64) -> Range {
        match (i32::try_from(low), i32::try_from(high)) {
            (Ok(low), Ok(high)) => Range::new(low, high),
            _ => Range::UNKNOWN,
        }
    }
}

/// The integers that the values of a kernel can be.
pub struct Ranges {
    of: Vec<Range>,
}

impl Ranges {
    /// Analyses `kernel`.
    pub fn new(kernel: &Kernel) -> Ranges {
        let mut ranges = Ranges { of: vec![Range::UNKNOWN; kernel.values.len()] };
        ranges.region(kernel, &kernel.prologue);
        ranges.region(kernel, &kernel.body);
        ranges
    }

    /// Whether `index` is an index of a scalar of the place. For a buffer it may be -1 where that is
    /// empty.
    pub fn is_inside(&self, kernel: &Kernel, index: Value, place: PlaceId) -> bool {
        let (range, declared) = (self.get(index), &kernel.place(place).place);
        match declared.kind {
            // An index of an element is one of a scalar only where they are the same.
            PlaceKind::Buffer => {
                let below = range.within.is_some_and(|it| it.buffer == place && it.below >= 1);
                below && declared.len == 1 && range.low >= -1
            }
            PlaceKind::State
            | PlaceKind::Scratch
            | PlaceKind::Member
            | PlaceKind::Parameter
            | PlaceKind::Slot
            | PlaceKind::Accepted => range.low >= 0 && (range.high as u32) < declared.len,
        }
    }

    fn get(&self, value: Value) -> Range {
        self.of[value.0 as usize]
    }

    fn region(&mut self, kernel: &Kernel, region: &Region) {
        for op in &region.ops {
            op.kind.regions().for_each(|region| self.region(kernel, region));
            if op.results.count == 1 {
                let result = op.results.get(0);
                self.of[result.0 as usize] = self.result(kernel, &op.kind, result);
            }
        }
    }

    fn result(&self, kernel: &Kernel, kind: &OpKind, result: Value) -> Range {
        let signed = kernel.ty(result).scalar == Scalar::I32;
        match kind {
            OpKind::Constant(Constant::I32(value)) => Range::new(*value, *value),
            OpKind::Constant(Constant::U32(value)) => {
                Range::fitting(i64::from(*value), i64::from(*value))
            }
            OpKind::Length(buffer) => Range {
                within: Some(Bound { buffer: *buffer, below: 0 }),
                ..Range::new(0, i32::MAX)
            },
            OpKind::Binary(op, a, b) => self.binary(*op, *a, *b, signed),
            OpKind::Select(_, a, b) => self.join(*a, *b),
            OpKind::Convert(Scalar::I32 | Scalar::U32, a) => self.same_bits(kernel, *a),
            _ => Range::UNKNOWN,
        }
    }

    /// What is known of an integer of the other type with the bits of `a`.
    fn same_bits(&self, kernel: &Kernel, a: Value) -> Range {
        let from_integer = matches!(kernel.ty(a).scalar, Scalar::I32 | Scalar::U32);
        let range = self.get(a);
        if from_integer && range.low >= 0 { range } else { Range::UNKNOWN }
    }

    fn join(&self, a: Value, b: Value) -> Range {
        let (a, b) = (self.get(a), self.get(b));
        Range::new(a.low.min(b.low), a.high.max(b.high))
    }

    fn binary(&self, op: BinaryOp, a: Value, b: Value, signed: bool) -> Range {
        let (x, y) = (self.get(a), self.get(b));
        // A u32 of which nothing is known compares as a large number, not as a negative one.
        let ordered = signed || (x.low >= 0 && y.low >= 0);
        match op {
            BinaryOp::Add => Range::fitting(
                i64::from(x.low) + i64::from(y.low),
                i64::from(x.high) + i64::from(y.high),
            ),
            BinaryOp::Subtract => {
                let fitting = Range::fitting(
                    i64::from(x.low) - i64::from(y.high),
                    i64::from(x.high) - i64::from(y.low),
                );
                let within = x.within.filter(|_| y.low > 0 && fitting != Range::UNKNOWN);
                Range { within: within.map(|it| Bound { below: y.low, ..it }), ..fitting }
            }
            BinaryOp::And if x.low >= 0 || y.low >= 0 => {
                let known = [x, y].into_iter().filter(|range| range.low >= 0);
                Range::new(0, known.map(|range| range.high).min().unwrap_or(i32::MAX))
            }
            BinaryOp::Min if ordered => Range {
                within: x.within.or(y.within),
                ..Range::new(x.low.min(y.low), x.high.min(y.high))
            },
            BinaryOp::Max if ordered => Range::new(x.low.max(y.low), x.high.max(y.high)),
            _ => Range::UNKNOWN,
        }
    }
}

#[cfg(test)]
mod tests {
    use rtsl_ir::{Function, Index, PlaceKind};

    use super::*;
    use crate::{Layout, Shape};

    /// Whether the index of the one load with a dynamic one is known to be inside.
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
        let places = |kind| function.places.iter().filter(move |place| place.kind == kind);
        let layout = Layout::new(
            places(PlaceKind::Member),
            places(PlaceKind::Buffer),
            places(PlaceKind::Scratch),
        );
        let kernel = crate::lower(&function, &layout, Shape::Stream, 8).unwrap();
        let ranges = Ranges::new(&kernel);
        let inside = kernel.body.ops.iter().find_map(|op| match op.kind {
            OpKind::Load(place, Index::Dynamic(index)) => {
                Some(ranges.is_inside(&kernel, index, place))
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
            // Not the last element, and not this buffer's.
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
