//! What it costs to do an operation for all lanes, wanted or not.
//!
//! The unit is about one addition of a vector, 0.4 cycles among other work. The figures weigh
//! speculation against a branch; they need not be right for any one machine.

use rtsl_abi::CallMode;
use rtsl_ir::{BinaryOp, Index, Op, OpKind, Region, Scalar, UnaryOp, VariableKind};

use super::{Calls, Lowering};

/// For each lane, what may be done in vain rather than branched over: the more lanes, the less often
/// a branch saves anything.
const SPECULATION_LIMIT_OF_A_LANE: u32 = 8;

/// The most that is done in vain, however many lanes: about 25 cycles, those of a misprediction, of
/// testing a mask and of joining. On Zen 3 (W = 8, packets of 64) the triangle, whose three early outs
/// are 60 together, takes 1.42 ns a ray without branches and 1.51 with.
const MAX_SPECULATION_LIMIT: u32 = 64;

/// Up to this, both sides of a condition on which all rays agree are done.
pub const AGREED_SPECULATION_LIMIT: u32 = 3;

impl Lowering<'_> {
    /// Up to this, both sides of a condition that varies are done by all lanes, with no branch.
    pub(super) fn speculation_limit(&self) -> u32 {
        match self.calls {
            Calls::Large => {
                (SPECULATION_LIMIT_OF_A_LANE * self.kernel.width).min(MAX_SPECULATION_LIMIT)
            }
            // Under Embree spheres are 2 to 4 percent faster with the branches of one lane than with those of sixteen.
            Calls::OfOnePacket => SPECULATION_LIMIT_OF_A_LANE,
        }
    }

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
                if self.function.scalar(*a) == Scalar::F32 { 8 } else { 24 }
            }
            OpKind::Unary(UnaryOp::Sqrt, _) => 12,
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
            OpKind::Load(variable, index) => {
                let variable = self.kernel.variable(*variable);
                let in_lanes = match variable.variable.kind {
                    VariableKind::State | VariableKind::Scratch | VariableKind::Local => true,
                    VariableKind::Member | VariableKind::Parameter => {
                        variable.of_objects && self.kernel.shape == CallMode::Leaf
                    }
                    VariableKind::Buffer | VariableKind::Accepted => false,
                };
                if in_lanes && matches!(index, Index::Constant(_)) { 1 } else { 12 }
            }
            _ => 1,
        })
    }
}
