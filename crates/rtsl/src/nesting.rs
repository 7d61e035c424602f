//! Stacks for work that recurses into the regions of functions.
//!
//! Regions nest up to [`MAX_NESTING`](rtsl_ir::MAX_NESTING) levels, a level of a pass takes some KiB in builds without
//! optimisation, and the threads of hosts may have small stacks.

use rtsl_source::deep_stack;

/// The nesting that the stack of any thread bears. Few functions nest deeper.
const SHALLOW: usize = 24;

/// Does work on a stack that bears functions of this nesting: this thread's if it is shallow.
pub(crate) fn with_stack_for<T: Send>(nesting: usize, work: impl FnOnce() -> T + Send) -> T {
    if nesting <= SHALLOW { work() } else { with_deep_stack(work) }
}

/// Does work on a stack that bears functions of any nesting.
pub(crate) fn with_deep_stack<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    deep_stack::run(work)
}
