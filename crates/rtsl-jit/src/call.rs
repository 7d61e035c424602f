//! The arguments of a call, for those who call and as machine code reads them.

use std::ffi::c_void;
use std::mem::MaybeUninit;

use rtsl_ir::host::Host;

use crate::callbacks::HostTable;
use crate::instance::{InstanceBlock, InstanceTable};
use crate::lanes::{LaneBlock, LaneIndices, LaneMask};
use crate::members::MemberBlock;

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
    /// One object for all rays: for the shapes packet, common origin and single.
    One(&'a InstanceBlock),
    /// An object for each ray, by its number in the table: for the stream shape.
    Many(&'a InstanceTable, &'a LaneIndices),
    /// Objects in a row, the first with this number: for the leaf shape. The ray is lane 0 of
    /// state and scratch. `intersect` leaves there what it gave for the object with the nearest hit;
    /// other methods leave in lane `i` what they gave for the `i`th object.
    Range(&'a MemberBlock, u32),
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

/// The call as machine code reads it; see `rtsl_packet::abi`. What only some shapes read is not
/// written for the others.
#[repr(C)]
pub(crate) struct RawCall {
    pub state: *const *mut u32,
    pub scratch: *const *mut u32,
    pub mask: *const i32,
    pub accepted: *mut i32,
    pub instance: MaybeUninit<*const u8>,
    pub instances: MaybeUninit<*const *const u8>,
    pub index: MaybeUninit<*const u32>,
    pub host: *const HostTable,
    pub user: *mut c_void,
    pub count: u32,
    pub status: u32,
    pub members: MaybeUninit<*const *mut u32>,
    pub first: MaybeUninit<u32>,
    pub nearest: u32,
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use rtsl_packet::abi;

    use super::*;

    #[test]
    fn offsets_are_those_of_the_interface() {
        for (name, offset, expected) in [
            ("state", offset_of!(RawCall, state), abi::CALL_STATE),
            ("scratch", offset_of!(RawCall, scratch), abi::CALL_SCRATCH),
            ("mask", offset_of!(RawCall, mask), abi::CALL_MASK),
            ("accepted", offset_of!(RawCall, accepted), abi::CALL_ACCEPTED),
            ("instance", offset_of!(RawCall, instance), abi::CALL_INSTANCE),
            ("instances", offset_of!(RawCall, instances), abi::CALL_INSTANCES),
            ("index", offset_of!(RawCall, index), abi::CALL_INDEX),
            ("host", offset_of!(RawCall, host), abi::CALL_HOST),
            ("user", offset_of!(RawCall, user), abi::CALL_USER),
            ("count", offset_of!(RawCall, count), abi::CALL_COUNT),
            ("status", offset_of!(RawCall, status), abi::CALL_STATUS),
            ("members", offset_of!(RawCall, members), abi::CALL_MEMBERS),
            ("first", offset_of!(RawCall, first), abi::CALL_FIRST),
            ("nearest", offset_of!(RawCall, nearest), abi::CALL_NEAREST),
            ("size", size_of::<RawCall>(), abi::CALL_SIZE),
        ] {
            assert_eq!(offset, expected as usize, "{name}");
        }
    }
}
