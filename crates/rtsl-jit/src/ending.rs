//! The end of the process: LLVM's globals are destroyed then, and no thread may be at work with them.
//!
//! `exit` first destroys what its own thread has of thread-local values, then calls handlers, those registered last
//! first. LLVM registers the destruction of its globals when it is loaded, and that of some when they are first used, at
//! any moment of any work. So work must have stopped before the first handler: a thread-local value of the main thread,
//! which most processes end on, sees to that. It can't know whether the process ends or that thread alone, so it lets work
//! that is under way be done, and holds back more of it for a moment. A handler of our own then knows that the process
//! ends, and refuses more work for good; where another thread than the main one calls `exit`, it is what waits, and is
//! registered again after works so that it comes early.

use std::cell::Cell;
use std::sync::atomic::Ordering::SeqCst;
use std::sync::atomic::{AtomicBool, AtomicU32};
use std::time::{Duration, Instant};

use crate::error::JitError;
use crate::forks::{ForkGuard, UnderWay};

/// The work that is waited for.
static AT_WORK: ForkGuard = ForkGuard::new();

static IS_ENDING: AtomicBool = AtomicBool::new(false);
/// The main thread is ending, and perhaps the process.
static IS_PAUSED: AtomicBool = AtomicBool::new(false);
static WORKS_DONE: AtomicU32 = AtomicU32::new(0);

/// After each of so many works the handler is registered again; then ever more seldom. Most globals are used by then.
const FIRST_WORKS: u32 = 64;

/// The longest that the process is kept from ending.
const MAX_WAIT: Duration = Duration::from_secs(10);

/// How long work is held back when the main thread ends: within this time the process ends, if it does.
const PAUSE: Duration = Duration::from_secs(1);

/// How long it takes at most to notice a change.
const STEP: Duration = Duration::from_millis(1);

thread_local! {
    /// Whether this thread does work.
    static IS_WORKER: Cell<bool> = const { Cell::new(false) };
    /// Whether this is the main thread, and its thread-local values are being destroyed or gone.
    static IS_AT_ITS_END: Cell<bool> = const { Cell::new(false) };
    static MAIN_THREAD: MainThread = const { MainThread };
}

/// A value of the main thread.
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

/// The forks before this process.
pub(crate) fn forks() -> usize {
    AT_WORK.forks()
}

/// LLVM is loaded.
pub(crate) fn note_loaded() {
    watch_main_thread();
    system::call_at_exit();
}

/// Called by a thread that does work, at its start.
pub(crate) fn note_worker() {
    IS_WORKER.set(true);
}

/// Work is done.
pub(crate) fn note_work() {
    let done = WORKS_DONE.fetch_add(1, SeqCst).wrapping_add(1);
    if done <= FIRST_WORKS || done.is_power_of_two() {
        system::call_at_exit();
    }
}

/// Makes the main thread's value, if this is that thread.
fn watch_main_thread() {
    if system::is_main_thread() {
        // At its end it has none, and needs none.
        let _ = MAIN_THREAD.try_with(|_| ());
    }
}

fn wait_for_work() {
    let start = Instant::now();
    // A child has no thread whose work was cut.
    while AT_WORK.is_busy() && !AT_WORK.was_cut() && start.elapsed() < MAX_WAIT {
        std::thread::sleep(STEP);
    }
}

extern "C" fn at_exit() {
    IS_ENDING.store(true, SeqCst);
    // A thread that does work can't wait for itself.
    if !IS_WORKER.get() {
        wait_for_work();
    }
}

#[cfg(unix)]
mod system {
    use std::ffi::c_int;

    unsafe extern "C" {
        fn atexit(handler: extern "C" fn()) -> c_int;
    }

    pub fn call_at_exit() {
        // Safety: the handler may be called at any time and any number of times. Where there is no memory for it, the
        // process ends as it would without it.
        unsafe { atexit(super::at_exit) };
    }

    #[cfg(target_os = "linux")]
    pub fn is_main_thread() -> bool {
        // Safety: these take nothing and only tell numbers.
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
        // Machine code runs on Unix alone.
        let _ = super::at_exit;
    }

    pub fn is_main_thread() -> bool {
        false
    }
}
