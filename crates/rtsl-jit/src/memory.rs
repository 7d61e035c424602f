//! Pages for machine code: written first, then executed, never both.

use crate::error::JitError;

/// A separate mapping, unmapped on drop.
pub struct CodeMemory {
    start: *mut u8,
    size: usize,
    mapped: usize,
}

// Safety: the memory is owned; after `protect` it is not written.
unsafe impl Send for CodeMemory {}
// Safety: shared references only read.
unsafe impl Sync for CodeMemory {}

/// The granularity of protection.
pub const PAGE: usize = rtsl_memory::PAGE_BYTES;

impl CodeMemory {
    /// Returns new zeroed memory of at least `size` bytes, writable.
    pub fn new(size: usize) -> Result<CodeMemory, JitError> {
        let mapped = size.max(1).next_multiple_of(PAGE);
        let start = system::map(mapped)?;
        Ok(CodeMemory { start, size, mapped })
    }

    /// Returns the address of the memory.
    pub fn address(&self) -> u64 {
        self.start as u64
    }

    /// Returns the requested size.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Returns the bytes, before [`CodeMemory::protect`].
    pub fn bytes(&mut self) -> &mut [u8] {
        // Safety: the mapping is `mapped >= size` bytes long, writable until `protect`, which
        // is only called after the last use of this (see `Module::load`), and borrowed
        // mutably here.
        unsafe { std::slice::from_raw_parts_mut(self.start, self.size) }
    }

    /// Makes the first `code` bytes, a multiple of [`PAGE`], executable and the rest read-only.
    pub fn protect(&mut self, code: usize) -> Result<(), JitError> {
        let code = code.min(self.mapped);
        system::protect(self.start, code, true)?;
        // Safety: `code <= mapped`, so the pointer is inside the mapping or at its end.
        let rest = unsafe { self.start.add(code) };
        system::protect(rest, self.mapped - code, false)?;
        clear_instruction_cache(self.start, code);
        Ok(())
    }

    /// Returns the address of the byte at `offset`.
    pub fn at(&self, offset: usize) -> *const u8 {
        assert!(offset < self.size, "a function lies inside its module");
        // Safety: checked above.
        unsafe { self.start.add(offset) }
    }
}

impl Drop for CodeMemory {
    fn drop(&mut self) {
        system::unmap(self.start, self.mapped);
    }
}

#[cfg(unix)]
mod system {
    use std::ffi::{c_int, c_void};
    use std::io::Error;

    use super::JitError;

    unsafe extern "C" {
        fn mmap(
            address: *mut c_void,
            size: usize,
            protection: c_int,
            flags: c_int,
            file: c_int,
            offset: i64,
        ) -> *mut c_void;
        fn mprotect(address: *mut c_void, size: usize, protection: c_int) -> c_int;
        fn munmap(address: *mut c_void, size: usize) -> c_int;
    }

    const READ: c_int = 1;
    const WRITE: c_int = 2;
    const EXECUTE: c_int = 4;
    const PRIVATE: c_int = 2;
    const ANONYMOUS: c_int = if cfg!(target_os = "linux") { 0x20 } else { 0x1000 };
    /// Required by macOS for pages that become executable.
    const JIT: c_int = if cfg!(target_os = "macos") { 0x800 } else { 0 };

    pub fn map(size: usize) -> Result<*mut u8, JitError> {
        // Safety: a fresh private mapping at an address of the system's choice.
        let start = unsafe {
            mmap(std::ptr::null_mut(), size, READ | WRITE, PRIVATE | ANONYMOUS | JIT, -1, 0)
        };
        if start as isize == -1 { Err(last_error()) } else { Ok(start.cast()) }
    }

    pub fn protect(start: *mut u8, size: usize, execute: bool) -> Result<(), JitError> {
        if size == 0 {
            return Ok(());
        }
        let protection = if execute { READ | EXECUTE } else { READ };
        // Safety: the range is whole pages of one of our mappings.
        let failed = unsafe { mprotect(start.cast(), size, protection) } != 0;
        if failed { Err(last_error()) } else { Ok(()) }
    }

    pub fn unmap(start: *mut u8, size: usize) {
        // Safety: the range is one of our mappings, and its owner is being dropped.
        unsafe { munmap(start.cast(), size) };
    }

    fn last_error() -> JitError {
        JitError::Memory(Error::last_os_error().to_string())
    }
}

#[cfg(not(unix))]
mod system {
    use super::JitError;

    pub fn map(_: usize) -> Result<*mut u8, JitError> {
        Err(JitError::Memory("running machine code is not supported on this system".to_owned()))
    }

    pub fn protect(_: *mut u8, _: usize, _: bool) -> Result<(), JitError> {
        Ok(())
    }

    pub fn unmap(_: *mut u8, _: usize) {}
}

#[cfg(not(target_arch = "aarch64"))]
fn clear_instruction_cache(_: *mut u8, _: usize) {}

#[cfg(target_arch = "aarch64")]
fn clear_instruction_cache(start: *mut u8, size: usize) {
    /// No machine has shorter cache lines; cleaning a line twice is harmless.
    const LINE: usize = 16;
    // Safety: cache maintenance by address on owned memory.
    unsafe {
        for offset in (0..size).step_by(LINE) {
            std::arch::asm!("dc cvau, {0}", in(reg) start.add(offset));
        }
        std::arch::asm!("dsb ish");
        for offset in (0..size).step_by(LINE) {
            std::arch::asm!("ic ivau, {0}", in(reg) start.add(offset));
        }
        std::arch::asm!("dsb ish", "isb");
    }
}
