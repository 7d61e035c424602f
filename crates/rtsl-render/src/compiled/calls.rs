//! Kernel calls for the rays of a packet.

use fearless_simd::Simd;
use rtsl::host::Host;
use rtsl::{
    CallArguments, CallStatus, Instances, Kernel, LaneBlock, LaneMask as MaskBlock, LeafArguments,
    LeafKernel, Method, new_state,
};
use rtsl_bvh::{LANES, LaneMask};

use super::mask_bits::set_bits;
use super::runtime_errors::RuntimeErrors;

/// The method that a kernel implements, by whose name errors of its calls are reported.
#[derive(Clone, Copy)]
pub struct Callee<'a> {
    /// The class.
    pub class: &'a str,
    /// Its method.
    pub method: Method,
    /// The record of runtime errors.
    pub errors: &'a RuntimeErrors,
}

impl Callee<'_> {
    /// Calls a kernel.
    #[inline(always)]
    pub fn call(&self, kernel: &Kernel, arguments: CallArguments<'_>) {
        self.check(kernel.call(arguments));
    }

    /// Calls a kernel for leaves.
    #[inline(always)]
    pub fn call_for_leaves(&self, kernel: &LeafKernel, arguments: LeafArguments<'_>) {
        self.check(kernel.call(arguments));
    }

    /// Calls a kernel for the first `count` lanes, without a record of those that accept hits.
    pub fn call_for_first(
        &self,
        kernel: &Kernel,
        count: usize,
        instances: Instances<'_>,
        state: &mut LaneBlock,
        scratch: &mut LaneBlock,
        host: &mut dyn Host,
    ) {
        let (mask, accepted) = (None, None);
        self.call(kernel, CallArguments { state, scratch, count, mask, accepted, instances, host });
    }

    /// Reports values that are not finite.
    pub fn report_not_finite(&self, count: u64) {
        if count > 0 {
            self.errors.report_not_finite(self.class, self.method, count);
        }
    }

    #[inline(always)]
    fn check(&self, status: CallStatus) {
        if status.budget_exhausted {
            self.errors.report(self.class, self.method);
        }
    }
}

/// The memory blocks of one call.
pub struct CallBlocks {
    /// The state.
    pub state: LaneBlock,
    /// The scratch.
    pub scratch: LaneBlock,
    /// The mask of active lanes, if these are not the first `count` lanes.
    pub mask: MaskBlock,
    /// True if the mask is used.
    pub is_masked: bool,
    /// The lanes in `mask`.
    masked: LaneMask,
    /// The lanes that accepted a hit.
    pub accepted: MaskBlock,
}

impl CallBlocks {
    /// Allocates blocks for shaders with at most so many scratch arrays.
    pub fn new(scratch_arrays: usize) -> Self {
        CallBlocks {
            state: new_state(LANES),
            scratch: LaneBlock::new(scratch_arrays, LANES),
            mask: MaskBlock::new(LANES),
            is_masked: false,
            masked: 0,
            accepted: MaskBlock::new(LANES),
        }
    }

    /// Prepares the mask for `lanes` if the call needs one, and returns the number of rays of the call.
    // Without a mask, full packets use the code specialised for them.
    #[inline(always)]
    pub fn prepare_mask<S: Simd>(&mut self, simd: S, lanes: LaneMask) -> usize {
        let count = LANES - lanes.leading_zeros() as usize;
        self.is_masked = lanes.trailing_ones() as usize != count;
        if self.is_masked && self.masked != lanes {
            set_bits(simd, &mut self.mask, lanes);
            self.masked = lanes;
        }
        count
    }
}
