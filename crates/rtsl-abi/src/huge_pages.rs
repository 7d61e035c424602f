//! Large tables in large pages.
//!
//! Rays read the tables of a scene at random: in pages of 4 KiB nearly every access to tables of tens of
//! megabytes has its address looked up in memory, too. Linux backs memory with pages of 2 MiB where
//! it is asked to: random rays on a million triangles take a quarter less time.

use std::ops::Range;

/// The largest size of the pages that systems for this processor use.
pub const PAGE_BYTES: usize = if cfg!(target_arch = "x86_64") { 4 << 10 } else { 64 << 10 };

/// Smaller tables stay as they are.
const MIN_BYTES: usize = 4 << 20;

/// An empty vector whose memory is of large pages, if it is large and the system has such.
pub fn with_capacity_in_huge_pages<T>(capacity: usize) -> Vec<T> {
    let mut vector = Vec::with_capacity(capacity);
    if capacity.saturating_mul(size_of::<T>()) >= MIN_BYTES {
        advise(vector.spare_capacity_mut().as_ptr_range(), Advice::HugePage);
    }
    vector
}

/// The same elements in memory as [`with_capacity_in_huge_pages`] has it.
pub fn in_huge_pages<T>(elements: Vec<T>) -> Vec<T> {
    if size_of_val(elements.as_slice()) < MIN_BYTES {
        return elements;
    }
    let mut moved = with_capacity_in_huge_pages(elements.len());
    moved.extend(elements);
    // The allocator may have handed out memory that was in use before, in small pages.
    advise(moved.as_ptr_range(), Advice::Collapse);
    moved
}

#[derive(Clone, Copy)]
enum Advice {
    /// What is used from now on shall be in large pages.
    HugePage = 14,
    /// What is in small pages shall be moved into large ones now; since Linux 6.1.
    Collapse = 25,
}

#[cfg(target_os = "linux")]
fn advise<T>(memory: Range<*const T>, advice: Advice) {
    let start = memory.start.addr().next_multiple_of(PAGE_BYTES);
    let end = memory.end.addr() / PAGE_BYTES * PAGE_BYTES;
    let address = memory.start.with_addr(start).cast_mut().cast();
    // Safety: whole pages within the memory. The advice changes nothing of what they hold, so it does no
    // harm that it is refused, or that pages outlive the memory's use.
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
