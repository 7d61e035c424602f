//! The stack that calls need.

use crate::call_error::CallError;

/// The room that a call leaves on the stack for the host's functions. Their answers may call kernels, whose calls are
/// checked in turn.
pub const HOST_STACK_BYTES: usize = 128 << 10;

/// Checks that the stack of the calling thread has room for a kernel that uses `frame_bytes` of it, and for the host's
/// functions: hosts whose answers call kernels recursively get an error instead of a stack overflow.
///
/// # Errors
/// [`CallError::NoStack`].
pub fn check_stack(frame_bytes: usize) -> Result<(), CallError> {
    if rtsl_memory::has_stack(frame_bytes.saturating_add(HOST_STACK_BYTES)) {
        Ok(())
    } else {
        Err(CallError::NoStack)
    }
}
