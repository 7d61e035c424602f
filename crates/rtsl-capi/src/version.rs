//! Which RTSL this is.

use std::ffi::c_char;

/// The version of the kernel interface: `RTSL_ABI` of the header that a host was compiled with must be the same.
#[unsafe(no_mangle)]
pub extern "C" fn rtsl_abi() -> u32 {
    rtsl::KERNEL_ABI
}

/// The version of RTSL, "0.1.0".
#[unsafe(no_mangle)]
pub extern "C" fn rtsl_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}
