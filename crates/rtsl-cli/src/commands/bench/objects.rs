//! The objects of calls, in the form that each shape takes.

use std::sync::Arc;

use rtsl::{Instance, InstanceTable, Instances, LaneIndices, MemberBlock, Program, Shape};

use super::random::Random;

/// Copies of the object that rays of the stream shape have one of each, so that they read different
/// memory.
const COPIES: usize = 16;

/// An object in all forms.
pub struct Objects {
    table: InstanceTable,
    indices: LaneIndices,
    members: MemberBlock,
}

impl Objects {
    /// Copies of `instance`: one for each lane, or fewer where lanes may share them.
    pub fn new(program: &Program, instance: &Instance, lanes: usize) -> Objects {
        let copies = |count: usize| -> Vec<_> {
            (0..count).map(|_| Arc::new(program.block(instance))).collect()
        };
        let (mut indices, mut random) = (LaneIndices::new(lanes), Random::new(lanes as u64));
        indices.as_mut_slice().iter_mut().for_each(|it| *it = random.below(COPIES) as u32);
        let (table, members) =
            (InstanceTable::new(copies(COPIES)), MemberBlock::new(copies(lanes)));
        Objects { table, indices, members }
    }

    /// The form that kernels of the shape take.
    pub fn of_shape(&self, shape: Shape) -> Instances<'_> {
        match shape {
            Shape::Packet | Shape::CommonOrigin | Shape::Single => {
                Instances::One(&self.table.blocks()[0])
            }
            Shape::Stream => Instances::Many(&self.table, &self.indices),
            Shape::Leaf => Instances::Range(&self.members, 0),
        }
    }
}
