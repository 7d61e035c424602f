//! `intersect` in the leaf shape, ready for calls that have little to do each.

use std::sync::Arc;

use rtsl_ir::host::Host;
use rtsl_packet::abi;

use crate::call::CallStatus;
use crate::kernel::CompiledKernel;
use crate::lanes::LaneBlock;
use crate::objects::Objects;

/// `intersect` in the leaf shape and the objects that it is called for. That they fit each other is
/// checked once: rays call it for every few leaves that they visit, so that every nanosecond of a call counts.
#[derive(Clone, Debug)]
pub struct LeafKernel {
    kernel: CompiledKernel,
    objects: Arc<Objects>,
}

/// One ray and some objects in a row, of which the one with the nearest hit is wanted.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct LeafTest {
    /// The lane of the ray in state and scratch, which a hit changes: so a call has one test of a lane.
    pub ray: u32,
    /// The number of the first object, a multiple of
    /// [`OBJECTS_IN_BLOCK`](rtsl_packet::abi::OBJECTS_IN_BLOCK).
    pub first: u32,
    /// The number of the object with the nearest hit, once the test is made.
    pub(crate) nearest: u32,
}

/// The arguments of a call of a [`LeafKernel`].
pub struct LeafArguments<'a> {
    /// The rays, as in [`CallArguments`](crate::CallArguments::state). What the nearest hit gave is left there.
    pub state: &'a mut LaneBlock,
    /// The rays' scratch.
    pub scratch: &'a mut LaneBlock,
    /// How many objects each test has.
    pub count: u32,
    /// What is to be tested.
    pub tests: &'a mut [LeafTest],
    /// Answers the shader's questions.
    pub host: &'a mut dyn Host,
}

impl LeafTest {
    /// The ray of this lane and the objects from this number on.
    #[inline(always)]
    pub fn new(ray: u32, first: u32) -> LeafTest {
        LeafTest { ray, first, nearest: abi::NO_OBJECT }
    }

    /// The number of the object with the nearest hit, of equally near ones the lowest; `None` if there is no
    /// hit.
    #[inline(always)]
    pub fn nearest(&self) -> Option<u32> {
        (self.nearest != abi::NO_OBJECT).then_some(self.nearest)
    }

    /// Notes what the test found.
    pub fn set_nearest(&mut self, nearest: Option<u32>) {
        self.nearest = nearest.unwrap_or(abi::NO_OBJECT);
    }
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
