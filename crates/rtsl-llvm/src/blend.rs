//! Masked stores on x86 processors without mask registers.
//!
//! Such a store is a load, a blend and a store. LLVM combines the three into one masked store, which is slower on half
//! of the machines (12 cycles on Zen 3), but not if the blend is its target intrinsic. The operand that the blend takes
//! where the mask is set may be in memory. So the mask selects the lanes that are preserved, and the load is folded
//! into the blend: this takes 3 % off the triangle, which has four such stores.

use crate::emitter::Emitter;
use crate::operand::{LlvmType, Operand};

/// The number of lanes of a blend.
const LANES: u32 = 8;

impl Emitter<'_, '_> {
    /// True if [`Emitter::store_except`] has the instruction.
    pub fn blends_with_memory(&self) -> bool {
        let has_vectors = self.width.is_multiple_of(LANES);
        self.values.masks_in_lanes && self.module.target.blends && has_vectors
    }

    /// Stores `new` where the words of the mask `kept` are 0.
    pub fn store_except(&mut self, kept: Operand, ty: LlvmType, new: Operand, at: Operand) {
        let floats = LlvmType { element: "float", count: LANES };
        for first in (0..ty.count).step_by(LANES as usize) {
            let at = self.offset(at, 4 * first);
            let new = self.lanes_as_floats(ty, new, first);
            let kept = self.lanes_as_floats(ty.of("i32"), kept, first);
            let old = self.instruction(format_args!("load {floats}, ptr {at}, align 4"));
            let arguments = [(floats, new), (floats, old), (floats, kept)];
            let merged = self.intrinsic("llvm.x86.avx.blendv.ps.256", floats, &arguments);
            self.effect(format_args!("store {floats} {merged}, ptr {at}, align 4"));
        }
    }

    /// Returns the lanes from `first` on that one blend takes, as floats.
    fn lanes_as_floats(&mut self, ty: LlvmType, lanes: Operand, first: u32) -> Operand {
        let part = LlvmType { count: LANES, ..ty };
        let lanes = if ty.count == LANES {
            lanes
        } else {
            let numbers = (first..first + LANES).map(|lane| format!("i32 {lane}"));
            let numbers = numbers.collect::<Vec<_>>().join(", ");
            let order = part.of("i32");
            self.instruction(format_args!(
                "shufflevector {ty} {lanes}, {ty} poison, {order} <{numbers}>"
            ))
        };
        match ty.element {
            "float" => lanes,
            _ => self.instruction(format_args!("bitcast {part} {lanes} to {}", part.of("float"))),
        }
    }
}
