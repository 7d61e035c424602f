//! Huge pages for large tables.
//!
//! Rays access the tables of a scene at random: with pages of 4 KiB nearly every access to tables of tens of megabytes
//! also misses the TLB. Linux backs memory with pages of 2 MiB on request: random rays on a million triangles take a
//! quarter less time.

use std::ops::Range;

/// The largest base page size of systems for this processor.
pub const PAGE_BYTES: usize = if cfg!(target_arch = "x86_64") { 4 << 10 } else { 64 << 10 };

/// The least size of a table for which huge pages are requested.
const MIN_BYTES: usize = 4 << 20;

/// Returns an empty vector in huge pages, if it is large and the system supports them.
pub fn with_capacity_in_huge_pages<T>(capacity: usize) -> Vec<T> {
    let mut vector = Vec::with_capacity(capacity);
    if capacity.saturating_mul(size_of::<T>()) >= MIN_BYTES {
        advise(vector.spare_capacity_mut().as_ptr_range(), Advice::HugePage);
    }
    vector
}

/// Moves the elements to memory as of [`with_capacity_in_huge_pages`].
pub fn in_huge_pages<T>(elements: Vec<T>) -> Vec<T> {
    if size_of_val(elements.as_slice()) < MIN_BYTES {
        return elements;
    }
    let mut moved = with_capacity_in_huge_pages(elements.len());
    moved.extend(elements);
    // The allocator may have reused memory that is already backed by small pages.
    advise(moved.as_ptr_range(), Advice::Collapse);
    moved
}

#[derive(Clone, Copy)]
enum Advice {
    /// Use huge pages for memory not yet backed.
    HugePage = 14,
    /// Replace small pages by huge ones now; since Linux 6.1.
    Collapse = 25,
}

#[cfg(target_os = "linux")]
fn advise<T>(memory: Range<*const T>, advice: Advice) {
    let start = memory.start.addr().next_multiple_of(PAGE_BYTES);
    let end = memory.end.addr() / PAGE_BYTES * PAGE_BYTES;
    let address = memory.start.with_addr(start).cast_mut().cast();
    // Safety: whole pages within the memory. The advice does not change their content, so it is harmless if it is
    // refused, or if pages outlive the memory's use.
    unsafe { libc::madvise(address, end.saturating_sub(start), advice as libc::c_int) };
}

#[cfg(not(target_os = "linux"))]
fn advise<T>(_: Range<*const T>, _: Advice) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_tables_keep_their_elements() {
        for count in [0, 3, MIN_BYTES / 4 + 5] {
            let elements: Vec<u32> = (0..count as u32).collect();
            assert_eq!(in_huge_pages(elements.clone()), elements);
        }
    }
}
