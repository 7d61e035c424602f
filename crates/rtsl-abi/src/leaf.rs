//! The arguments of `intersect` in the leaf mode, in a form with little overhead per call.

use rtsl_ir::host::Host;

use crate::lanes::LaneBlock;
use crate::offsets::NO_OBJECT;

/// A test of one ray against consecutive objects, for the one with the nearest hit.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LeafTest {
    /// The lane of the ray in state and scratch. A hit changes it, so a call has only one test per lane.
    pub ray: u32,
    /// The index of the first object, a multiple of [`OBJECTS_IN_BLOCK`](crate::offsets::OBJECTS_IN_BLOCK).
    pub first: u32,
    /// The index of the object with the nearest hit, after the test.
    pub(crate) nearest: u32,
}

/// The arguments of a call of a leaf kernel.
pub struct LeafArguments<'a> {
    /// The rays, as in [`CallArguments`](crate::CallArguments::state). The outputs of the nearest hit are stored there.
    pub state: &'a mut LaneBlock,
    /// The rays' scratch.
    pub scratch: &'a mut LaneBlock,
    /// The number of objects of each test.
    pub count: u32,
    /// The tests.
    pub tests: &'a mut [LeafTest],
    /// The host, which answers the shader's requests.
    pub host: &'a mut dyn Host,
}

impl LeafTest {
    /// Returns a test of the ray in this lane with the objects from this index on.
    #[inline(always)]
    pub fn new(ray: u32, first: u32) -> LeafTest {
        LeafTest { ray, first, nearest: NO_OBJECT }
    }

    /// Returns the index of the object with the nearest hit, of equally near ones the lowest; `None` if there is no
    /// hit.
    #[inline(always)]
    pub fn nearest(&self) -> Option<u32> {
        (self.nearest != NO_OBJECT).then_some(self.nearest)
    }

    /// Stores the result of the test.
    pub fn set_nearest(&mut self, nearest: Option<u32>) {
        self.nearest = nearest.unwrap_or(NO_OBJECT);
    }
}
