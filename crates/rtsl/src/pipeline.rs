//! The whole compiler, stage by stage.

use std::fmt::Display;
use std::sync::Arc;

use rtsl_ir::class::Class;
use rtsl_ir::{Function, PlaceKind};
use rtsl_jit::{CompiledKernel, OptLevel, Signature, Target};
use rtsl_llvm::TargetFeatures;
use rtsl_packet::{Layout, Shape};
use rtsl_sema::check::check_unit;
use rtsl_sema::hir::ClassId;
use rtsl_sema::lower::lower_class;
use rtsl_source::Diagnostic;
use rtsl_spec::Method;
use rtsl_syntax::IncludeLoader;

use crate::compiler::CompilerOptions;
use crate::engine::Shared;
use crate::errors;
use crate::interpreted::InterpretedKernel;
use crate::kernel::Kernel;
use crate::link::{self, Linked};
use crate::options::{EngineOptions, Math};
use crate::prelude::prelude;
use crate::tree::ClassTree;
use crate::unit::{Compilation, Unit};

/// Text to classes.
pub(crate) fn compile(
    name: &str,
    text: &str,
    options: &CompilerOptions,
    loader: &mut dyn IncludeLoader,
) -> Compilation {
    let prelude = prelude();
    let mut sources = prelude.sources.clone();
    let mut diagnostics = prelude.diagnostics.clone();
    let file = sources.add(name, text);

    let tree = rtsl_syntax::parse(&mut sources, file, loader, &mut diagnostics);
    // What a broken text seems to mean is not worth complaining about.
    if diagnostics.has_errors() {
        return Compilation { unit: None, diagnostics, sources };
    }
    let module = check_unit(&tree, Some(&prelude.checked), &mut diagnostics);
    if diagnostics.has_errors() {
        return Compilation { unit: None, diagnostics, sources };
    }
    let mut classes = Vec::new();
    for index in prelude.checked.module().classes.len()..module.classes.len() {
        match lower_class(&module, ClassId(index as u32)) {
            Ok(class) => classes.push(Arc::new(with_budget(class, options))),
            Err(problems) => diagnostics.extend(problems),
        }
    }
    let unit = (!diagnostics.has_errors()).then_some(Unit { classes });
    Compilation { unit, diagnostics, sources }
}

/// Bounds what runs when an instance is made; methods are bounded when they are linked.
fn with_budget(mut class: Class, options: &CompilerOptions) -> Class {
    if let Some(budget) = options.loop_budget {
        let made = std::iter::once(&mut class.initializer).chain(&mut class.constructor);
        made.for_each(|function| rtsl_opt::budget::run(function, budget));
    }
    class
}

/// Links a method with those that it calls through references, and optimises the whole.
pub(crate) fn link(
    tree: &ClassTree,
    method: Method,
    options: &EngineOptions,
) -> Result<Linked, Diagnostic> {
    let linked = link::link(tree, method);
    let mut linked = linked.ok_or_else(|| errors::missing_method(&tree.class, method))??;
    let passes = rtsl_opt::Options {
        contract: options.math != Math::Strict,
        budget: options.loop_budget,
        optimize: options.optimization != OptLevel::O0,
    };
    rtsl_opt::optimize(&mut linked.function, &passes);
    Ok(linked)
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
    let failed = |error: &dyn Display| errors::code_generation(&function.name, error);
    let Some(llvm) = &shared.llvm else {
        let kernel = InterpretedKernel::new(function, layout, signature);
        return kernel.map(Kernel::interpreted).map_err(|error| failed(&error));
    };
    let packet = packet(function, shape, layout, shared.width)?;
    let text = llvm_text(&packet, llvm.host());
    let module = llvm.compile(&text, llvm.host(), shared.options.optimization);
    let module = module.map_err(|error| failed(&error))?;
    let kernel = CompiledKernel::new(Arc::new(module), SYMBOL, signature);
    kernel.map(Kernel::compiled).map_err(|error| failed(&error))
}

/// The packet code of a linked method.
pub(crate) fn packet(
    function: &Function,
    shape: Shape,
    layout: &Layout,
    width: u32,
) -> Result<rtsl_packet::Kernel, Diagnostic> {
    let packet = rtsl_packet::lower(function, layout, shape, width);
    packet.map_err(|error| errors::code_generation(&function.name, &error))
}

/// The text that LLVM gets.
pub(crate) fn llvm_text(packet: &rtsl_packet::Kernel, target: &Target) -> String {
    let features = TargetFeatures::new(target.triple(), target.cpu(), target.features());
    rtsl_llvm::emit([(SYMBOL, packet)], &features)
}

/// The name of the one function in each module.
const SYMBOL: &str = "kernel";

fn accepts_hits(function: &Function) -> bool {
    let kind = |output: &rtsl_ir::Output| function.place(output.place).kind;
    function.outputs.iter().any(|output| kind(output) == PlaceKind::Accepted)
}
