//! Requests for kernels.

use std::sync::Arc;

use rtsl_abi::Layout;
use rtsl_spec::Method;

use super::program::Program;
use crate::codegen::kernel_compiler::KernelCompiler;
use crate::codegen::kernel_source::KernelSource;
use crate::codegen::variant::Variant;

/// A kernel that a host asks for.
#[derive(Clone, Debug)]
pub struct KernelRequest {
    /// The program.
    pub program: Arc<Program>,
    /// The method.
    pub method: Method,
    /// The variant.
    pub variant: Variant,
}

impl KernelRequest {
    /// A kernel of a method; a [`CallMode`](rtsl_abi::CallMode) asks for the general kernel of that mode.
    pub fn new(program: &Arc<Program>, method: Method, variant: impl Into<Variant>) -> Self {
        KernelRequest { program: program.clone(), method, variant: variant.into() }
    }

    /// True if both ask for the same kernel. Their variants are canonical.
    pub(crate) fn is_same(&self, other: &KernelRequest) -> bool {
        Arc::ptr_eq(&self.program, &other.program)
            && self.method == other.method
            && self.variant == other.variant
    }

    /// Makes the kernels of requests with canonical variants in one module. If one fails, none is made: hosts then ask
    /// for each kernel and get its error.
    pub(crate) fn make_together(requests: &[&KernelRequest], compiler: &KernelCompiler) {
        let functions = requests.iter().map(|KernelRequest { program, method, variant }| {
            program.method(*method).map(|method| program.specialise(&method, variant))
        });
        let Ok(functions) = functions.collect::<Result<Vec<_>, _>>() else { return };
        let layouts = requests.iter().map(|it| it.variant.layout(it.program.layout()));
        let layouts: Vec<Layout> = layouts.collect();
        let sources = requests.iter().zip(&functions).zip(&layouts);
        let sources = sources.map(|((request, function), layout)| {
            KernelSource::new(function, &request.variant, layout, compiler.width())
        });
        let Ok(kernels) = compiler.kernels(&sources.collect::<Vec<_>>()) else { return };
        for (KernelRequest { program, method, variant }, kernel) in requests.iter().zip(kernels) {
            program.keep(*method, variant, kernel);
        }
    }
}
