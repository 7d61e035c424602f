//! The arguments of a call, for callers and in the form that machine code reads.

use std::ffi::c_void;
use std::mem::MaybeUninit;

use rtsl_ir::host::Host;

use crate::host_table::HostTable;
use crate::instance::InstanceBlock;
use crate::lanes::{LaneBlock, LaneIndices, LaneMask};
use crate::leaf::LeafTest;
use crate::objects::Objects;

/// The arguments of a call of a kernel for `count` rays.
pub struct CallArguments<'a> {
    /// The arrays of the state components, by component index; the kernel's [signature](crate::Signature::state) lists
    /// those that it needs.
    pub state: &'a mut LaneBlock,
    /// The arrays of scratch, one for each scalar of the class's scratch.
    pub scratch: &'a mut LaneBlock,
    /// The number of rays, at most the lanes of the blocks; 1 for the single mode, the number of objects for the leaf
    /// mode.
    pub count: usize,
    /// The mask of the rays; all are active if `None`. The state of inactive rays does not change. The single mode
    /// takes none.
    pub mask: Option<&'a LaneMask>,
    /// For `intersect`: the kernel stores the mask of rays with a hit, with false for inactive rays. The leaf mode
    /// returns [`CallStatus::nearest`] instead.
    pub accepted: Option<&'a mut LaneMask>,
    /// The objects, in the form that the kernel's call mode requires.
    pub instances: Instances<'a>,
    /// The host, which answers the shader's requests.
    pub host: &'a mut dyn Host,
}

/// The instance or objects whose method is called.
#[derive(Clone, Copy)]
pub enum Instances<'a> {
    /// One instance for all rays: for kernels of the modes packet, common origin and single without objects.
    One(&'a InstanceBlock),
    /// The object with this index for all rays: for kernels of the same modes with objects.
    Object(&'a Objects, u32),
    /// An object for each ray, by its index: for the stream mode.
    Many(&'a Objects, &'a LaneIndices),
    /// A range of objects whose first index is a multiple of [`OBJECTS_IN_BLOCK`](crate::offsets::OBJECTS_IN_BLOCK):
    /// for the leaf mode. The ray is lane 0 of state and scratch. `intersect` stores the results for the object with
    /// the nearest hit there. Other methods store the results for the `i`th object in lane `i`: all variables that they
    /// assign, including those with the value of the ray's lane.
    Range(&'a Objects, u32),
}

impl<'a> Instances<'a> {
    /// Returns the block of the one instance, or the one that the objects share.
    #[inline(always)]
    pub fn block(self) -> &'a InstanceBlock {
        match self {
            Instances::One(block) => block,
            Instances::Object(objects, _)
            | Instances::Many(objects, _)
            | Instances::Range(objects, _) => objects.shared(),
        }
    }

    /// Returns the objects; `None` for one instance.
    #[inline(always)]
    pub fn objects(self) -> Option<&'a Objects> {
        match self {
            Instances::One(_) => None,
            Instances::Object(objects, _)
            | Instances::Many(objects, _)
            | Instances::Range(objects, _) => Some(objects),
        }
    }

    /// Returns the index of a lane's object; `None` for one instance.
    ///
    /// # Panics
    /// If there is no such lane.
    pub fn number(self, lane: usize) -> Option<u32> {
        match self {
            Instances::One(_) => None,
            Instances::Object(_, number) => Some(number),
            Instances::Many(_, indices) => Some(indices.as_slice()[lane]),
            Instances::Range(_, first) => Some(first + lane as u32),
        }
    }
}

/// The result of a call, apart from the stored values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[must_use]
pub struct CallStatus {
    /// True if a ray used up its budget of loop iterations; its results are those of the truncated loop.
    pub budget_exhausted: bool,
    /// The index of the object with the nearest hit, in the leaf mode; of equally near ones the lowest.
    pub nearest: Option<u32>,
}

/// The call as machine code reads it; see [`offsets`](crate::offsets). Fields that only some call modes read are left
/// uninitialised for the others.
#[repr(C)]
pub struct RawCall {
    /// The lane arrays of the state, by component; null for components that code does not access.
    pub state: *const *mut u32,
    /// The lane arrays of scratch.
    pub scratch: *const *mut u32,
    /// The mask, 0 or -1 per ray; null if all rays are active.
    pub mask: *const i32,
    /// The accepted rays of `intersect`, 0 or -1 per ray; written by code.
    pub accepted: *mut i32,
    /// The block of the instance, or the one that objects share.
    pub instance: *const u8,
    /// The objects, for the call modes that take them.
    pub objects: MaybeUninit<*const u8>,
    /// The index of each ray's object, in the stream mode.
    pub index: MaybeUninit<*const u32>,
    /// The functions that code calls for requests.
    pub host: *const HostTable,
    /// The first argument of those functions.
    pub user: *mut c_void,
    /// The number of rays, or of objects in the leaf mode.
    pub count: u32,
    /// Status bits stored by code, such as [`STATUS_BUDGET`](crate::offsets::STATUS_BUDGET).
    pub status: u32,
    /// The number of tests, for `intersect` in the leaf mode.
    pub test_count: MaybeUninit<u32>,
    /// The first ray of the first chunk with a ray that is on, for the call modes with a mask; 0 without a mask.
    pub first: u32,
    /// The tests, for `intersect` in the leaf mode.
    pub tests: MaybeUninit<*mut LeafTest>,
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use crate::offsets;

    use super::*;

    #[test]
    fn offsets_are_those_of_the_interface() {
        for (name, offset, expected) in [
            ("state", offset_of!(RawCall, state), offsets::CALL_STATE),
            ("scratch", offset_of!(RawCall, scratch), offsets::CALL_SCRATCH),
            ("mask", offset_of!(RawCall, mask), offsets::CALL_MASK),
            ("accepted", offset_of!(RawCall, accepted), offsets::CALL_ACCEPTED),
            ("instance", offset_of!(RawCall, instance), offsets::CALL_INSTANCE),
            ("objects", offset_of!(RawCall, objects), offsets::CALL_OBJECTS),
            ("index", offset_of!(RawCall, index), offsets::CALL_INDEX),
            ("host", offset_of!(RawCall, host), offsets::CALL_HOST),
            ("user", offset_of!(RawCall, user), offsets::CALL_USER),
            ("count", offset_of!(RawCall, count), offsets::CALL_COUNT),
            ("status", offset_of!(RawCall, status), offsets::CALL_STATUS),
            ("test count", offset_of!(RawCall, test_count), offsets::CALL_TEST_COUNT),
            ("first", offset_of!(RawCall, first), offsets::CALL_FIRST),
            ("tests", offset_of!(RawCall, tests), offsets::CALL_TESTS),
            ("size", size_of::<RawCall>(), offsets::CALL_SIZE),
            ("ray", offset_of!(LeafTest, ray), offsets::TEST_RAY),
            ("first", offset_of!(LeafTest, first), offsets::TEST_FIRST),
            ("nearest", offset_of!(LeafTest, nearest), offsets::TEST_NEAREST),
            ("size of a test", size_of::<LeafTest>(), offsets::TEST_SIZE),
        ] {
            assert_eq!(offset, expected as usize, "{name}");
        }
    }
}
