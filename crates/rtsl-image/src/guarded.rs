//! Calls of libraries that may panic.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::picture::PictureError;

/// Calls a library, some of whose checks are assertions: a file for which they fail is reported as malformed.
pub fn guarded<T>(call: impl FnOnce() -> Result<T, PictureError>) -> Result<T, PictureError> {
    let damaged = |_| Err("it is damaged".into());
    catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(damaged)
}
