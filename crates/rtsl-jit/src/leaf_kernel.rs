//! `intersect` in the leaf mode, prepared for calls with little overhead.

use std::sync::Arc;

use rtsl_abi::{CallStatus, LeafArguments, Objects};

use crate::kernel::CompiledKernel;

/// `intersect` in the leaf mode and the objects for which it is called. Their compatibility is checked once: rays call
/// it for every few leaves that they visit, so the overhead of a call matters.
#[derive(Clone, Debug)]
pub struct LeafKernel {
    kernel: CompiledKernel,
    objects: Arc<Objects>,
}

impl LeafKernel {
    /// Returns the kernel for calls with these objects.
    ///
    /// # Panics
    /// If the kernel is of another method or call mode, or compiled for objects of another form.
    pub fn new(kernel: &CompiledKernel, objects: Arc<Objects>) -> LeafKernel {
        kernel.signature().check_leaf_objects(&objects);
        LeafKernel { kernel: kernel.clone(), objects }
    }

    /// Returns the objects.
    pub fn objects(&self) -> &Arc<Objects> {
        &self.objects
    }

    /// Executes the tests.
    ///
    /// # Panics
    /// If the objects are out of range, the rays' blocks do not fit the kernel, the stack has no room for it, or the host
    /// panics.
    // Inlined for the same reason as `CompiledKernel::call`.
    #[inline(always)]
    pub fn call(&self, call: LeafArguments<'_>) -> CallStatus {
        self.kernel.signature().check_leaf(&call, self.objects.len());
        if let Err(error) = self.kernel.check_stack() {
            error.refuse();
        }
        // Safety: objects and kernel fit each other, as `new` checked, and neither changes; the rest
        // was checked just now.
        unsafe { self.kernel.call_leaf(call, &self.objects) }
    }
}
