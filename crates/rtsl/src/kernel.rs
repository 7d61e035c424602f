//! A method, ready to be called for many rays.

use rtsl_jit::{CallArguments, CallStatus, CompiledKernel, ComponentSet};

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
