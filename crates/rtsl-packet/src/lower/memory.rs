//! Loads and stores.

use rtsl_abi::CallMode;
use rtsl_ir::{BinaryOp, CompareOp, Constant, Index, Scalar, Value, VariableId, VariableKind};

use super::Lowering;
use crate::kernel::OpKind;

/// The greatest number of scalars for which a dynamic index becomes selects among constant ones, so that a vector
/// indexed dynamically is not stored to memory.
const CHAIN_LIMIT: u32 = 4;

impl Lowering<'_> {
    pub(super) fn lower_load(&mut self, id: VariableId, index: Index) -> Value {
        let index = self.index(index);
        let variable = self.kernel.variable(id);
        let (scalar, len, kind) =
            (variable.variable.scalar, variable.variable.len, variable.variable.kind);
        let index_lanes = match index {
            Index::Constant(_) => false,
            Index::Dynamic(value) => self.ty(value).lanes,
        };
        let chain = match kind {
            VariableKind::State | VariableKind::Scratch | VariableKind::Local => true,
            // A vector of each member's scalars is one load, like a state variable in other modes.
            VariableKind::Member if variable.of_objects && self.kernel.mode == CallMode::Leaf => {
                true
            }
            // A gather of members in lanes also takes an index in lanes.
            VariableKind::Member | VariableKind::Parameter => index_lanes && !variable.varies,
            VariableKind::Buffer | VariableKind::Accepted => false,
        };
        match index {
            Index::Dynamic(index) if chain && len <= CHAIN_LIMIT => {
                self.load_by_choice(id, scalar, len, index)
            }
            index => self.pure(OpKind::Load(id, index), scalar),
        }
    }

    fn load_by_choice(&mut self, id: VariableId, scalar: Scalar, len: u32, index: Value) -> Value {
        let mut chosen = self.pure(OpKind::Load(id, Index::Constant(0)), scalar);
        for position in 1..len {
            let element = self.pure(OpKind::Load(id, Index::Constant(position)), scalar);
            let position = self.constant(Constant::I32(position as i32));
            let reached = self.compare(CompareOp::GreaterEqual, index, position);
            chosen = self.select(reached, element, chosen);
        }
        chosen
    }

    pub(super) fn lower_store(&mut self, id: VariableId, index: Index, value: Value) {
        let (index, value) = (self.index(index), self.value(value));
        let local = self.kernel.variable(id);
        let (scalar, len) = (local.variable.scalar, local.variable.len);
        let mask = (local.varies && self.diverged).then_some(self.mask);
        match index {
            Index::Dynamic(index) if len <= CHAIN_LIMIT => {
                self.store_by_choice(id, scalar, len, index, value, mask);
            }
            index => self.store(id, index, value, mask),
        }
    }

    fn store(&mut self, variable: VariableId, index: Index, value: Value, mask: Option<Value>) {
        self.push(OpKind::Store { variable, index, value, mask }, &[], false);
    }

    fn store_by_choice(
        &mut self,
        id: VariableId,
        scalar: Scalar,
        len: u32,
        index: Value,
        value: Value,
        mask: Option<Value>,
    ) {
        for position in 0..len {
            let chosen = self.is_clamped_to(index, position, len);
            let chosen = match (chosen, mask) {
                (Some(chosen), Some(mask)) => {
                    Some(self.pure(OpKind::Binary(BinaryOp::And, chosen, mask), Scalar::Bool))
                }
                (chosen, mask) => chosen.or(mask),
            };
            let old = self.pure(OpKind::Load(id, Index::Constant(position)), scalar);
            let new = match chosen {
                Some(chosen) => self.select(chosen, value, old),
                None => value,
            };
            self.store(id, Index::Constant(position), new, None);
        }
    }

    /// Adds the condition that `index` clamped to `len` is `position`; `None` if it is always true.
    fn is_clamped_to(&mut self, index: Value, position: u32, len: u32) -> Option<Value> {
        let op = match position {
            0 if len == 1 => return None,
            0 => CompareOp::LessEqual,
            last if last + 1 == len => CompareOp::GreaterEqual,
            _ => CompareOp::Equal,
        };
        let position = self.constant(Constant::I32(position as i32));
        Some(self.compare(op, index, position))
    }
}
