//! Detection of work interrupted by a fork of the process.
//!
//! A child process has only the thread that forked. Locks held by other threads remain locked for ever, and their work
//! remains unfinished. So work is counted: if any was in progress at a fork, the child refuses further work, which
//! would deadlock. Threads that wait for work are not in the child either: who keeps them starts others where [`forks`]
//! has changed.

use std::sync::Once;
use std::sync::atomic::Ordering::SeqCst;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicUsize};

/// Counts work of one kind, for the child processes.
#[derive(Debug)]
pub struct ForkGuard {
    under_way: AtomicUsize,
    /// True if this is a child and work was in progress when it was forked.
    was_cut: AtomicBool,
    watched: Once,
}

/// Marks work as in progress while this value lives.
#[derive(Debug)]
pub struct UnderWay<'a>(&'a ForkGuard);

/// The number of forks between this process and the one that first asked for it.
static FORKS: AtomicUsize = AtomicUsize::new(0);

/// The guards to update at a fork, followed by null.
static WATCHED: [AtomicPtr<ForkGuard>; 4] = [const { AtomicPtr::new(std::ptr::null_mut()) }; 4];

/// Returns the number of forks, which is another one in each child: what threads belong to a process is kept with it.
pub fn forks() -> usize {
    system::watch_forks();
    FORKS.load(SeqCst)
}

impl ForkGuard {
    /// Returns a guard without work.
    pub const fn new() -> ForkGuard {
        ForkGuard {
            under_way: AtomicUsize::new(0),
            was_cut: AtomicBool::new(false),
            watched: Once::new(),
        }
    }

    /// Begins work; `None` in a child whose parent had such work in progress when it forked.
    pub fn begin(&'static self) -> Option<UnderWay<'static>> {
        self.watched.call_once(|| self.watch());
        let work = UnderWay(self);
        self.under_way.fetch_add(1, SeqCst);
        (!self.was_cut()).then_some(work)
    }

    /// True if work can no longer be done in this process.
    pub fn was_cut(&self) -> bool {
        self.was_cut.load(SeqCst)
    }

    /// True if any work is in progress.
    pub fn is_busy(&self) -> bool {
        self.under_way.load(SeqCst) > 0
    }

    fn watch(&'static self) {
        system::watch_forks();
        let address = std::ptr::from_ref(self).cast_mut();
        let free = |it: &&AtomicPtr<ForkGuard>| {
            it.compare_exchange(std::ptr::null_mut(), address, SeqCst, SeqCst).is_ok()
        };
        let variable = WATCHED.iter().find(free);
        debug_assert!(variable.is_some(), "there is a variable for each guard of the program");
    }

    /// Updates the guard in a child, before any other code runs there.
    fn note_fork(&self) {
        if self.is_busy() {
            self.was_cut.store(true, SeqCst);
        }
    }
}

impl Default for ForkGuard {
    fn default() -> ForkGuard {
        ForkGuard::new()
    }
}

impl Drop for UnderWay<'_> {
    fn drop(&mut self) {
        self.0.under_way.fetch_sub(1, SeqCst);
    }
}

#[cfg(unix)]
mod system {
    use std::sync::Once;
    use std::sync::atomic::Ordering::SeqCst;

    use super::{FORKS, WATCHED};

    pub fn watch_forks() {
        static ONCE: Once = Once::new();
        // Safety: the handler may be called at any time, in a process with one thread: it only changes atomic numbers.
        // If there is no memory to register it, forks are not detected.
        ONCE.call_once(|| unsafe {
            libc::pthread_atfork(None, None, Some(in_child));
        });
    }

    unsafe extern "C" fn in_child() {
        for guard in &WATCHED {
            let guard = guard.load(SeqCst);
            // Safety: a pointer that is not null is the address of a guard that lives as long as the program.
            if let Some(guard) = unsafe { guard.as_ref() } {
                guard.note_fork();
            }
        }
        FORKS.fetch_add(1, SeqCst);
    }
}

#[cfg(not(unix))]
mod system {
    pub fn watch_forks() {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_child_goes_on_unless_work_was_cut() {
        static GUARD: ForkGuard = ForkGuard::new();
        let work = GUARD.begin();
        assert!(work.is_some() && GUARD.is_busy());
        drop(work);
        assert!(!GUARD.is_busy());
        GUARD.note_fork();
        let work = GUARD.begin();
        assert!(work.is_some());
        GUARD.note_fork();
        assert!(GUARD.was_cut() && GUARD.begin().is_none());
        drop(work);
        assert!(GUARD.begin().is_none());
    }
}
