//! Functions of the renderer's texts, called by hosts.

use rtsl_abi::{CallArguments, CallMode, InstanceBlock, Instances, LaneBlock, LaneMask};
use rtsl_integrate::text_call::link_alone;
use rtsl_ir::host::NoHost;
use rtsl_ir::{Constant, Variable};
use rtsl_source::Diagnostic;

use super::engine::Engine;
use crate::codegen::kernel::Kernel;
use crate::codegen::kernel_source::KernelSource;
use crate::codegen::variant::Variant;
use crate::nesting;

/// A function of the renderer's texts as a kernel for many rays: machine code, or the interpreter without a compiler.
/// The same text is a part of stages, so that both give the same bits.
///
/// ```
/// use rtsl::{Constant, Engine, EngineOptions, LaneBlock};
///
/// let (engine, _) = Engine::new(EngineOptions::default())?;
/// let hash = engine.renderer_function("rt_hash", &[Constant::U32(7)])?;
/// // The first parameter is known, the second is the first array, the result the next.
/// let mut columns = LaneBlock::new(hash.arrays(), 100);
/// columns.words_mut(0)[99] = 3;
/// hash.call(&mut columns, 100, None);
/// assert_ne!(columns.words(1)[99], columns.words(1)[98]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct RendererFunction {
    kernel: Kernel,
    arrays: usize,
    /// The members that take the places of its buffers.
    block: InstanceBlock,
}

impl Engine {
    /// Makes a kernel of a function of the renderer's texts, for known values of the first scalars of its parameters.
    /// Its arrays are those of the other scalars of parameters, in order, then those of its results.
    ///
    /// # Errors
    /// If linking passes a limit, or code generation fails.
    ///
    /// # Panics
    /// If there is no function of this name, or its parameters begin otherwise.
    pub fn renderer_function(
        &self,
        name: &str,
        known: &[Constant],
    ) -> Result<RendererFunction, Diagnostic> {
        self.renderer_function_with(name, known, &[])
    }

    /// As [`Engine::renderer_function`]; these members, with their words, take the places of its buffers.
    pub(crate) fn renderer_function_with(
        &self,
        name: &str,
        known: &[Constant],
        members: &[(Variable, Vec<u32>)],
    ) -> Result<RendererFunction, Diagnostic> {
        let variables: Vec<Variable> = members.iter().map(|(member, _)| member.clone()).collect();
        let words: Vec<u32> = members.iter().flat_map(|(_, words)| words.iter().copied()).collect();
        let link = || link_alone(name, known, &variables);
        let (function, layout) = nesting::with_deep_stack(link)?;
        let variant = Variant::new(CallMode::Packet);
        let function = self.compiler().optimise_stage(function, &variant, &layout);
        let source = KernelSource::new(&function, &variant, &layout, self.width());
        let kernel = self.compiler().unrecorded(source)?;
        let arrays = layout.scratch_arrays as usize;
        Ok(RendererFunction { kernel, arrays, block: InstanceBlock::new(&words, Vec::new()) })
    }
}

impl RendererFunction {
    /// The number of arrays that a call has.
    pub fn arrays(&self) -> usize {
        self.arrays
    }

    /// Calls the function for the first `count` lanes of the arrays, or those of a mask.
    pub fn call(&self, arrays: &mut LaneBlock, count: usize, mask: Option<&LaneMask>) {
        let _ = self.kernel.call(CallArguments {
            state: &mut LaneBlock::new(0, count),
            scratch: arrays,
            count,
            mask,
            accepted: None,
            instances: Instances::One(&self.block),
            host: &mut NoHost,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codegen::options::EngineOptions;
    use crate::codegen::trace::{Trace, TraceDetail};

    #[test]
    fn traces_do_not_record_the_texts() {
        let trace = Trace::new(TraceDetail::Steps);
        let options = EngineOptions { trace: Some(trace.clone()), ..EngineOptions::default() };
        let engine = Engine::new(options).unwrap().0;
        let hash = engine.renderer_function("rt_hash", &[Constant::U32(7)]).unwrap();
        let mut arrays = LaneBlock::new(hash.arrays(), 4);
        trace.start();
        hash.call(&mut arrays, 4, None);
        assert_ne!(arrays.words(1)[0], 0);
        assert!(trace.take().entries.is_empty());
    }
}
