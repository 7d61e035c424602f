//! Turns: what ordinary runs of tests share out among their subjects, and long runs do with each.

/// True if `RTSL_LONG` is set: repetitions that ordinary runs leave out run, too.
pub fn is_long_run() -> bool {
    std::env::var_os("RTSL_LONG").is_some()
}

/// The ways by which the subject with this index is tested: all of them in long runs; in ordinary runs one, so that
/// subjects take turns.
pub fn ways<T: Clone>(all: &[T], index: usize) -> Vec<T> {
    if is_long_run() { all.to_vec() } else { vec![all[index % all.len()].clone()] }
}
