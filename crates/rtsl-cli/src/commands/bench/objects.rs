//! The objects of calls, in the form that each call mode takes.

use rtsl::{CallMode, Instance, InstanceBlock, Instances, LaneIndices, Program};

use super::random::Random;

/// The number of copies of the object for the stream call mode, so that rays read different memory.
const COPIES: usize = 16;

/// An object in all forms.
pub struct Objects {
    block: InstanceBlock,
    copies: rtsl::Objects,
    indices: LaneIndices,
}

impl Objects {
    /// Creates copies of `instance`: one for each lane, and enough for rays that share them.
    pub fn new(program: &Program, instance: &Instance, lanes: usize) -> Objects {
        let copies = program.objects(std::iter::repeat_n(instance, lanes.max(COPIES)));
        let (mut indices, mut random) = (LaneIndices::new(lanes), Random::new(lanes as u64));
        indices.as_mut_slice().iter_mut().for_each(|it| *it = random.below(COPIES) as u32);
        Objects { block: program.block(instance), copies, indices }
    }

    /// Returns the form that kernels of the call mode take.
    pub fn of_mode(&self, mode: CallMode) -> Instances<'_> {
        match mode {
            CallMode::Packet | CallMode::CommonOrigin | CallMode::Single => {
                Instances::One(&self.block)
            }
            CallMode::Stream => Instances::Many(&self.copies, &self.indices),
            CallMode::Leaf => Instances::Range(&self.copies, 0),
        }
    }
}
