//! Operands that the prologue negates.
//!
//! The operand itself is splatted, in one instruction if it is in memory, and then negated. A fused multiply-add takes
//! it as it is, since the instruction can negate the product or the sum: so `c - a * a` with an `a` that all rays share
//! has one splat. A sum of lanes takes the negated splat: unlike a difference, it can read the lanes from memory.

use std::collections::BTreeMap;

use rtsl_ir::{Scalar, UnaryOp, Value};
use rtsl_packet::Kernel;
use rtsl_packet::kernel::{Op, OpKind};

use crate::emitter::Emitter;
use crate::operand::{LlvmType, Operand};

/// Returns the floats that the prologue negates, by the results.
pub fn negated_values(kernel: &Kernel) -> BTreeMap<Value, Value> {
    let negated = |op: &Op| match op.kind {
        OpKind::Unary(UnaryOp::Negate, value) if kernel.ty(value).scalar == Scalar::F32 => {
            Some((op.results.get(0), value))
        }
        _ => None,
    };
    kernel.prologue.ops.iter().filter_map(negated).collect()
}

impl Emitter<'_, '_> {
    /// Returns an operand of a fused multiply-add, negated just before it where the prologue negates it: the
    /// instruction then includes the negation.
    pub fn fma_operand(&mut self, ty: LlvmType, value: Value, lanes: bool) -> Operand {
        let has_instruction = self.module.target.fma && ty.is_vector();
        match self.values.negated.get(&value).copied().filter(|_| has_instruction) {
            None => self.operand(value, lanes),
            Some(value) => {
                let operand = self.operand(value, lanes);
                self.instruction(format_args!("fneg {ty} {operand}"))
            }
        }
    }
}
