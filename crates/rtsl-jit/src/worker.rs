//! Threads that run LLVM so that its fatal errors do not end the process.
//!
//! Most of LLVM's errors are reported, but some ("cannot select", a broken invariant of the code generator) call a
//! fatal error handler and then end the process. Therefore all work is done on separate threads, whose handler reports
//! the message and then sleeps for ever. A thread and its allocations are leaked, but the process survives. The threads
//! also have the stack size that LLVM's recursive passes need.
//!
//! A child process has none of these threads and starts new ones, unless its parent had such work in progress when it
//! forked: then work is refused. It is also refused once the process is [ending](crate::ending).
//!
//! A thread whose work is done waits for more: a new one would have to fault in its stack and its heap again, and
//! create LLVM's target machine. Keeping both takes 30 % off the time of the standard library's median method (LLVM
//! 22).

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
    /// The channel to which a fatal error of the work on this thread is reported.
    static REPORT: RefCell<Option<Report>> = const { RefCell::new(None) };
}

/// Does the work and returns a function that delivers its result, called once the thread is ready for more.
type Work = Box<dyn FnOnce() -> Delivery + Send>;
type Delivery = Box<dyn FnOnce()>;

/// The idle threads.
static IDLE: Mutex<Idle> = Mutex::new(Idle { threads: Vec::new(), forks: 0 });

struct Idle {
    threads: Vec<Sender<Work>>,
    /// The number of [forks](rtsl_memory::forks) before the process that started them.
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
            // If the receiver is gone, the result is not needed.
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

/// Gives the work to an idle thread, or to a new one.
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

/// Returns the idle threads. Their lock is never held at a fork whose child may work: a thread that holds it is at
/// work.
fn idle() -> MutexGuard<'static, Idle> {
    let mut idle = IDLE.lock().unwrap_or_else(PoisonError::into_inner);
    let forks = rtsl_memory::forks();
    if idle.forks != forks {
        // The threads belong to the parent. They may hold the locks of their channels, so those are leaked.
        std::mem::forget(std::mem::take(&mut idle.threads));
        idle.forks = forks;
    }
    idle
}

/// Makes LLVM's fatal errors end the work instead of the process.
pub fn install_fatal_error_handler(api: &Api) {
    // Safety: the handler has the type of `LLVMFatalErrorHandler` and may be called from any
    // thread.
    unsafe { (api.LLVMInstallFatalErrorHandler)(on_fatal_error) };
}

unsafe extern "C" fn on_fatal_error(reason: *const c_char) {
    let reason = if reason.is_null() {
        "a fatal error without a reason".to_owned()
    } else {
        // Safety: LLVM passes a text that ends in a zero byte.
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
