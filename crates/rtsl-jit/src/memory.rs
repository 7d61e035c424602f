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
    use std::io::Error;

    use libc::{
        MAP_ANON, MAP_FAILED, MAP_PRIVATE, PROT_EXEC, PROT_READ, PROT_WRITE, c_int, mmap, mprotect,
        munmap,
    };

    use super::JitError;

    /// Required by macOS for pages that become executable.
    #[cfg(target_os = "macos")]
    const MAP_JIT: c_int = libc::MAP_JIT;
    #[cfg(not(target_os = "macos"))]
    const MAP_JIT: c_int = 0;

    pub fn map(size: usize) -> Result<*mut u8, JitError> {
        // Safety: a fresh private mapping at an address of the system's choice.
        let start = unsafe {
            let flags = MAP_PRIVATE | MAP_ANON | MAP_JIT;
            mmap(std::ptr::null_mut(), size, PROT_READ | PROT_WRITE, flags, -1, 0)
        };
        if start == MAP_FAILED { Err(last_error()) } else { Ok(start.cast()) }
    }

    pub fn protect(start: *mut u8, size: usize, execute: bool) -> Result<(), JitError> {
        if size == 0 {
            return Ok(());
        }
        let protection = if execute { PROT_READ | PROT_EXEC } else { PROT_READ };
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
