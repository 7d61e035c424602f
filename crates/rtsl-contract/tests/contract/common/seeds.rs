//! The seeds that tests check classes with.

use std::ops::Range;

/// One, or as many as `RTSL_SEEDS` says: for long runs.
pub fn seeds() -> Range<u64> {
    let count = std::env::var("RTSL_SEEDS").map(|it| it.parse().expect("RTSL_SEEDS is a number"));
    0..count.unwrap_or(1)
}
