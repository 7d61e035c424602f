//! Kernels that exist soon, and later faster.

use std::sync::OnceLock;

use crate::codegen::kernel::Kernel;
use crate::codegen::kernel_compiler::FirstKernel;

/// A kernel whose code was generated without optimisation by LLVM, which takes a fraction of the time, and once a
/// background thread has made it, the optimised one. Both give the same bits.
#[derive(Debug)]
pub struct TieredKernel {
    first: Kernel,
    optimised: OnceLock<Kernel>,
}

impl TieredKernel {
    pub(crate) fn new(first: FirstKernel) -> TieredKernel {
        let FirstKernel { kernel, is_optimised } = first;
        let optimised = if is_optimised { kernel.clone().into() } else { OnceLock::new() };
        TieredKernel { first: kernel, optimised }
    }

    /// Returns the fastest kernel made so far.
    pub fn get(&self) -> &Kernel {
        self.optimised.get().unwrap_or(&self.first)
    }

    pub(crate) fn is_optimised(&self) -> bool {
        self.optimised.get().is_some()
    }

    pub(crate) fn set_optimised(&self, kernel: Kernel) {
        // The first one serves as well.
        let _ = self.optimised.set(kernel);
    }
}
