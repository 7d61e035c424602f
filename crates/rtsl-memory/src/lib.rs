//! Memory budgets and fallible allocation: the memory of a render is computed before it begins, and a lack of memory is
//! an error.
//!
//! Rust aborts the process if an allocation fails. Allocations whose size depends on the input therefore use [`filled`]
//! and [`collected`], and [`check_render`] compares their total with the available memory before anything is rendered.
//! The files of a scene have a budget ([`InputBudget`]).
//!
//! Words of instances may be in temporary files ([`SharedWords`]), whose pages the system reads as they are used.
//!
//! Large tables that rays access at random are placed in huge pages ([`in_huge_pages`]), and hierarchies fetch nodes
//! ahead of their use ([`prefetch`]).
//!
//! Programs limit the arenas of the allocator ([`limit_arenas`]). Recursive calls check the room on the thread's stack
//! ([`has_stack`]).
//!
//! Files of strangers are opened once, then checked: what they are, and where they lie ([`open_within`]).
//!
//! A child process has the memory of its parent and none of its threads: work that was in progress at a fork is known
//! ([`ForkGuard`]), and each process has threads of its own ([`Pool`], [`on_all_processors`]).
#![allow(unsafe_code, reason = "asks and advises the system and the processor about memory")]

mod amount;
mod arenas;
mod available;
mod budget;
mod forks;
mod huge_pages;
mod need;
mod place;
mod pool;
mod prefetch;
mod regular_file;
mod shared_words;
mod stack;

use std::collections::TryReserveError;
use std::io;

use rtsl_source::{Diagnostic, diagnostic_codes as codes};

pub use amount::Amount;
pub use arenas::limit_arenas;
pub use available::{Available, Limit};
pub use budget::{Held, InputBudget, OverBudget};
pub use forks::{ForkGuard, UnderWay, forks};
pub use huge_pages::{PAGE_BYTES, in_huge_pages, with_capacity_in_huge_pages};
pub use need::{Need, check_render};
pub use place::{lies_within, real_place, without_detours};
pub use pool::{Pool, on_all_processors};
pub use prefetch::{prefetch, prefetch_values};
pub use regular_file::{Refused, open_regular_file, open_within};
pub use shared_words::{SharedWords, temporary_folder};
pub use stack::has_stack;

/// The error of an allocation that the system refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the system gives no {0} of memory")]
pub struct OutOfMemory(pub Amount);

impl OutOfMemory {
    /// The diagnostic of the error.
    pub fn diagnostic(&self) -> Diagnostic {
        Diagnostic::new(codes::OUT_OF_MEMORY, self.to_string()).help(need::REMEDY)
    }
}

impl From<OutOfMemory> for io::Error {
    fn from(error: OutOfMemory) -> Self {
        io::Error::new(io::ErrorKind::OutOfMemory, error)
    }
}

/// Returns a vector of `count` copies of a value.
///
/// # Errors
/// If there is not enough memory.
pub fn filled<T: Clone>(count: usize, value: T) -> Result<Vec<T>, OutOfMemory> {
    let mut values = reserved(count)?;
    values.resize(count, value);
    Ok(values)
}

/// Collects an iterator of at most `count` values.
///
/// # Errors
/// If there is not enough memory.
pub fn collected<T>(
    count: usize,
    values: impl IntoIterator<Item = T>,
) -> Result<Vec<T>, OutOfMemory> {
    let mut all = reserved(count)?;
    all.extend(values.into_iter().take(count));
    Ok(all)
}

/// Returns an empty vector with room for `count` values.
///
/// # Errors
/// If there is not enough memory.
pub fn reserved<T>(count: usize) -> Result<Vec<T>, OutOfMemory> {
    let mut values = Vec::new();
    let no_memory = |_: TryReserveError| OutOfMemory(Amount::of::<T>(count));
    values.try_reserve_exact(count).map_err(no_memory)?;
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_had_is_an_error() {
        let error = filled(1 << 60, 0.0_f32).unwrap_err();
        assert_eq!(error.to_string(), "the system gives no 4294967296.0 GiB of memory");
        assert_eq!(filled(usize::MAX, [0_u64; 9]).unwrap_err().0, Amount(u64::MAX));
        assert_eq!(collected(1 << 60, [1_u32]).unwrap_err().0, Amount(1 << 62));
        assert_eq!(io::Error::from(error).kind(), io::ErrorKind::OutOfMemory);
        assert_eq!(error.diagnostic().code, codes::OUT_OF_MEMORY);
    }

    #[test]
    fn no_more_is_taken_than_was_reserved() {
        assert_eq!(filled(3, 7), Ok(vec![7; 3]));
        assert_eq!(collected(2, 0..9), Ok(vec![0, 1]));
    }
}
