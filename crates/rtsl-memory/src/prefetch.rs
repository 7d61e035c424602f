//! Prefetching of memory.

/// The size of a cache line, in bytes.
const LINE: usize = 64;

/// Prefetches a value into the processor's caches. Does nothing on processors without a known instruction for it.
#[inline(always)]
pub fn prefetch<T>(value: &T) {
    prefetch_values(value, 1);
}

/// Prefetches consecutive values. The memory need not be valid.
#[inline(always)]
pub fn prefetch_values<T>(first: *const T, count: usize) {
    let start: *const i8 = first.cast();
    for line in 0..(count * size_of::<T>()).div_ceil(LINE) {
        fetch_line(start.wrapping_add(line * LINE));
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn fetch_line(address: *const i8) {
    use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

    // Safety: this reads nothing that the program would see, whatever the address.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(address) }
}

#[cfg(target_arch = "aarch64")]
#[inline(always)]
fn fetch_line(address: *const i8) {
    // Safety: this reads nothing that the program would see, whatever the address.
    unsafe {
        std::arch::asm!(
            "prfm pldl1keep, [{}]",
            in(reg) address,
            options(nostack, preserves_flags, readonly)
        );
    }
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
#[inline(always)]
fn fetch_line(_: *const i8) {}
