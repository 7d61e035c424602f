//! A background thread.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread::JoinHandle;

use rtsl_source::{Diagnostic, diagnostic_codes as codes};

use crate::at_work::{begin_work, was_cut};

/// A handle to the result of work. Dropping the handle cancels the work if it has not started.
pub(crate) type Answer<T> = Arc<OnceLock<Result<T, Diagnostic>>>;

/// Waits for the result of work; not if the work was in progress when this process was forked, and so never ends.
pub(crate) fn wait<T>(answer: &Answer<T>) {
    if answer.get().is_some() || !was_cut() {
        answer.wait();
    }
}

/// Does work in order on a thread, which starts with the first work of the process and ends with this value.
#[derive(Debug, Default)]
pub(crate) struct Background {
    worker: Mutex<Option<Worker>>,
}

type Work = Box<dyn FnOnce() + Send>;

#[derive(Debug)]
struct Worker {
    /// The number of [forks](rtsl_memory::forks) before the process that has the thread.
    forks: usize,
    /// `None` while the worker is dropped, which closes the thread's queue.
    queue: Option<Sender<Work>>,
    thread: Option<JoinHandle<()>>,
}

impl Background {
    /// Queues work. If the thread can't start, the answer is an error. Children know of work that is not done.
    pub fn start<T: Send + Sync + 'static>(
        &self,
        work: impl FnOnce() -> Result<T, Diagnostic> + Send + 'static,
    ) -> Answer<T> {
        let answer = Answer::default();
        let queued = begin_work().and_then(|under_way| {
            self.queue(Self::answering(&answer, move || {
                let _under_way = under_way;
                work()
            }))
        });
        if let Err(error) = queued {
            let _ = answer.set(Err(error));
        }
        answer
    }

    /// Returns work that sets the answer, if anybody still wants it.
    fn answering<T: Send + Sync + 'static>(
        answer: &Answer<T>,
        work: impl FnOnce() -> Result<T, Diagnostic> + Send + 'static,
    ) -> Work {
        let wanted = Arc::downgrade(answer);
        Box::new(move || {
            let Some(answer) = wanted.upgrade() else { return };
            let result = catch_unwind(AssertUnwindSafe(work));
            // Only this closure sets the answer.
            let _ = answer.set(result.unwrap_or_else(|_| Err(failed("the compiler panicked"))));
        })
    }

    fn queue(&self, work: Work) -> Result<(), Diagnostic> {
        let mut worker = self.worker.lock().unwrap_or_else(PoisonError::into_inner);
        let forks = rtsl_memory::forks();
        let worker = match &mut *worker {
            Some(worker) if worker.forks == forks => worker,
            other => other.insert(Worker::start(forks)?),
        };
        let sent = worker.queue.as_ref().is_some_and(|it| it.send(work).is_ok());
        sent.then_some(()).ok_or_else(|| failed("its thread has ended"))
    }
}

impl Worker {
    fn start(forks: usize) -> Result<Worker, Diagnostic> {
        let (queue, work) = channel::<Work>();
        let body = move || work.into_iter().for_each(|work| work());
        let thread = std::thread::Builder::new().name("rtsl-background".to_owned()).spawn(body);
        let thread = thread.map_err(|error| failed(&format!("no thread to work on: {error}")))?;
        Ok(Worker { forks, queue: Some(queue), thread: Some(thread) })
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        if self.forks != rtsl_memory::forks() {
            // The thread is the parent's, and may hold the lock of the queue.
            std::mem::forget((self.queue.take(), self.thread.take()));
            return;
        }
        self.queue = None;
        // Code generation must not outlive the worker: the end of a process destroys LLVM's globals.
        if let Some(Err(_)) = self.thread.take().map(JoinHandle::join) {
            debug_assert!(false, "work is guarded against panics");
        }
    }
}

fn failed(reason: &str) -> Diagnostic {
    Diagnostic::new(codes::CODE_GENERATION, format!("work in the background failed: {reason}"))
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    /// Keeps the thread busy until the sender is used or dropped.
    fn block(background: &Background) -> (Answer<()>, Sender<()>) {
        let (release, wait) = channel::<()>();
        let answer = background.start(move || {
            let _ = wait.recv();
            Ok(())
        });
        (answer, release)
    }

    #[test]
    fn work_is_done_in_order_but_for_what_nobody_wants_any_more() {
        let background = Background::default();
        let (_, release) = block(&background);
        let done = Arc::new(Mutex::new(Vec::new()));
        let start = |number: u32| {
            let done = done.clone();
            background.start(move || {
                done.lock().unwrap().push(number);
                Ok(number)
            })
        };
        let first = start(1);
        let second = start(2);
        let third = start(3);
        drop(second);
        drop(release);
        assert_eq!(third.wait(), &Ok(3));
        assert_eq!(first.get(), Some(&Ok(1)));
        assert_eq!(*done.lock().unwrap(), [1, 3]);
    }

    #[test]
    fn errors_and_panics_are_answers() {
        let background = Background::default();
        let error = failed("on purpose");
        let given = error.clone();
        assert_eq!(background.start::<()>(move || Err(given)).wait(), &Err(error));
        let panicked = background.start::<()>(|| panic!("a panic on purpose"));
        assert!(panicked.wait().is_err());
        assert_eq!(background.start(|| Ok(7)).wait(), &Ok(7));
    }

    #[test]
    fn dropping_waits_for_what_is_wanted() {
        let background = Background::default();
        let (blocking, release) = block(&background);
        let wanted = background.start(|| Ok(()));
        drop(release);
        drop(background);
        assert!(blocking.get().is_some() && wanted.get().is_some());
    }
}
