//! What can be done once per call.

use std::collections::BTreeSet;

use rtsl_abi::CallMode;
use rtsl_ir::{Value, VariableKind};

use super::Lowering;
use crate::kernel::{OpKind, Region};

impl Lowering<'_> {
    /// Whether an operation can be done in the prologue: it is uniform, all that it needs is there,
    /// and it is pure. Of a loop that is pure and uniform but might never end the caller must
    /// know that every ray comes by.
    ///
    /// Where the chunk is all there is, doing work before it saves none, and takes it out of the
    /// branches that might have left it out. So it is where a branch is seldom taken, unless it moves as a
    /// whole. Constants are no work.
    pub(super) fn is_hoistable(&self, kind: &OpKind) -> bool {
        match self.kernel.shape {
            _ if self.rare_sides > 0 => matches!(kind, OpKind::Constant(_)),
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream | CallMode::Leaf => {
                self.is_hoistable_among(kind, &mut BTreeSet::new())
            }
            CallMode::Single => matches!(kind, OpKind::Constant(_)),
        }
    }

    /// The same in a region, where the values `inside` were defined on the way.
    fn is_hoistable_among(&self, kind: &OpKind, inside: &mut BTreeSet<Value>) -> bool {
        let mut operands_there = true;
        kind.for_each_operand(|operand| {
            operands_there &= self.hoisted[operand.0 as usize] || inside.contains(&operand);
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
        region.yields.iter().all(|value| self.hoisted[value.0 as usize] || inside.contains(value))
    }

    /// Whether an operation itself gives the same wherever and how often it is done.
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

/// Whether an operation is a loop or holds one.
pub fn has_loop(kind: &OpKind) -> bool {
    matches!(kind, OpKind::Loop { .. })
        || kind.regions().any(|region| region.ops.iter().any(|op| has_loop(&op.kind)))
}
