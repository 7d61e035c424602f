//! `intersect` in the leaf shape, ready for calls that have little to do each.

use std::sync::Arc;

use rtsl_abi::{CallStatus, LeafArguments, Objects};

use crate::kernel::CompiledKernel;

/// `intersect` in the leaf shape and the objects that it is called for. That they fit each other is
/// checked once: rays call it for every few leaves that they visit, so that every nanosecond of a call counts.
#[derive(Clone, Debug)]
pub struct LeafKernel {
    kernel: CompiledKernel,
    objects: Arc<Objects>,
}

impl LeafKernel {
    /// The kernel for calls with these objects.
    ///
    /// # Panics
    /// If the kernel is of another method or shape, or made for objects of another form.
    pub fn new(kernel: &CompiledKernel, objects: Arc<Objects>) -> LeafKernel {
        kernel.signature().check_leaf_objects(&objects);
        LeafKernel { kernel: kernel.clone(), objects }
    }

    /// The objects.
    pub fn objects(&self) -> &Arc<Objects> {
        &self.objects
    }

    /// Makes the tests.
    ///
    /// # Panics
    /// If there are no such objects, the rays' blocks do not fit the kernel, and with a panic of the
    /// host.
    // Inlined for the same reason as `CompiledKernel::call`.
    #[inline(always)]
    pub fn call(&self, call: LeafArguments<'_>) -> CallStatus {
        self.kernel.signature().check_leaf(&call, self.objects.len());
        // Safety: objects and kernel fit each other, as `new` checked, and neither changes; the rest
        // was checked just now.
        unsafe { self.kernel.call_leaf(call, &self.objects) }
    }
}
