//! The runtime functions that compiled code may call by name.
//!
//! Calls of the host go through pointers in the call's arguments, so this module contains only functions that LLVM's
//! code generators may insert and that have one exact result. Any other symbol (such as `powf`) means that an operation
//! was lowered to a C library whose results may differ.

use std::ffi::{c_int, c_void};

/// Returns the address of a function that compiled code may call.
pub fn address(name: &str) -> Option<u64> {
    let address = match name {
        "memcpy" => copy as *const c_void,
        "memmove" => copy_overlapping as *const c_void,
        "memset" => fill as *const c_void,
        "fmaf" => fused_multiply_add as *const c_void,
        _ => return None,
    };
    Some(address as u64)
}

unsafe extern "C" fn copy(to: *mut u8, from: *const u8, size: usize) -> *mut u8 {
    // Safety: as for C's `memcpy`; the caller is code that LLVM made from a verified module.
    unsafe { std::ptr::copy_nonoverlapping(from, to, size) };
    to
}

unsafe extern "C" fn copy_overlapping(to: *mut u8, from: *const u8, size: usize) -> *mut u8 {
    // Safety: as for C's `memmove`.
    unsafe { std::ptr::copy(from, to, size) };
    to
}

unsafe extern "C" fn fill(to: *mut u8, byte: c_int, size: usize) -> *mut u8 {
    // Safety: as for C's `memset`.
    unsafe { std::ptr::write_bytes(to, byte as u8, size) };
    to
}

/// For machines without the instruction: rounds once, as IEEE 754 requires.
extern "C" fn fused_multiply_add(a: f32, b: f32, c: f32) -> f32 {
    a.mul_add(b, c)
}
