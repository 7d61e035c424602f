//! The diagnostics of the last call, as data.

use crate::error::{RtslResult, place};
use crate::kept_diagnostic::{LAST, RtslDiagnostic};

/// How many diagnostics the last call of this thread had: errors where it failed, warnings where it went well.
#[unsafe(no_mangle)]
pub extern "C" fn rtsl_last_diagnostic_count() -> usize {
    LAST.try_with(|last| last.borrow().len()).unwrap_or(0)
}

/// One of the diagnostics of the last call of this thread. It leaves them as they are.
///
/// # Safety
/// `diagnostic` is null or leads to an `RtslDiagnostic`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_last_diagnostic(
    index: usize,
    diagnostic: *mut RtslDiagnostic,
) -> RtslResult {
    // Not guarded: that would replace what it reads, and nothing here panics.
    // Safety: the caller's promise.
    let Ok(diagnostic) = (unsafe { place(diagnostic, "diagnostic") }) else {
        return RtslResult::Argument;
    };
    let given = LAST.try_with(|last| match last.borrow().get(index) {
        Some(kept) => {
            *diagnostic = kept.as_c();
            RtslResult::Ok
        }
        None => RtslResult::Argument,
    });
    given.unwrap_or(RtslResult::Argument)
}
