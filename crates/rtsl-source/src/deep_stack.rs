//! A large stack for the parser and the stages that traverse its trees recursively.
//!
//! Callers' stacks may have any size, and an overflow aborts the process. The recursive stages
//! therefore run on a thread whose stack is large enough for the deepest nesting that is accepted,
//! in unoptimised builds too. If no thread can be started they run on the caller's stack and accept
//! less nesting.

use std::cell::Cell;
use std::sync::{Mutex, PoisonError};

/// The deepest nesting of text that any stage accepts: expressions and statements, counted
/// together. A chain of binary operators counts as one level, however long it is. Deeper text is an
/// error.
pub const MAX_DEPTH: usize = 1024;

/// The stack's size in bytes. The system commits its pages when they are first touched.
const SIZE: usize = 64 << 20;

/// The nesting that is accepted on a stack of unknown size.
const SHALLOW: usize = 64;

thread_local! {
    static IS_DEEP: Cell<bool> = const { Cell::new(false) };
}

/// Runs `work` on a deep stack: the caller's if it is one, else that of a new thread.
///
/// # Panics
/// If `work` panics, with the same payload.
pub fn run<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    if IS_DEEP.get() {
        return work();
    }
    let work = Mutex::new(Some(work));
    let span = tracing::Span::current();
    let take = || work.lock().unwrap_or_else(PoisonError::into_inner).take();
    let finished = std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().name("rtsl-compile".into()).stack_size(SIZE);
        let started = thread.spawn_scoped(scope, || {
            IS_DEEP.set(true);
            span.in_scope(|| take().map(|work| work()))
        });
        started.ok()?.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    });
    match finished {
        Some(finished) => finished,
        None => take().expect("no thread has taken it")(),
    }
}

/// The nesting of text that fits on the current thread's stack.
pub fn depth() -> usize {
    if IS_DEEP.get() { MAX_DEPTH } else { SHALLOW }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_done_once_and_on_a_deep_stack() {
        assert_eq!(depth(), SHALLOW);
        let mut done = 0;
        run(|| {
            done += 1;
            assert_eq!(run(depth), MAX_DEPTH);
        });
        assert_eq!((done, depth()), (1, SHALLOW));
    }

    #[test]
    fn panics_propagate() {
        let caught = std::panic::catch_unwind(|| run(|| -> u32 { std::panic::panic_any(7_u8) }));
        assert_eq!(caught.unwrap_err().downcast_ref::<u8>(), Some(&7));
    }
}
