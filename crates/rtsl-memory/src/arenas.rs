//! Arenas of the C library's allocator.

/// Limits the number of arenas, for a program that calls this first: half of the processors have one, at least two.
///
/// By default each thread gets an arena of its own, up to eight for each processor, and keeps what was freed there.
/// Each compilation has a thread to itself, whose arena LLVM fills: with two arenas on two processors, the greatest
/// memory of short renders was 76 MB in place of 84, and 132 in place of 150, in the same time. Only the C library of
/// GNU has such arenas. A limit in the environment (`MALLOC_ARENA_MAX`) counts instead.
pub fn limit_arenas() {
    if std::env::var_os("MALLOC_ARENA_MAX").is_none() {
        let processors = std::thread::available_parallelism().map_or(1, |count| count.get());
        set_limit((processors / 2).max(2));
    }
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn set_limit(count: usize) {
    let count = libc::c_int::try_from(count).unwrap_or(libc::c_int::MAX);
    // Safety: the call takes numbers, and changes how the allocator makes arenas from now on. It is harmless if it is
    // refused.
    unsafe { libc::mallopt(libc::M_ARENA_MAX, count) };
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn set_limit(_: usize) {}
