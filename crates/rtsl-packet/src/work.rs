//! The work that a kernel is for a code generator.
//!
//! LLVM's register allocation and scheduling take time by the square of a function's length and worse: a method of 28,000
//! operations in a row takes 24 seconds, one of 11,000 three (LLVM 22, 8 lanes, Zen 3). Straight code generation takes
//! time by the length: one second and a half. So methods are counted, long ones are compiled straight, and beyond
//! [`MAX_WORK`] they are refused. What counts is the packet code before it is made for a width or a target: where a method
//! is refused, it is refused on every machine.

use rtsl_ir::{BinaryOp, Index, Scalar, Value};

use crate::Kernel;
use crate::kernel::{OpKind, Region};

/// The most work that a kernel may be, in operations.
pub const MAX_WORK: u64 = 1 << 16;

/// Operations that no vector instruction does, such as access by an index that differs from ray to ray, become a piece of
/// code for every lane.
const WORK_OF_LANES: u64 = 16;

/// An output is loaded, blended and stored.
const WORK_OF_OUTPUT: u64 = 4;

impl Kernel {
    /// The work of generating its code, in operations. It is the same for every width.
    pub fn work(&self) -> u64 {
        let outputs = WORK_OF_OUTPUT * self.outputs.len() as u64;
        outputs + self.region_work(&self.prologue) + self.region_work(&self.body)
    }

    fn region_work(&self, region: &Region) -> u64 {
        let inner = |kind: &OpKind| kind.regions().map(|it| self.region_work(it)).sum::<u64>();
        region.ops.iter().map(|op| self.op_work(&op.kind) + inner(&op.kind)).sum()
    }

    fn op_work(&self, kind: &OpKind) -> u64 {
        let varies = |value: Value| self.ty(value).lanes;
        let by_lanes = match kind {
            OpKind::Load(_, Index::Dynamic(index))
            | OpKind::Store { variable: _, index: Index::Dynamic(index), value: _, mask: _ } => {
                varies(*index)
            }
            OpKind::Binary(BinaryOp::Divide | BinaryOp::Remainder, a, b) => {
                self.ty(*a).scalar != Scalar::F32 && (varies(*a) || varies(*b))
            }
            _ => false,
        };
        if by_lanes { WORK_OF_LANES } else { 1 }
    }
}
