//! Work that is in progress, for the children of this process.

use rtsl_memory::{ForkGuard, UnderWay};
use rtsl_source::{Diagnostic, diagnostic_codes as codes};

/// Calls of hosts, and the work of engines in the background.
static WORK: ForkGuard = ForkGuard::new();

/// Marks a call as in progress while the result lives. A host that may be forked begins each of its calls with this: a
/// child has none of its parent's other threads, and would wait for ever for what those held.
///
/// # Errors
/// In a child that was forked while another thread of its parent made such a call, or while an engine compiled in the
/// background.
///
/// ```
/// let call = rtsl::begin_work()?;
/// // Compile, link, call kernels.
/// drop(call);
/// # Ok::<(), rtsl::Diagnostic>(())
/// ```
pub fn begin_work() -> Result<UnderWay<'static>, Diagnostic> {
    WORK.begin().ok_or_else(|| {
        let message = "this process was forked while its parent was at work in RTSL: what the parent's threads held \
                       stays locked here";
        Diagnostic::new(codes::FORKED, message).help(
            "fork while no call is under way and no kernel is compiled in the background, or start new processes: in \
             Python with the start method `spawn`",
        )
    })
}

/// True if work was in progress when this process was forked: it does not end here.
pub(crate) fn was_cut() -> bool {
    WORK.was_cut()
}
