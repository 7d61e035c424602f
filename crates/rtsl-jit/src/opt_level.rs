//! Levels of optimisation.

use std::ffi::c_int;

use rtsl_packet::Kernel;

use crate::error::JitError;
use crate::frames;
use crate::limits::MAX_FRAME_BYTES;

/// The greatest work of a kernel that is optimised: more than ten times the largest in the standard library. A kernel
/// of that many operations without branches takes 7 seconds (LLVM 22, 8 lanes, Zen 3).
const STRAIGHT_WORK: u64 = 1 << 14;

/// The greatest work that is optimised if unoptimised code needs too much stack and no alternative is left: a minute
/// and a half.
const RETRIED_WORK: u64 = 1 << 15;

/// The level of optimisation; results are the same at every level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum OptLevel {
    /// Unoptimised code generation.
    O0,
    /// The cheapest passes: for code that runs once.
    O1,
    /// The passes that repay their compile time.
    #[default]
    O2,
    /// All passes.
    O3,
}

impl OptLevel {
    /// Returns the level for a module whose largest kernel has this [work](rtsl_packet::Kernel::work). A very long
    /// function is not optimised, since the time of optimisation grows with the square of its length.
    #[must_use]
    pub fn for_work(self, work: u64) -> OptLevel {
        if work > STRAIGHT_WORK { OptLevel::O0 } else { self }
    }

    /// Runs `compile` at the level [for the work](OptLevel::for_work) of the largest of these kernels, unless one of them
    /// needs a larger stack frame at any level. Unoptimised code gives every value that outlives its block a separate
    /// stack slot, a vector each. If that is too much, `compile` runs at the requested level, at which values share slots,
    /// if they have room.
    ///
    /// # Errors
    /// Those of `compile`, and [`JitError::Frame`].
    pub fn compile_kernels<'k, T>(
        self,
        kernels: impl IntoIterator<Item = (&'k str, &'k Kernel)>,
        compile: impl Fn(OptLevel) -> Result<T, JitError>,
    ) -> Result<T, JitError> {
        let (mut work, mut frame_bytes) = (0, 0);
        for (symbol, kernel) in kernels {
            work = work.max(kernel.work());
            frame_bytes = frame_bytes.max(frames::check_least(symbol, kernel)?);
        }
        let level = self.for_work(work);
        let made = compile(level);
        // LLVM adds an eighth to the values, or less.
        let has_room = frame_bytes + frame_bytes / 8 <= MAX_FRAME_BYTES;
        let can_retry = level != self && work <= RETRIED_WORK && has_room;
        match made {
            Err(JitError::Frame { .. }) if can_retry => compile(self),
            made => made,
        }
    }

    /// Returns the `LLVMCodeGenOptLevel`.
    pub(crate) fn code_generation(self) -> c_int {
        match self {
            OptLevel::O0 => 0,
            OptLevel::O1 => 1,
            OptLevel::O2 => 2,
            OptLevel::O3 => 3,
        }
    }
}
