//! Work on functions whose regions nest deeply.
//!
//! What walks a function recurses into its regions. They nest as deep as [`MAX_NESTING`](rtsl_ir::MAX_NESTING), and hosts
//! call from threads with little stack; in builds without optimisation a level of a pass takes some KiB.

use rtsl_ir::Function;
use rtsl_source::deep_stack;
use rtsl_spec::Method;

use crate::link::class_tree::ClassTree;

/// Regions in regions that the stack of any thread bears: nearly all functions have fewer, and need no thread.
const SHALLOW: usize = 24;

/// Does work that recurses into the regions of functions that nest so deep, on a stack that bears it.
pub(crate) fn bear<T: Send>(nesting: usize, work: impl FnOnce() -> T + Send) -> T {
    if nesting <= SHALLOW { work() } else { deep_stack::run(work) }
}

/// The same for any depth that a text can have.
pub(crate) fn bear_any<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    deep_stack::run(work)
}

/// The same for linking a method, and for what follows.
pub(crate) fn bear_linked<T: Send>(
    tree: &ClassTree,
    method: Method,
    work: impl FnOnce() -> T + Send,
) -> T {
    // Methods that it calls through references become regions in its own.
    match tree.class.methods.get(&method) {
        Some(function) if tree.class.references.is_empty() => bear_function(function, work),
        Some(_) => bear_any(work),
        None => work(),
    }
}

/// The same for one function.
pub(crate) fn bear_function<T: Send>(function: &Function, work: impl FnOnce() -> T + Send) -> T {
    bear(function.nesting(), work)
}
