//! Calls that release the interpreter's lock.

use pyo3::prelude::*;
use rtsl::begin_work;

use crate::error::Exception;

/// Does work without the interpreter's lock, so that other threads of Python run meanwhile, and may fork.
///
/// # Errors
/// As [`check_fork`] has.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let _under_way = begin_work().map_err(|it| Exception::Error.of_diagnostic(&it))?;
    Ok(py.detach(work))
}

/// Checks that no such work was in progress when this process was forked: what it held stays locked.
///
/// # Errors
/// `rtsl.Error` in such a child.
pub fn check_fork() -> PyResult<()> {
    begin_work().map(drop).map_err(|it| Exception::Error.of_diagnostic(&it))
}
