//! Why a kernel can't be called.

use crate::offsets::OBJECTS_IN_BLOCK;

/// Why a call can't be made: its arguments do not fit the kernel, or there is no memory for it. Nothing was called.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CallError {
    /// A component of the state that the kernel touches has no array.
    #[error("the state has no array for component {0}")]
    MissingState(u32),
    /// An array of scratch is missing.
    #[error("scratch has no array {0}")]
    MissingScratch(u32),
    /// `intersect` reports hits.
    #[error("`intersect` reports which rays it found a hit for, and there is no variable for that")]
    MissingAccepted,
    /// The single shape is called for more rays than one, for none, or with a mask.
    #[error("a kernel of the single shape takes one ray and no mask")]
    NotOneRay,
    /// Counts are numbers of 32 bits.
    #[error("{0} rays are more than a call may have, 2^31 - 1")]
    TooManyRays(usize),
    /// There are more rays than lanes.
    #[error("{rays} rays take {needed} lanes, and there are {given}")]
    TooFewLanes {
        /// Rays of the call.
        rays: usize,
        /// That number rounded up to the kernel's width.
        needed: usize,
        /// The lanes that the arrays have room for.
        given: usize,
    },
    /// The kernel takes instances in another form.
    #[error("a kernel of the {0} shape takes its instances in another form")]
    InstanceForm(&'static str),
    /// The instance or objects are not of the kernel's class.
    #[error("the instance is not one of the kernel's class")]
    ForeignInstance,
    /// A number of an object is that of none.
    #[error("there is no object of that number")]
    NoSuchObject,
    /// The objects of a leaf begin inside a block.
    #[error("the objects of a leaf begin at a multiple of {OBJECTS_IN_BLOCK}, and {0} is none")]
    NoBlockStart(u32),
    /// The kernel needs a large stack while its host answers, and the system gives no memory for one.
    #[error("the system gives no memory for the stack that the kernel needs")]
    NoStack,
}

impl CallError {
    /// Panics with the error: of calls that must be possible.
    #[cold]
    #[inline(never)]
    pub fn refuse(&self) -> ! {
        panic!("the kernel can't be called: {self}")
    }
}
