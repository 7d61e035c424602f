//! Pools of threads that a process and each of its children have for themselves.

use std::sync::{Arc, Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::forks::forks;

/// A pool of threads. In a child process, which has none of them, it starts others.
#[derive(Debug)]
pub struct Pool {
    /// The number of threads; 0 for all processors.
    threads: usize,
    /// The stack of a thread; the usual one if `None`.
    stack_bytes: Option<usize>,
    started: Mutex<Option<Arc<Started>>>,
}

/// The threads of one process.
#[derive(Debug)]
struct Started {
    /// `None` once it is dropped.
    pool: Option<ThreadPool>,
    /// The number of [forks] before the process.
    forks: usize,
}

/// The pool of work that no other pool does.
static ALL_PROCESSORS: Pool = Pool::new(0, None);

/// Does work whose iterators and joins of `rayon` run on all processors, unless a thread of a pool calls this: then on
/// that pool. `rayon`'s own pool, which such work would take, has no threads in a child process, and waits for ever.
///
/// ```
/// use rayon::prelude::*;
///
/// let sum: u64 = rtsl_memory::on_all_processors(|| (0..100_u64).into_par_iter().sum());
/// assert_eq!(sum, 4950);
/// ```
///
/// # Panics
/// If the threads cannot be started.
pub fn on_all_processors<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    match rayon::current_thread_index() {
        Some(_) => work(),
        None => ALL_PROCESSORS.started().pool().install(work),
    }
}

impl Pool {
    /// Returns a pool of so many threads, 0 for all processors, which start with its first work.
    pub const fn new(threads: usize, stack_bytes: Option<usize>) -> Pool {
        Pool { threads, stack_bytes, started: Mutex::new(None) }
    }

    /// Starts the threads, if this process has not.
    ///
    /// # Errors
    /// If they cannot be started.
    pub fn start(&self) -> Result<(), ThreadPoolBuildError> {
        self.of_process().map(drop)
    }

    /// Calls `work` on each thread, and returns the results in the order of the threads.
    ///
    /// # Panics
    /// If the threads have not been started before and cannot be.
    pub fn broadcast<T: Send>(&self, work: impl Fn() -> T + Sync) -> Vec<T> {
        self.started().pool().broadcast(|_| work())
    }

    fn started(&self) -> Arc<Started> {
        let started = self.of_process();
        started.unwrap_or_else(|error| panic!("the threads of a process cannot start: {error}"))
    }

    /// Returns the threads of this process, which start unless they have.
    fn of_process(&self) -> Result<Arc<Started>, ThreadPoolBuildError> {
        let mut started = self.started.lock().unwrap_or_else(PoisonError::into_inner);
        let forks = forks();
        if let Some(started) = started.as_ref().filter(|it| it.forks == forks) {
            return Ok(started.clone());
        }
        let builder = ThreadPoolBuilder::new().num_threads(self.threads);
        let builder = match self.stack_bytes {
            Some(bytes) => builder.stack_size(bytes),
            None => builder,
        };
        let made = Arc::new(Started { pool: Some(builder.build()?), forks });
        *started = Some(made.clone());
        Ok(made)
    }
}

impl Started {
    fn pool(&self) -> &ThreadPool {
        self.pool.as_ref().expect("it is there until it is dropped")
    }
}

impl Drop for Started {
    fn drop(&mut self) {
        if self.forks != forks() {
            // The threads are the parent's, and may hold locks that the end of the pool takes.
            std::mem::forget(self.pool.take());
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::time::{Duration, Instant};

    use rayon::prelude::*;

    use super::*;

    fn sum() -> u64 {
        on_all_processors(|| (0..1000_u64).into_par_iter().map(|it| it * it).sum())
    }

    /// Does work in a child process; `None` if it does not end, or fails.
    fn in_child(work: impl FnOnce() -> bool) -> Option<bool> {
        // Safety: the child does work that starts threads of its own, and ends without handlers of the parent's.
        let child = unsafe { libc::fork() };
        if child == 0 {
            let is_right = work();
            // Safety: it ends the process.
            unsafe { libc::_exit(i32::from(!is_right)) };
        }
        let start = Instant::now();
        let mut status = 0;
        // Safety: the status is a place for a number, and the child is this process's.
        while unsafe { libc::waitpid(child, &raw mut status, libc::WNOHANG) } == 0 {
            if start.elapsed() > Duration::from_secs(20) {
                // Safety: as above.
                unsafe { libc::kill(child, libc::SIGKILL) };
                return None;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        Some(libc::WIFEXITED(status) && libc::WEXITSTATUS(status) == 0)
    }

    #[test]
    fn children_have_threads_of_their_own() {
        let own = Pool::new(3, Some(1 << 20));
        own.start().unwrap();
        assert_eq!((sum(), own.broadcast(|| 7)), (332_833_500, vec![7; 3]));
        let is_right = in_child(|| {
            let right = sum() == 332_833_500 && own.broadcast(|| 7) == [7; 3];
            // The parent's threads are gone, and so is this pool of both.
            drop(own);
            right && in_child(|| sum() == 332_833_500) == Some(true)
        });
        assert_eq!(is_right, Some(true));
        assert_eq!(sum(), 332_833_500);
    }

    #[test]
    fn threads_of_a_pool_work_on_it() {
        let own = Pool::new(2, None);
        let counts = own.broadcast(|| on_all_processors(rayon::current_num_threads));
        assert_eq!(counts, [2, 2]);
    }
}
