//! Runs LLVM where its failures do no harm.
//!
//! Most of LLVM's errors are reported, but some ("cannot select", a broken invariant of the code
//! generator) call a fatal error handler and then end the process. The way out: all work
//! is done on threads of its own, whose handler hands the words over and then sleeps for
//! ever. A thread and what it allocated are lost, but the process lives. The threads also have the
//! stack that LLVM's recursive passes need.
//!
//! A child process has none of these threads and makes its own, unless its parent was at such work when it was forked:
//! then it is refused. So it is once the process is [ending](crate::ending).
//!
//! A thread whose work is done waits for more: a new one would have to fault in its stack and its
//! heap again, and make LLVM's target machine. Keeping both takes 30 % off the time of the standard
//! library's median method (LLVM 22).

use std::cell::RefCell;
use std::ffi::{CStr, c_char};
use std::sync::mpsc::{SendError, Sender, channel};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::ending;
use crate::error::JitError;
use crate::ffi::Api;

const STACK_BYTES: usize = 64 << 20;

type Report = Box<dyn Fn(String)>;

thread_local! {
    /// Where a fatal error of the work on this thread is reported.
    static REPORT: RefCell<Option<Report>> = const { RefCell::new(None) };
}

/// Does the work and gives what hands its result over, when the thread is free for more.
type Work = Box<dyn FnOnce() -> Delivery + Send>;
type Delivery = Box<dyn FnOnce()>;

/// The threads that wait.
static IDLE: Mutex<Idle> = Mutex::new(Idle { threads: Vec::new(), forks: 0 });

struct Idle {
    threads: Vec<Sender<Work>>,
    /// The [forks](crate::ForkGuard::forks) before the process that has them.
    forks: usize,
}

/// Runs `work` on another thread; a fatal error of LLVM becomes a [`JitError`].
pub fn run<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, JitError> + Send + 'static,
) -> Result<T, JitError> {
    let _under_way = ending::begin_work()?;
    let (sender, receiver) = channel();
    let work = move || {
        let fatal = sender.clone();
        REPORT.set(Some(Box::new(move |message| {
            // A receiver that is gone does not want to know.
            let _ = fatal.send(Err(JitError::CodeGeneration(message)));
        })));
        let result = work();
        ending::note_work();
        REPORT.set(None);
        let deliver = move || {
            let _ = sender.send(result);
        };
        Box::new(deliver) as Delivery
    };
    hand_over(Box::new(work))?;
    receiver
        .recv()
        .unwrap_or_else(|_| Err(JitError::CodeGeneration("the compiling thread died".to_owned())))
}

/// Gives the work to a thread that waits, or to a new one.
fn hand_over(mut work: Work) -> Result<(), JitError> {
    while let Some(thread) = idle().threads.pop() {
        match thread.send(work) {
            Ok(()) => return Ok(()),
            Err(SendError(returned)) => work = returned,
        }
    }
    let body = move || {
        ending::note_worker();
        let (sender, receiver) = channel();
        let mut next = Some(work);
        while let Some(work) = next.take() {
            let deliver = work();
            idle().threads.push(sender.clone());
            deliver();
            next = receiver.recv().ok();
        }
    };
    let thread = std::thread::Builder::new().name("rtsl-llvm".to_owned()).stack_size(STACK_BYTES);
    let spawned = thread.spawn(body);
    spawned
        .map(drop)
        .map_err(|error| JitError::CodeGeneration(format!("no thread to work on: {error}")))
}

/// No lock of these is held when a child is forked that may work: who holds one is at work.
fn idle() -> MutexGuard<'static, Idle> {
    let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
    let forks = ending::forks();
    if idle.forks != forks {
        // The threads are the parent's. They may have been about to wait at their channels, which are left as they are.
        std::mem::forget(std::mem::take(&mut idle.threads));
        idle.forks = forks;
    }
    idle
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
