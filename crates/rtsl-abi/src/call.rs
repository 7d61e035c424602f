//! The arguments of a call, for those who call and as machine code reads them.

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
    /// Arrays for the state components, by the index of the one table; the kernel's
    /// [signature](crate::Signature::state) says which it needs.
    pub state: &'a mut LaneBlock,
    /// One array for each scalar of the class's scratch.
    pub scratch: &'a mut LaneBlock,
    /// How many rays, at most the lanes of the blocks; 1 for the single shape, the number of
    /// objects for the leaf shape.
    pub count: usize,
    /// Which rays take part; all where `None`. The others' state does not change. The single shape
    /// takes none.
    pub mask: Option<&'a LaneMask>,
    /// For `intersect`: the kernel sets which rays it found a hit for; false for those
    /// that took no part. The leaf shape says it in [`CallStatus::nearest`] instead.
    pub accepted: Option<&'a mut LaneMask>,
    /// The objects, in the form that the kernel's shape takes.
    pub instances: Instances<'a>,
    /// Answers the shader's questions.
    pub host: &'a mut dyn Host,
}

/// Whose method is called.
#[derive(Clone, Copy)]
pub enum Instances<'a> {
    /// One instance for all rays: for kernels of the shapes packet, common origin and single that take no
    /// objects.
    One(&'a InstanceBlock),
    /// The object of this number for all rays: for kernels of these shapes that take objects.
    Object(&'a Objects, u32),
    /// An object for each ray, by its number: for the stream shape.
    Many(&'a Objects, &'a LaneIndices),
    /// Objects in a row, the first with this number, a multiple of
    /// [`OBJECTS_IN_BLOCK`](crate::offsets::OBJECTS_IN_BLOCK): for the leaf shape. The ray is lane 0 of state and scratch. `intersect` leaves there what it gave for the object with the nearest hit;
    /// other methods leave in lane `i` what they gave for the `i`th object: all that their text sets, also where that is
    /// what the ray's lane had.
    Range(&'a Objects, u32),
}

impl<'a> Instances<'a> {
    /// The block of the one instance, or of what the objects share.
    #[inline(always)]
    pub fn block(self) -> &'a InstanceBlock {
        match self {
            Instances::One(block) => block,
            Instances::Object(objects, _)
            | Instances::Many(objects, _)
            | Instances::Range(objects, _) => objects.shared(),
        }
    }

    /// The objects; `None` for one instance.
    #[inline(always)]
    pub fn objects(self) -> Option<&'a Objects> {
        match self {
            Instances::One(_) => None,
            Instances::Object(objects, _)
            | Instances::Many(objects, _)
            | Instances::Range(objects, _) => Some(objects),
        }
    }

    /// The number of a lane's object; `None` for one instance.
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

/// How a call ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[must_use]
pub struct CallStatus {
    /// A ray used up its budget of loop iterations; its results are those of the loop cut short.
    pub budget_exhausted: bool,
    /// The number of the object with the nearest hit, in the leaf shape; of equally near ones the
    /// lowest.
    pub nearest: Option<u32>,
}

/// The call as machine code reads it; see [`offsets`](crate::offsets). Fields that only some shapes read are not
/// written for the others.
#[repr(C)]
pub struct RawCall {
    /// The lane arrays of the state, by component; null where code touches none.
    pub state: *const *mut u32,
    /// The lane arrays of scratch.
    pub scratch: *const *mut u32,
    /// 0 or -1 a ray; null for all rays.
    pub mask: *const i32,
    /// Receives 0 or -1 a ray from `intersect`.
    pub accepted: *mut i32,
    /// The block of the instance, or of what objects share.
    pub instance: *const u8,
    /// Objects, for shapes that take them.
    pub objects: MaybeUninit<*const u8>,
    /// The number of each ray's object, in the stream shape.
    pub index: MaybeUninit<*const u32>,
    /// The functions that code calls with requests.
    pub host: *const HostTable,
    /// The first argument of those functions.
    pub user: *mut c_void,
    /// Rays, or objects in the leaf shape.
    pub count: u32,
    /// Bits that code sets, such as [`STATUS_BUDGET`](crate::offsets::STATUS_BUDGET).
    pub status: u32,
    /// The ray that the first chunk starts with, where code may begin at any chunk.
    pub begin: MaybeUninit<u32>,
    /// How many tests, for `intersect` in the leaf shape.
    pub test_count: MaybeUninit<u32>,
    /// The tests, for `intersect` in the leaf shape.
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
            ("begin", offset_of!(RawCall, begin), offsets::CALL_BEGIN),
            ("test count", offset_of!(RawCall, test_count), offsets::CALL_TEST_COUNT),
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
