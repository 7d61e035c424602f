//! Parts of leaves.

use rtsl_ir::Value;

/// Some of the scalars of one leaf.
#[derive(Clone, Debug)]
pub(crate) struct LeafPart {
    pub leaf: usize,
    /// The dynamic terms of the address: clamped indices, and their strides.
    pub terms: Vec<(Value, u32)>,
    /// The positions in the leaf, to which the terms are added.
    pub positions: Positions,
}

#[derive(Clone, Debug)]
pub(crate) enum Positions {
    Range { start: u32, len: u32 },
    List(Vec<u32>),
}

impl Positions {
    pub fn iter(&self) -> Box<dyn Iterator<Item = u32> + '_> {
        match self {
            Positions::Range { start, len } => Box::new(*start..start + len),
            Positions::List(list) => Box::new(list.iter().copied()),
        }
    }
}
