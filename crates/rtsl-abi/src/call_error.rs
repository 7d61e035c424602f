//! Errors of kernel calls.

use crate::offsets::OBJECTS_IN_BLOCK;

/// The reason a call is refused: its arguments do not fit the kernel, or the stack has no room for it. Nothing was
/// called.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CallError {
    /// The state lacks the array of a component that the kernel accesses.
    #[error("the state has no array for component {0}")]
    MissingState(u32),
    /// Scratch lacks an array that the kernel accesses.
    #[error("scratch has no array {0}")]
    MissingScratch(u32),
    /// A call of `intersect` has no array for the accepted rays.
    #[error("`intersect` stores a mask of the rays with a hit, but the call has no array for it")]
    MissingAccepted,
    /// The single mode is called with more than one ray, with none, or with a mask.
    #[error("a kernel in the single mode takes one ray and no mask")]
    NotOneRay,
    /// The number of rays exceeds 2^31 - 1.
    #[error("{0} rays exceed the greatest number of a call, 2^31 - 1")]
    TooManyRays(usize),
    /// The arrays have too few lanes for the rays.
    #[error("{rays} rays need {needed} lanes, but the arrays have {given}")]
    TooFewLanes {
        /// The number of rays of the call.
        rays: usize,
        /// That number rounded up to the kernel's width.
        needed: usize,
        /// The number of lanes of the arrays.
        given: usize,
    },
    /// The call mode requires another form of instances.
    #[error("a kernel in the {0} mode takes its instances in another form")]
    InstanceForm(&'static str),
    /// The instance or the objects are not of the kernel's class.
    #[error("the instance is not one of the kernel's class")]
    ForeignInstance,
    /// An object index is out of range.
    #[error("an object index is out of range")]
    NoSuchObject,
    /// The first object of a leaf is not at the start of a block.
    #[error("the first object of a leaf must be a multiple of {OBJECTS_IN_BLOCK}, but is {0}")]
    NoBlockStart(u32),
    /// The stack of the calling thread has too little room left for the kernel and its host's functions: the thread has
    /// a small stack, or answers of the host call kernels too deeply.
    #[error("the calling thread's stack has too little room left for the kernel and its host")]
    NoStack,
}

impl CallError {
    /// Panics with the error, for calls that the caller guarantees to be valid.
    #[cold]
    #[inline(never)]
    pub fn refuse(&self) -> ! {
        panic!("the kernel can't be called: {self}")
    }
}
