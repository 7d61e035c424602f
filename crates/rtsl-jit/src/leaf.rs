//! Kernels of the leaf shape, ready for calls that have little to do each.

use std::sync::Arc;

use rtsl_ir::host::Host;

use crate::call::CallStatus;
use crate::kernel::CompiledKernel;
use crate::lanes::LaneBlock;
use crate::objects::Objects;

/// A kernel of the leaf shape and the objects that it is called for. That they fit each other is
/// checked once: a ray calls it for every leaf that it visits, with a few objects each time, so that every
/// nanosecond of a call counts.
#[derive(Clone, Debug)]
pub struct LeafKernel {
    kernel: CompiledKernel,
    objects: Arc<Objects>,
}

/// The arguments of a call of a [`LeafKernel`]: for all objects of a range, as
/// [`Instances::Range`](crate::Instances::Range) says.
pub struct LeafArguments<'a> {
    /// The ray, in lane 0, as in [`CallArguments`](crate::CallArguments::state).
    pub state: &'a mut LaneBlock,
    /// The ray's scratch.
    pub scratch: &'a mut LaneBlock,
    /// The number of the first object, a multiple of
    /// [`OBJECTS_IN_BLOCK`](rtsl_packet::abi::OBJECTS_IN_BLOCK).
    pub first: u32,
    /// How many objects.
    pub count: u32,
    /// Answers the shader's questions.
    pub host: &'a mut dyn Host,
}

impl LeafKernel {
    /// The kernel for calls with these objects.
    ///
    /// # Panics
    /// If the kernel is of another shape, or made for objects of another form.
    pub fn new(kernel: &CompiledKernel, objects: Arc<Objects>) -> LeafKernel {
        kernel.signature().check_leaf_objects(&objects);
        LeafKernel { kernel: kernel.clone(), objects }
    }

    /// The objects.
    pub fn objects(&self) -> &Arc<Objects> {
        &self.objects
    }

    /// Runs the method for the objects of the range.
    ///
    /// # Panics
    /// If there are no such objects, the ray's blocks do not fit the kernel, and with a panic of the
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
