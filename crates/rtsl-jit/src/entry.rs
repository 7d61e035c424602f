//! The entry points of kernels.

use rtsl_abi::RawCall;

/// The function of a compiled kernel.
pub(crate) type Entry = unsafe extern "C" fn(*mut RawCall);

/// The [function for full chunks](rtsl_llvm::FullChunks) of a compiled kernel: state, scratch, accepted rays, instance,
/// number of rays.
pub(crate) type FullEntry =
    unsafe extern "C" fn(*const *mut u32, *const *mut u32, *mut i32, *const u8, u64);
