//! A method, ready to be called for many rays.

use std::sync::Arc;

use rtsl_jit::{
    CallArguments, CallError, CallStatus, CompiledKernel, ComponentSet, HostArguments,
    LeafArguments, Objects,
};

use crate::interpreted::InterpretedKernel;

/// A method, ready to be called. Machine code and the interpreter are called alike and give
/// the same bits.
#[derive(Clone, Debug)]
pub struct Kernel {
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Compiled(CompiledKernel),
    Interpreted(Box<InterpretedKernel>),
}

impl Kernel {
    pub(crate) fn compiled(kernel: CompiledKernel) -> Kernel {
        Kernel { kind: Kind::Compiled(kernel) }
    }

    pub(crate) fn interpreted(kernel: InterpretedKernel) -> Kernel {
        Kernel { kind: Kind::Interpreted(Box::new(kernel)) }
    }

    /// Runs the method for all rays of the call.
    ///
    /// # Panics
    /// If the arguments' sizes do not fit the kernel, and with a panic of the host.
    // Inlined for the same reason as that of `CompiledKernel`.
    #[inline(always)]
    pub fn call(&self, call: CallArguments<'_>) -> CallStatus {
        match &self.kind {
            Kind::Compiled(kernel) => kernel.call(call),
            Kind::Interpreted(kernel) => kernel.call(call),
        }
    }

    /// Runs the method for all rays of a host's own arrays; machine code works on them where they are.
    ///
    /// # Errors
    /// If the arguments do not fit the kernel.
    ///
    /// # Panics
    /// With a panic of the host.
    pub fn call_host(&self, call: HostArguments<'_, '_>) -> Result<CallStatus, CallError> {
        match &self.kind {
            Kind::Compiled(kernel) => kernel.call_host(call),
            Kind::Interpreted(kernel) => kernel.call_host(call),
        }
    }

    /// The address of the machine code, a function that takes a pointer to a call as the C header describes it
    /// ([`kernel_header`](crate::ahead::kernel_header)); `None` on the interpreter. It is good as long as the kernel is kept.
    pub fn address(&self) -> Option<*const std::ffi::c_void> {
        match &self.kind {
            Kind::Compiled(kernel) => Some(kernel.address()),
            Kind::Interpreted(_) => None,
        }
    }

    /// `intersect` in the leaf shape for calls with these objects, each of which has little to check.
    ///
    /// # Panics
    /// If it is of another method or shape, or made for objects of another form.
    pub fn for_leaves(&self, objects: Arc<Objects>) -> LeafKernel {
        let kind = match &self.kind {
            Kind::Compiled(kernel) => {
                LeafKind::Compiled(rtsl_jit::LeafKernel::new(kernel, objects))
            }
            Kind::Interpreted(kernel) => {
                kernel.signature().check_leaf_objects(&objects);
                LeafKind::Interpreted(kernel.clone(), objects)
            }
        };
        LeafKernel { kind }
    }

    /// The state components whose arrays a call must bring.
    pub fn state_components(&self) -> ComponentSet {
        match &self.kind {
            Kind::Compiled(kernel) => kernel.signature().state,
            Kind::Interpreted(kernel) => kernel.signature().state,
        }
    }

    /// Whether it is machine code.
    pub fn is_compiled(&self) -> bool {
        match self.kind {
            Kind::Compiled(_) => true,
            Kind::Interpreted(_) => false,
        }
    }
}

/// `intersect` in the leaf shape and the objects that it is called for, found to fit each other once; see
/// [`Kernel::for_leaves`].
#[derive(Clone, Debug)]
pub struct LeafKernel {
    kind: LeafKind,
}

#[derive(Clone, Debug)]
enum LeafKind {
    Compiled(rtsl_jit::LeafKernel),
    Interpreted(Box<InterpretedKernel>, Arc<Objects>),
}

impl LeafKernel {
    /// Makes the tests.
    ///
    /// # Panics
    /// If there are no such objects, the rays' blocks do not fit the kernel, and with a panic of the
    /// host.
    // Inlined for the same reason as `Kernel::call`.
    #[inline(always)]
    pub fn call(&self, call: LeafArguments<'_>) -> CallStatus {
        match &self.kind {
            LeafKind::Compiled(kernel) => kernel.call(call),
            LeafKind::Interpreted(kernel, objects) => kernel.make_tests(call, objects),
        }
    }

    /// The objects.
    pub fn objects(&self) -> &Arc<Objects> {
        match &self.kind {
            LeafKind::Compiled(kernel) => kernel.objects(),
            LeafKind::Interpreted(_, objects) => objects,
        }
    }
}
