//! The cost of speculating an operation in all lanes.
//!
//! The unit is about one vector addition, 0.4 cycles among other work. The figures weigh speculation against a branch;
//! they need not be exact for any one machine.

use rtsl_abi::CallMode;
use rtsl_ir::{BinaryOp, Index, Op, OpKind, Region, Scalar, UnaryOp, VariableKind};

use super::{Calls, Lowering};

/// The speculation limit per lane: the more lanes, the less often a branch is skipped.
const SPECULATION_LIMIT_OF_A_LANE: u32 = 8;

/// The greatest speculation limit at any width: about 25 cycles, those of a misprediction, of testing a mask and of
/// blending. On Zen 3 (W = 8, packets of 64) the triangle, whose three early outs have a cost of 60 together, takes
/// 1.42 ns per ray without branches and 1.51 with.
const MAX_SPECULATION_LIMIT: u32 = 64;

/// The greatest cost of the sides of a uniform condition that are both executed.
pub const AGREED_SPECULATION_LIMIT: u32 = 3;

impl Lowering<'_> {
    /// Returns the greatest cost of the sides of a varying condition that all lanes execute, without a branch.
    pub(super) fn speculation_limit(&self) -> u32 {
        match self.calls {
            Calls::Large => {
                (SPECULATION_LIMIT_OF_A_LANE * self.kernel.width).min(MAX_SPECULATION_LIMIT)
            }
            // In Embree spheres are 2 to 4 percent faster with the branches of one lane than with those of sixteen.
            Calls::OfOnePacket => SPECULATION_LIMIT_OF_A_LANE,
        }
    }

    /// Returns the cost of speculating `region`; `None` if it cannot be speculated.
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
            | OpKind::Query(..)
            | OpKind::ReferenceCall(_)
            | OpKind::IsSet(..)
            | OpKind::Seed(_)
            | OpKind::Derivative(..)
            | OpKind::ChainRule(..)
            | OpKind::ReferenceCount(_)
            | OpKind::Report(..)
            | OpKind::ReportBudget => return None,
            // Most likely hoisted to the prologue.
            _ if !varies && self.hoisting_saves_work() => return Some(0),
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
                        variable.of_objects && self.kernel.mode == CallMode::Leaf
                    }
                    VariableKind::Buffer | VariableKind::Accepted => false,
                };
                if in_lanes && matches!(index, Index::Constant(_)) { 1 } else { 12 }
            }
            _ => 1,
        })
    }
}
