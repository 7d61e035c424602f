//! The whole compiler, stage by stage. A reader starts here.
//!
//! 1. `compile`: text, over the built-in prelude, to the classes of a file: `rtsl_syntax::parse`
//!    (preprocessor, lexer, parser), `check_unit` (names, types, roles), `lower_class` (to the
//!    single-ray representation).
//! 2. `link`: a method and those it calls through references to one function, when instances are
//!    known: `link::link`, then `rtsl_opt::optimize`, which lists its passes.
//! 3. `specialise`: to a function for callers of whom more is known, if there is more:
//!    `rtsl_opt::specialise`.
//! 4. `kernels`: functions to machine code, when they are first called: `rtsl_packet::lower` (masks,
//!    one shape and width), `rtsl_llvm::emit` (text), `Llvm::compile` (LLVM's passes, object,
//!    loading). Without LLVM step 4 is the interpreter.
//!
//! `callback` goes through steps 2 and 4 for a host's own packets.
//!
//! What step 2 or 3 gives is also what [libraries](crate::aot) are made of: object files by step 4 but for loading,
//! C++ by `rtsl_cpp::emit`.

use std::sync::Arc;

use rtsl_abi::{BufferEntry, CallMode, DataLocation, Layout, Signature};
use rtsl_ir::class::Class;
use rtsl_ir::{Constant, Function, Output, VariableId, VariableKind};
use rtsl_jit::{
    CompiledCallback, CompiledKernel, JitError, Llvm, MAX_FRAME_BYTES, OptLevel, Target,
};
use rtsl_llvm::TargetFeatures;
use rtsl_lower::lower_class;
use rtsl_opt::unchanged::{self, VariableScalar};
use rtsl_packet::interleave;
use rtsl_sema::check::check_unit;
use rtsl_sema::hir::ClassId;
use rtsl_source::{Diagnostic, Diagnostics, deep_stack};
use rtsl_spec::{Method, lookup_state};
use rtsl_syntax::IncludeLoader;
use rtsl_syntax::ast::TranslationUnit;

use crate::codegen::callback::Callback;
use crate::codegen::interpreted::InterpretedKernel;
use crate::codegen::kernel::Kernel;
use crate::codegen::options::{EngineOptions, Math};
use crate::codegen::packet_kernel::PacketKernel;
use crate::codegen::touched::state_components;
use crate::codegen::variant::{Outputs, Variant};
use crate::compile::compiler::CompilerOptions;
use crate::compile::prelude::{Prelude, prelude};
use crate::compile::unit::{Compilation, Unit};
use crate::engine::engine::Engine;
use crate::engine::engine::{self, Shared};
use crate::errors;
use crate::link::class_tree::ClassTree;
use crate::link::hit::link_hit;
use crate::link::linker::{self as link, Linked};
use crate::nesting;

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
    // The trees end there too, since what nests deeply is dropped deeply.
    let classes = deep_stack::run(|| classes_of(tree, prelude, options, &mut diagnostics));
    let unit = (!diagnostics.has_errors()).then_some(Unit { classes });
    Compilation { unit, diagnostics, sources }
}

/// The classes of a syntax tree; where there are errors, those that have none.
fn classes_of(
    tree: TranslationUnit,
    prelude: &Prelude,
    options: &CompilerOptions,
    diagnostics: &mut Diagnostics,
) -> Vec<Arc<Class>> {
    let module = check_unit(&tree, Some(&prelude.checked), diagnostics);
    let mut classes = Vec::new();
    if diagnostics.has_errors() {
        return classes;
    }
    for index in prelude.checked.module().classes.len()..module.classes.len() {
        match lower_class(&module, ClassId(index as u32)) {
            Ok(class) => classes.push(Arc::new(with_budget(class, options))),
            Err(problems) => diagnostics.extend(problems),
        }
    }
    classes
}

/// The loop iterations of the initial values of a class where the host sets no budget. They are computed for everyone
/// who asks for a default or makes a library, as constants are, so they always come to an end.
const INITIAL_VALUES_BUDGET: u32 = 1 << 24;

/// Bounds what runs when an instance is made; methods are bounded when they are linked.
fn with_budget(mut class: Class, options: &CompilerOptions) -> Class {
    let budget = options.loop_budget.unwrap_or(INITIAL_VALUES_BUDGET);
    rtsl_opt::budget::run(&mut class.initializer, budget);
    if let (Some(budget), Some(constructor)) = (options.loop_budget, &mut class.constructor) {
        rtsl_opt::budget::run(constructor, budget);
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
    let set: Vec<VariableScalar> = unchanged::outputs(&linked.function).collect();
    rtsl_opt::optimize(&mut linked.function, &passes(options));
    let left: Vec<VariableScalar> = unchanged::outputs(&linked.function).collect();
    linked.unchanged = set.into_iter().filter(|it| !left.contains(it)).collect();
    Ok(linked)
}

fn passes(options: &EngineOptions) -> rtsl_opt::Options {
    rtsl_opt::Options {
        contract: options.math != Math::Strict,
        approximate: options.math == Math::Fast,
        budget: options.loop_budget,
        optimize: options.optimization != OptLevel::O0,
        select: true,
    }
}

/// A linked method for callers of whom more is known.
pub(crate) fn specialise(
    function: &Arc<Function>,
    variant: &Variant,
    layout: &Layout,
    options: &EngineOptions,
) -> Arc<Function> {
    let Variant { shape: _, outputs, known, unit_directions, objects: _, placed, width: _ } =
        variant;
    if *outputs == Outputs::ALL && known.is_empty() && !unit_directions && !placed {
        return function.clone();
    }
    let is_read = |output: &Output| {
        let variable = function.variable(output.variable);
        match variable.kind {
            VariableKind::State => {
                lookup_state(&variable.name).is_none_or(|it| outputs.has_state(it))
            }
            VariableKind::Scratch => outputs.has_scratch(),
            VariableKind::Accepted
            | VariableKind::Member
            | VariableKind::Parameter
            | VariableKind::Buffer
            | VariableKind::Local => true,
        }
    };
    let members = (0..).map(VariableId).zip(&function.variables);
    let members = members.filter(|(_, variable)| variable.kind == VariableKind::Member);
    let known = members.flat_map(|(id, variable)| {
        let first = layout.members[&variable.name];
        (0..variable.len).filter_map(move |index| {
            let bits = known.get(first + index)?;
            Some(((id, index), Constant::from_bits(variable.scalar, bits)))
        })
    });
    let caller = rtsl_opt::Caller {
        known: known.collect(),
        read: Some(function.outputs.iter().map(is_read).collect()),
        unit: unit_directions.then(|| ray_direction(function)).flatten().into_iter().collect(),
        placed: placed.then_some(rtsl_opt::Contract(options.math != Math::Strict)),
    };
    let mut function = Function::clone(function);
    rtsl_opt::specialise(&mut function, &caller, options.optimization != OptLevel::O0);
    Arc::new(function)
}

/// The place of the ray's direction, if the function has it.
pub(crate) fn ray_direction(function: &Function) -> Option<VariableId> {
    function.find_variable(VariableKind::State, "rt_RayDirection")
}

/// A kernel to make.
#[derive(Clone, Copy)]
pub(crate) struct Job<'a> {
    pub function: &'a Function,
    pub shape: CallMode,
    /// Rays at a time.
    pub width: u32,
    pub layout: &'a Layout,
}

impl<'a> Job<'a> {
    /// For a variant.
    pub fn new(
        function: &'a Function,
        variant: &Variant,
        layout: &'a Layout,
        shared: &Shared,
    ) -> Job<'a> {
        let width = variant.width_in(shared.width);
        Job { function, shape: variant.shape, width, layout }
    }

    /// Fewer rays at a time, for a kernel that needs so much stack, which is too much: a value that waits on it has a
    /// lane for each ray. Nobody can tell the widths apart but by time, and a kernel for fewer rays takes seconds less to
    /// compile where an optimised one takes minutes more.
    fn narrower_width(self, frame_bytes: usize) -> Option<u32> {
        let narrower = Engine::WIDTHS.into_iter().filter(|width| *width < self.width);
        let bytes = |width: u32| frame_bytes * width as usize / self.width as usize;
        narrower.clone().filter(|it| bytes(*it) <= MAX_FRAME_BYTES).max().or(narrower.min())
    }

    fn check_width(self) -> Result<(), Diagnostic> {
        if Engine::WIDTHS.contains(&self.width) {
            return Ok(());
        }
        Err(engine::unknown_width(self.width))
    }
}

/// Makes the kernels of linked methods: all in one module, which costs less than one each.
pub(crate) fn kernels(jobs: &[Job<'_>], shared: &Shared) -> Result<Vec<Kernel>, Diagnostic> {
    let nesting = jobs.iter().map(|job| job.function.nesting()).max().unwrap_or(0);
    nesting::bear(nesting, || kernels_of_shallow(jobs, shared))
}

fn kernels_of_shallow(jobs: &[Job<'_>], shared: &Shared) -> Result<Vec<Kernel>, Diagnostic> {
    let Some(llvm) = &shared.llvm else {
        return jobs.iter().map(|job| interpreted(*job)).collect();
    };
    let packets = jobs.iter().map(|job| packet(*job, shared));
    let packets = packets.collect::<Result<Vec<_>, _>>()?;
    // One job stands for all: a caller with several goes on to make them one by one.
    let (name, width) = jobs.first().map_or(("", 1), |job| (job.function.name.as_str(), job.width));
    let features = target_features(llvm.host());
    let kernels = CompiledKernel::compile(llvm, &packets, &features, shared.options.optimization);
    if let (&[job], Err(JitError::Frame { bytes, .. })) = (jobs, &kernels)
        && let Some(width) = job.narrower_width(*bytes)
    {
        return kernels_of_shallow(&[Job { width, ..job }], shared);
    }
    let kernels = kernels.map_err(|error| errors::machine_code(name, width, &error))?;
    Ok(kernels.into_iter().map(Kernel::compiled).collect())
}

/// A linked method on the interpreter.
pub(crate) fn interpreted(job: Job<'_>) -> Result<Kernel, Diagnostic> {
    job.check_width()?;
    let kernel = nesting::bear_function(job.function, || {
        InterpretedKernel::new(job.function, job.layout, signature(job))
    });
    let failed = |error| errors::code_generation(&job.function.name, &error);
    kernel.map(Kernel::interpreted).map_err(failed)
}

/// The packet code of a kernel, with what a call of it takes.
pub(crate) fn packet_kernel(job: Job<'_>, shared: &Shared) -> Result<PacketKernel, Diagnostic> {
    let packet = nesting::bear_function(job.function, || packet(job, shared))?;
    Ok(PacketKernel::new(packet, job.layout, signature(job)))
}

/// The packet code of a linked method.
pub(crate) fn packet(job: Job<'_>, shared: &Shared) -> Result<rtsl_packet::Kernel, Diagnostic> {
    job.check_width()?;
    let Job { function, shape, width, layout } = job;
    let packet = rtsl_packet::lower(function, layout, shape, width);
    let mut packet = packet.map_err(|error| errors::lowering(&function.name, &error))?;
    packet.interleave = interleave::choose(&packet, shared.options.interleave);
    Ok(packet)
}

/// The packet code of a function for a host's own packets: `intersect` and what follows a hit, linked as one.
pub(crate) fn callback_packet(
    tree: &ClassTree,
    callback: &Callback,
    layout: &Layout,
    shared: &Shared,
) -> Result<rtsl_packet::Kernel, Diagnostic> {
    let mut linked = link_hit(tree, &callback.record, callback.outputs)?;
    let passes = rtsl_opt::Options { select: callback.width > 1, ..passes(&shared.options) };
    rtsl_opt::optimize(&mut linked.function, &passes);
    let job =
        Job { function: &linked.function, shape: CallMode::Packet, width: callback.width, layout };
    job.check_width()?;
    let packet = rtsl_packet::lower_packet(job.function, layout, job.width);
    packet.map_err(|error| errors::lowering(&linked.function.name, &error))
}

/// A function for a host's own packets.
pub(crate) fn callback(
    tree: &ClassTree,
    callback: &Callback,
    layout: &Layout,
    shared: &Shared,
) -> Result<CompiledCallback, Diagnostic> {
    let llvm = shared.llvm.as_ref().ok_or_else(|| errors::no_machine_code(&tree.class))?;
    nesting::bear_any(|| callback_on_deep_stack(tree, callback, layout, (llvm, shared)))
}

fn callback_on_deep_stack(
    tree: &ClassTree,
    callback: &Callback,
    layout: &Layout,
    (llvm, shared): (&Arc<Llvm>, &Shared),
) -> Result<CompiledCallback, Diagnostic> {
    let packet = callback_packet(tree, callback, layout, shared)?;
    let (record, block_bytes) = (&callback.record, layout.block_words * 4);
    let (features, level) = (target_features(llvm.host()), shared.options.optimization);
    let compiled = CompiledCallback::compile(llvm, &packet, record, block_bytes, &features, level);
    compiled.map_err(|error| errors::machine_code(&packet.name, packet.width, &error))
}

/// The text that LLVM gets.
pub(crate) fn llvm_text(packet: &rtsl_packet::Kernel, target: &Target) -> String {
    rtsl_jit::module_text(std::slice::from_ref(packet), &target_features(target))
}

pub(crate) fn target_features(target: &Target) -> TargetFeatures {
    TargetFeatures::new(target.triple(), target.cpu(), target.features())
}

fn signature(job: Job<'_>) -> Signature {
    let kind = |output: &Output| job.function.variable(output.variable).kind;
    let form = job.layout.object_form(job.shape);
    let variables =
        job.function.variables.iter().filter(|variable| variable.kind == VariableKind::Buffer);
    let (mut buffers, mut object_buffers) = (Vec::new(), Vec::new());
    for variable in variables {
        let element_words = variable.len;
        match job.layout.locate(variable, form.as_ref()) {
            Some(DataLocation::Instance(offset)) => {
                buffers.push(BufferEntry { offset, element_words });
            }
            Some(DataLocation::Objects(offset)) => {
                object_buffers.push(BufferEntry { offset, element_words });
            }
            None => {}
        }
    }
    Signature {
        state: state_components(job.function),
        scratch_arrays: job.layout.scratch_arrays,
        block_words: job.layout.block_words,
        buffers: buffers.into(),
        object_words: form.map(|form| form.words().len() as u32),
        object_buffers: object_buffers.into(),
        mode: job.shape,
        accepts: job.function.outputs.iter().any(|output| kind(output) == VariableKind::Accepted),
        // Only machine code has chunks.
        separate_chunks: None,
    }
}
