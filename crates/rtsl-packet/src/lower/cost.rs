//! What it costs to do an operation for all lanes, wanted or not.
//!
//! The unit is about one addition of a vector. The figures weigh speculation against a branch; they
//! need not be right for any one machine.

use rtsl_ir::{BinaryOp, Index, Op, OpKind, PlaceKind, Region, Scalar, UnaryOp};

use super::Lowering;

/// Up to this, both sides of a condition that varies are done by all lanes, with no branch: it is
/// about what testing a mask, jumping and joining cost, mispredictions included.
pub const SPECULATION_LIMIT: u32 = 16;

/// Up to this, both sides of a condition on which all rays agree are done.
pub const AGREED_SPECULATION_LIMIT: u32 = 3;

impl Lowering<'_> {
    /// What doing `region` in vain costs; `None` if that cannot be done.
    pub(super) fn speculation_cost(&self, region: &Region) -> Option<u32> {
        let costs = region.ops.iter().map(|op| self.op_cost(op));
        costs.sum()
    }

    fn op_cost(&self, op: &Op) -> Option<u32> {
        let varies = op.results.iter().any(|result| self.uniformity.varies(result));
        match &op.kind {
            OpKind::If { condition: _, then, otherwise } => {
                let sides = self.speculation_cost(then)? + self.speculation_cost(otherwise)?;
                return Some(sides + op.results.count);
            }
            OpKind::Loop { .. }
            | OpKind::Store(..)
            | OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightSample { .. }
            | OpKind::Rand
            | OpKind::ReferenceCall(_)
            | OpKind::IsSet(..)
            | OpKind::ReportBudget => return None,
            // Most likely done in the prologue.
            _ if !varies => return Some(0),
            _ => {}
        }
        Some(match &op.kind {
            OpKind::Binary(BinaryOp::Divide | BinaryOp::Remainder, a, _) => {
                if self.function.scalar(*a) == Scalar::F32 { 5 } else { 24 }
            }
            OpKind::Unary(UnaryOp::Sqrt, _) => 6,
            OpKind::Unary(
                UnaryOp::ApproximateReciprocal
                | UnaryOp::ApproximateInverseSqrt
                | UnaryOp::ApproximateSqrt,
                _,
            ) => 4,
            OpKind::Convert(Scalar::I32 | Scalar::U32, a)
                if self.function.scalar(*a) == Scalar::F32 =>
            {
                5
            }
            OpKind::Load(place, index) => {
                let in_lanes = match self.function.place(*place).kind {
                    PlaceKind::State | PlaceKind::Scratch | PlaceKind::Slot => true,
                    PlaceKind::Member
                    | PlaceKind::Parameter
                    | PlaceKind::Buffer
                    | PlaceKind::Accepted => false,
                };
                if in_lanes && matches!(index, Index::Constant(_)) { 1 } else { 12 }
            }
            _ => 1,
        })
    }
}
