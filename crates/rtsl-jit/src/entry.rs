//! The entry point of kernels.

use rtsl_abi::RawCall;

/// The function of a compiled kernel.
pub(crate) type Entry = unsafe extern "C" fn(*mut RawCall);
