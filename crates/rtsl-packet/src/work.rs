//! The work of generating code for a kernel.
//!
//! The time of LLVM's register allocation and scheduling grows with the square of a function's length or worse: a
//! method of 28,000 operations without branches takes 24 seconds, one of 11,000 three (LLVM 22, 8 lanes, Zen 3). The
//! time of unoptimised code generation is linear: one second and a half. So methods are measured, long ones are
//! compiled without optimisation, and beyond [`MAX_WORK`] they are rejected. The measure is taken on packet code before
//! it is specialised for a width or a target: a method that is rejected is rejected on every machine.

use rtsl_ir::{BinaryOp, Index, Scalar, Value};

use crate::Kernel;
use crate::kernel::{OpKind, Region};

/// The greatest work of a kernel, in operations.
pub const MAX_WORK: u64 = 1 << 17;

/// The work of operations without a vector instruction, such as accesses by a varying index, which become a sequence of
/// code per lane.
const WORK_OF_LANES: u64 = 16;

/// The work of an output, which is loaded, blended and stored.
const WORK_OF_OUTPUT: u64 = 4;

impl Kernel {
    /// Returns the work of generating the kernel's code, in operations. It is the same for every width.
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
