//! The end of the process, at which LLVM's globals are destroyed while no thread may be using them.
//!
//! `exit` first destroys the thread-local values of its thread, then calls handlers, those registered last first. LLVM
//! registers the destruction of its globals when it is loaded, and that of some at their first use, at any moment of
//! any work. So work must have stopped before the first handler. A thread-local value of the main thread, on which most
//! processes end, ensures that. It cannot know if the process ends or only that thread, so it lets work in progress
//! finish, and delays further work for a moment. A handler registered here then knows that the process ends, and
//! refuses further work. If another thread than the main one calls `exit`, the handler waits for work in progress; it
//! is registered again repeatedly, so that it runs early.

use std::cell::Cell;
use std::sync::atomic::Ordering::SeqCst;
use std::sync::atomic::{AtomicBool, AtomicU32};
use std::time::{Duration, Instant};

use rtsl_memory::{ForkGuard, UnderWay};

use crate::error::JitError;

/// The work to wait for.
static AT_WORK: ForkGuard = ForkGuard::new();

static IS_ENDING: AtomicBool = AtomicBool::new(false);
/// True if the main thread is ending, and perhaps the process.
static IS_PAUSED: AtomicBool = AtomicBool::new(false);
static WORKS_DONE: AtomicU32 = AtomicU32::new(0);

/// The number of pieces of work after each of which the handler is registered again; later at growing intervals. Most
/// globals are in use by then.
const FIRST_WORKS: u32 = 64;

/// The longest time for which the end of the process is delayed.
const MAX_WAIT: Duration = Duration::from_secs(10);

/// The time for which work is delayed when the main thread ends: if the process ends, it does so within this time.
const PAUSE: Duration = Duration::from_secs(1);

/// The interval between checks for a change.
const STEP: Duration = Duration::from_millis(1);

thread_local! {
    /// True if this thread does work.
    static IS_WORKER: Cell<bool> = const { Cell::new(false) };
    /// True if this is the main thread, and its thread-local values are being destroyed or are gone.
    static IS_AT_ITS_END: Cell<bool> = const { Cell::new(false) };
    static MAIN_THREAD: MainThread = const { MainThread };
}

/// A thread-local value of the main thread.
struct MainThread;

impl Drop for MainThread {
    fn drop(&mut self) {
        IS_AT_ITS_END.set(true);
        IS_PAUSED.store(true, SeqCst);
        wait_for_work();
    }
}

/// Begins work with LLVM.
pub(crate) fn begin_work() -> Result<UnderWay<'static>, JitError> {
    watch_main_thread();
    let mut held_back: Option<Instant> = None;
    loop {
        let work = AT_WORK.begin().ok_or(JitError::Forked)?;
        if IS_ENDING.load(SeqCst) {
            return Err(JitError::Ending);
        }
        if IS_AT_ITS_END.get() || !IS_PAUSED.load(SeqCst) {
            return Ok(work);
        }
        drop(work);
        if held_back.get_or_insert_with(Instant::now).elapsed() > PAUSE {
            IS_PAUSED.store(false, SeqCst);
        }
        std::thread::sleep(STEP);
    }
}

/// Registers the handlers; called when LLVM has been loaded.
pub(crate) fn note_loaded() {
    watch_main_thread();
    system::call_at_exit();
}

/// Marks the current thread as one that does work.
pub(crate) fn note_worker() {
    IS_WORKER.set(true);
}

/// Counts completed work and registers the handler again if due.
pub(crate) fn note_work() {
    let done = WORKS_DONE.fetch_add(1, SeqCst).wrapping_add(1);
    if done <= FIRST_WORKS || done.is_power_of_two() {
        system::call_at_exit();
    }
}

/// Creates the main thread's value, if this is that thread.
fn watch_main_thread() {
    if system::is_main_thread() {
        // At its end the thread has no such value, and needs none.
        let _ = MAIN_THREAD.try_with(|_| ());
    }
}

fn wait_for_work() {
    let start = Instant::now();
    // In a child, interrupted work never ends.
    while AT_WORK.is_busy() && !AT_WORK.was_cut() && start.elapsed() < MAX_WAIT {
        std::thread::sleep(STEP);
    }
}

extern "C" fn at_exit() {
    IS_ENDING.store(true, SeqCst);
    // A thread that does work cannot wait for itself.
    if !IS_WORKER.get() {
        wait_for_work();
    }
}

#[cfg(unix)]
mod system {
    pub fn call_at_exit() {
        // Safety: the handler may be called at any time and any number of times. If there is no memory to register it,
        // the process ends as it would without it.
        unsafe { libc::atexit(super::at_exit) };
    }

    #[cfg(target_os = "linux")]
    pub fn is_main_thread() -> bool {
        // Safety: these functions take no arguments and only return numbers.
        unsafe { libc::gettid() == libc::getpid() }
    }

    #[cfg(not(target_os = "linux"))]
    pub fn is_main_thread() -> bool {
        false
    }
}

#[cfg(not(unix))]
mod system {
    pub fn call_at_exit() {
        // Machine code runs only on Unix.
        let _ = super::at_exit;
    }

    pub fn is_main_thread() -> bool {
        false
    }
}
