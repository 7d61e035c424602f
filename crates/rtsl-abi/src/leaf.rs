//! The arguments of `intersect` in the leaf shape, whose calls have little to do each.

use rtsl_ir::host::Host;

use crate::lanes::LaneBlock;
use crate::offsets::NO_OBJECT;

/// One ray and some objects in a row, of which the one with the nearest hit is wanted.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LeafTest {
    /// The lane of the ray in state and scratch, which a hit changes: so a call has one test of a lane.
    pub ray: u32,
    /// The number of the first object, a multiple of
    /// [`OBJECTS_IN_BLOCK`](crate::offsets::OBJECTS_IN_BLOCK).
    pub first: u32,
    /// The number of the object with the nearest hit, once the test is made.
    pub(crate) nearest: u32,
}

/// The arguments of a call of a leaf kernel.
pub struct LeafArguments<'a> {
    /// The rays, as in [`CallArguments`](crate::CallArguments::state). What the nearest hit gave is left there.
    pub state: &'a mut LaneBlock,
    /// The rays' scratch.
    pub scratch: &'a mut LaneBlock,
    /// How many objects each test has.
    pub count: u32,
    /// What is to be tested.
    pub tests: &'a mut [LeafTest],
    /// Answers the shader's questions.
    pub host: &'a mut dyn Host,
}

impl LeafTest {
    /// The ray of this lane and the objects from this number on.
    #[inline(always)]
    pub fn new(ray: u32, first: u32) -> LeafTest {
        LeafTest { ray, first, nearest: NO_OBJECT }
    }

    /// The number of the object with the nearest hit, of equally near ones the lowest; `None` if there is no
    /// hit.
    #[inline(always)]
    pub fn nearest(&self) -> Option<u32> {
        (self.nearest != NO_OBJECT).then_some(self.nearest)
    }

    /// Notes what the test found.
    pub fn set_nearest(&mut self, nearest: Option<u32>) {
        self.nearest = nearest.unwrap_or(NO_OBJECT);
    }
}
