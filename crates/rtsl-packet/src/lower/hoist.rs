//! Hoisting of operations to the prologue, which runs once per call.

use std::collections::BTreeSet;

use rtsl_abi::CallMode;
use rtsl_ir::{Value, VariableId, VariableKind};

use super::Lowering;
use crate::kernel::{OpKind, Region};

impl Lowering<'_> {
    /// True if an operation can be moved to the prologue: it is uniform, its operands are in the prologue, and it is
    /// pure. For a pure and uniform loop that might never end the caller must ensure that every ray executes it.
    /// Constants are always hoisted, and what all lanes read of a ray, since other chunks may store to it.
    pub(super) fn is_hoistable(&self, kind: &OpKind) -> bool {
        let must_move = match kind {
            OpKind::Constant(_) => true,
            OpKind::Load(variable, _) => {
                self.kernel.mode != CallMode::Single && self.is_of_ray(*variable)
            }
            _ => false,
        };
        (must_move || self.hoisting_saves_work())
            && self.is_hoistable_among(kind, &mut BTreeSet::new())
    }

    /// False where the call has only one chunk: hoisting would save no work, and execute operations outside of branches
    /// that might have skipped them. The same holds for rarely taken branches, unless they move as a whole, and for
    /// branches of leaves, whose few objects mostly are one chunk.
    pub(super) fn hoisting_saves_work(&self) -> bool {
        match self.kernel.mode {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream => self.rare_sides == 0,
            CallMode::Leaf => self.rare_sides == 0 && self.depth == 0,
            CallMode::Single => false,
        }
    }

    fn is_of_ray(&self, variable: VariableId) -> bool {
        let kind = self.kernel.variable(variable).variable.kind;
        matches!(kind, VariableKind::State | VariableKind::Scratch)
    }

    /// Like `is_hoistable` for an operation in a region, where the values `inside` are defined in that region.
    fn is_hoistable_among(&self, kind: &OpKind, inside: &mut BTreeSet<Value>) -> bool {
        let mut operands_there = true;
        kind.for_each_operand(|operand| {
            operands_there &= self.hoisted[operand] || inside.contains(&operand);
        });
        operands_there
            && self.is_pure(kind)
            && kind.regions().all(|region| self.is_region_hoistable(region, inside))
    }

    fn is_region_hoistable(&self, region: &Region, inside: &mut BTreeSet<Value>) -> bool {
        let uniform = |value: &Value| !self.ty(*value).lanes;
        if !region.params.iter().all(uniform) {
            return false;
        }
        inside.extend(&region.params);
        for op in &region.ops {
            let results_uniform = op.results.iter().all(|result| uniform(&result));
            if !results_uniform || !self.is_hoistable_among(&op.kind, inside) {
                return false;
            }
            inside.extend(op.results.iter());
        }
        region.yields.iter().all(|value| self.hoisted[*value] || inside.contains(value))
    }

    /// True if the result of an operation does not depend on its position or the number of executions.
    fn is_pure(&self, kind: &OpKind) -> bool {
        match kind {
            OpKind::Constant(_)
            | OpKind::Unary(..)
            | OpKind::Binary(..)
            | OpKind::Compare(..)
            | OpKind::Select(..)
            | OpKind::Fma(..)
            | OpKind::Convert(..)
            | OpKind::Bitcast(..)
            | OpKind::Reinterpret(..)
            | OpKind::Length(_)
            | OpKind::If { .. }
            | OpKind::Loop { .. }
            | OpKind::LightCount
            | OpKind::Ambient => true,
            OpKind::Query { mask, .. } => mask.is_none(),
            OpKind::Load(variable, _) => {
                self.kernel.variable(*variable).variable.kind != VariableKind::Local
            }
            OpKind::Unspecified
            | OpKind::Any(_)
            | OpKind::First(..)
            | OpKind::Store { .. }
            | OpKind::Trace { .. }
            | OpKind::Occluded { .. }
            | OpKind::LightSample { .. }
            | OpKind::Rand(_)
            | OpKind::ReportBudget => false,
        }
    }
}

/// True if an operation is a loop or contains one.
pub fn has_loop(kind: &OpKind) -> bool {
    matches!(kind, OpKind::Loop { .. })
        || kind.regions().any(|region| region.ops.iter().any(|op| has_loop(&op.kind)))
}
