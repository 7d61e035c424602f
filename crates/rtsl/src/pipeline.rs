//! The whole compiler, stage by stage.

use rtsl_ir::{Function, PlaceKind};
use rtsl_jit::Signature;
use rtsl_packet::{Layout, Shape};
use rtsl_source::{Diagnostic, Diagnostics, SourceMap, diagnostic_codes as codes};
use rtsl_spec::Method;
use rtsl_syntax::IncludeLoader;

use crate::compiler::CompilerOptions;
use crate::engine::Shared;
use crate::errors;
use crate::interpreted::InterpretedKernel;
use crate::kernel::Kernel;
use crate::link::{self, Linked};
use crate::options::EngineOptions;
use crate::tree::ClassTree;
use crate::unit::{Compilation, Unit};

/// Text to classes.
pub(crate) fn compile(
    name: &str,
    text: &str,
    _options: &CompilerOptions,
    loader: &mut dyn IncludeLoader,
) -> Compilation {
    let mut sources = SourceMap::new();
    let mut diagnostics = Diagnostics::new();
    let file = sources.add(name, text);
    let _tree = rtsl_syntax::parse(&mut sources, file, loader, &mut diagnostics);
    let unit = (!diagnostics.has_errors()).then(Unit::default);
    Compilation { unit, diagnostics, sources }
}

/// Links a method with those that it calls through references, and optimises the whole.
pub(crate) fn link(
    tree: &ClassTree,
    method: Method,
    _options: &EngineOptions,
) -> Result<Linked, Diagnostic> {
    link::link(tree, method).unwrap_or_else(|| Err(errors::missing_method(&tree.class, method)))
}

/// Makes the kernel of a linked method.
pub(crate) fn kernel(
    function: &Function,
    shape: Shape,
    layout: &Layout,
    shared: &Shared,
) -> Result<Kernel, Diagnostic> {
    let signature = Signature {
        scratch_arrays: layout.scratch_arrays,
        block_words: layout.block_words,
        many_instances: shape == Shape::Stream,
        accepts: accepts_hits(function),
    };
    if shared.llvm.is_none() {
        let kernel = InterpretedKernel::new(function, layout, signature);
        return kernel.map(Kernel::interpreted).map_err(|error| failed(function, &error));
    }
    Err(failed(function, &"machine code is not made yet"))
}

fn failed(function: &Function, reason: &dyn std::fmt::Display) -> Diagnostic {
    Diagnostic::new(
        codes::CODE_GENERATION,
        format!("`{}` can't be compiled: {reason}", function.name),
    )
}

fn accepts_hits(function: &Function) -> bool {
    let kind = |output: &rtsl_ir::Output| function.place(output.place).kind;
    function.outputs.iter().any(|output| kind(output) == PlaceKind::Accepted)
}
