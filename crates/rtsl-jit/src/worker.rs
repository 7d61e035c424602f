//! Runs LLVM where its failures do no harm.
//!
//! Most of LLVM's errors are reported, but some ("cannot select", a broken invariant of the code
//! generator) call a fatal error handler and then end the process. The way out: all work
//! is done on a thread of its own, whose handler hands the words over and then sleeps for
//! ever. A thread and what it allocated are lost, but the process lives. The thread also has the
//! stack that LLVM's recursive passes need.

use std::cell::RefCell;
use std::ffi::{CStr, c_char};
use std::sync::mpsc;

use crate::api::Api;
use crate::error::JitError;

const STACK_BYTES: usize = 64 << 20;

type Report = Box<dyn Fn(String)>;

thread_local! {
    /// Where a fatal error of the work on this thread is reported.
    static REPORT: RefCell<Option<Report>> = const { RefCell::new(None) };
}

/// Runs `work` on a new thread; a fatal error of LLVM becomes a [`JitError`].
pub fn run<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, JitError> + Send + 'static,
) -> Result<T, JitError> {
    let (sender, receiver) = mpsc::channel();
    let fatal = sender.clone();
    let body = move || {
        REPORT.set(Some(Box::new(move |message| {
            // A receiver that is gone does not want to know.
            let _ = fatal.send(Err(JitError::CodeGeneration(message)));
        })));
        let result = work();
        REPORT.set(None);
        let _ = sender.send(result);
    };
    let spawned = std::thread::Builder::new()
        .name("rtsl-llvm".to_owned())
        .stack_size(STACK_BYTES)
        .spawn(body);
    if let Err(error) = spawned {
        return Err(JitError::CodeGeneration(format!("no thread to work on: {error}")));
    }
    receiver
        .recv()
        .unwrap_or_else(|_| Err(JitError::CodeGeneration("the compiling thread died".to_owned())))
}

/// Makes LLVM's fatal errors end the work, not the process.
pub fn install_fatal_error_handler(api: &Api) {
    // Safety: the handler has the type of `LLVMFatalErrorHandler` and may be called from any
    // thread.
    unsafe { (api.LLVMInstallFatalErrorHandler)(on_fatal_error) };
}

unsafe extern "C" fn on_fatal_error(reason: *const c_char) {
    let reason = if reason.is_null() {
        "a fatal error without a reason".to_owned()
    } else {
        // Safety: LLVM gives a text that ends in a zero byte.
        unsafe { CStr::from_ptr(reason) }.to_string_lossy().into_owned()
    };
    let reported = REPORT.with_borrow(|report| report.as_ref().map(|report| report(reason)));
    if reported.is_some() {
        // Returning would end the process.
        loop {
            std::thread::park();
        }
    }
}
