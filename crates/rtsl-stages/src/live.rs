//! The values that a suspended path keeps.
//!
//! Control is structured, so that no equations have to be iterated. After a point the function executes what follows it
//! in its region, then what follows the operation that holds the region, and so on to the end of the body; around a
//! loop, perhaps the whole body of the loop again. A value is live at a point if it is visible there and used in one of
//! these places; in a body that is executed again, only uses of values defined outside of the loop count, as those
//! defined inside are defined anew.
//!
//! A live value is computed again instead of kept if its definition is cheap and its operands are live, or themselves
//! computed again, at no more than [`MAX_COST`] operations in total. Constants, lengths of buffers, numbers of lights
//! and loads from members, parameters and buffers at constant indices cost nothing, since every stage can read them.
//! Divisions, square roots and everything with an effect are kept. The surface that a point names needs no slots: the
//! stage gets it from the request.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_ir::{
    BinaryOp, Function, Index, IndexVec, Op, OpKind, ReferencePath, Region, UnaryOp, Value,
    VariableId, VariableKind,
};

use crate::points::{Level, Point, PointId, Scopes, definitions, operands};

/// The greatest number of operations by which a live value is computed again.
pub const MAX_COST: u32 = 4;

/// A scalar that passes through the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kept {
    Value(Value),
    /// A scalar of a local, which has dynamic indices.
    Local(VariableId, u32),
}

/// The state of a path that is suspended at a point.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Live {
    /// The scalars in the frame.
    pub kept: Vec<Kept>,
    /// The values that are computed again, in the order of their definitions.
    pub recomputed: Vec<Value>,
}

/// Computes the live values of points.
pub(crate) struct Liveness<'a> {
    function: &'a Function,
    definitions: IndexVec<Value, Option<&'a Op>>,
    scopes: Scopes,
}

impl<'a> Liveness<'a> {
    /// Returns the analysis of a function, whose values are numbered in the order of the text.
    pub fn new(function: &'a Function, scopes: Scopes) -> Self {
        Liveness { function, definitions: definitions(function), scopes }
    }

    /// Returns the operation that defines a value.
    pub fn definition(&self, value: Value) -> Option<&'a Op> {
        self.definitions[value]
    }

    /// Returns the live values of all points.
    pub fn of_points(&self, points: &BTreeMap<PointId, Point<'_>>) -> BTreeMap<PointId, Live> {
        points.iter().map(|(id, point)| (*id, self.of(point))).collect()
    }

    fn of(&self, point: &Point<'_>) -> Live {
        let mut uses = Uses::default();
        let mut from = point.after();
        for (depth, Level { region, index, .. }) in point.levels.iter().enumerate().rev() {
            debug_assert!(from >= *index);
            uses.after(self.function, region, from);
            if let Some(outer) = depth.checked_sub(1).map(|depth| point.levels[depth]) {
                if let OpKind::Loop { body, .. } = &outer.op().kind {
                    let level = |value| self.scopes.level(point, value);
                    uses.again(self.function, body, |it| level(it).is_some_and(|it| it < depth));
                }
                from = outer.index + 1;
            }
        }
        let mut live = Live::default();
        // The surface that a point names comes with the request.
        let surface: Vec<Value> = point.surface.into_iter().flatten().collect();
        let is_kept =
            |value: &Value| self.scopes.level(point, *value).is_some() && !surface.contains(value);
        for value in uses.values.iter().copied().filter(is_kept) {
            match self.cost(value, &uses.values, MAX_COST) {
                Some(_) => live.recomputed.push(value),
                None => live.kept.push(Kept::Value(value)),
            }
        }
        for local in uses.locals {
            let len = self.function.variable(local).len;
            live.kept.extend((0..len).map(|index| Kept::Local(local, index)));
        }
        live
    }

    /// Returns the number of operations by which a value is computed again from live ones; `None` if that is not
    /// possible, or takes more than `limit`.
    fn cost(&self, value: Value, live: &BTreeSet<Value>, limit: u32) -> Option<u32> {
        let op = self.definitions[value]?;
        let mut left = limit.checked_sub(self.own_cost(&op.kind)?)?;
        for operand in operands(op) {
            // A live operand is there, kept or computed again before.
            if !live.contains(&operand) {
                left -= self.cost(operand, live, left)?;
            }
        }
        Some(limit - left)
    }

    /// Returns the cost of an operation without that of its operands; `None` if it is not repeated.
    fn own_cost(&self, kind: &OpKind) -> Option<u32> {
        match kind {
            OpKind::Constant(_)
            | OpKind::Length(_)
            | OpKind::LightCount
            | OpKind::Ambient
            | OpKind::IsSet(_, ReferencePath::Single)
            | OpKind::ReferenceCount(_) => Some(0),
            OpKind::Query(query, _) if query.is_uniform() => Some(0),
            OpKind::Load(variable, index) => match self.function.variable(*variable).kind {
                // Every operation with operands costs something, which bounds the length of chains.
                VariableKind::Member | VariableKind::Parameter | VariableKind::Buffer => {
                    Some(matches!(index, Index::Dynamic(_)).into())
                }
                VariableKind::State
                | VariableKind::Scratch
                | VariableKind::Local
                | VariableKind::Accepted => None,
            },
            OpKind::Unary(op, _) => match op {
                UnaryOp::Negate
                | UnaryOp::Not
                | UnaryOp::Abs
                | UnaryOp::Floor
                | UnaryOp::Ceil
                | UnaryOp::Trunc
                | UnaryOp::RoundEven
                | UnaryOp::Seldom => Some(1),
                UnaryOp::Sqrt
                | UnaryOp::ApproximateReciprocal
                | UnaryOp::ApproximateInverseSqrt
                | UnaryOp::ApproximateSqrt => None,
            },
            OpKind::Binary(BinaryOp::Divide | BinaryOp::Remainder, ..) => None,
            OpKind::Binary(..)
            | OpKind::Compare(..)
            | OpKind::Select(..)
            | OpKind::Fma(..)
            | OpKind::Convert(..)
            | OpKind::Bitcast(..) => Some(1),
            OpKind::Store(..)
            | OpKind::If { .. }
            | OpKind::Loop { .. }
            | OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightSample { .. }
            | OpKind::Rand
            | OpKind::Query(..)
            | OpKind::ReferenceCall(_)
            | OpKind::IsSet(_, ReferencePath::Element(_))
            | OpKind::Seed(_)
            | OpKind::Derivative(..)
            | OpKind::ChainRule(..)
            | OpKind::Report(..)
            | OpKind::ReportBudget => None,
        }
    }
}

/// The values and locals that are used in the places executed after a point.
#[derive(Default)]
struct Uses {
    values: BTreeSet<Value>,
    locals: BTreeSet<VariableId>,
}

impl Uses {
    /// Adds the uses in a region from an operation on.
    fn after(&mut self, function: &Function, region: &Region, from: usize) {
        for op in &region.ops[from..] {
            op.kind.for_each_operand(|value| {
                self.values.insert(value);
            });
            self.load(function, op);
            for region in op.kind.regions() {
                self.after(function, region, 0);
            }
        }
        self.values.extend(&region.yields);
    }

    /// Adds the uses in the body of a loop that is executed again of values defined outside.
    fn again(&mut self, function: &Function, body: &Region, is_outside: impl Fn(Value) -> bool) {
        body.for_each_use(&mut |value| {
            if is_outside(value) {
                self.values.insert(value);
            }
        });
        body.for_each_op(&mut |op| self.load(function, op));
    }

    fn load(&mut self, function: &Function, op: &Op) {
        if let OpKind::Load(variable, _) = op.kind
            && function.variable(variable).kind == VariableKind::Local
        {
            self.locals.insert(variable);
        }
    }
}
