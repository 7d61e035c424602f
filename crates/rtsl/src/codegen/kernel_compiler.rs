//! The pipeline from the methods of a class to kernels, in the order of its steps:
//!
//! 1. [`link`](KernelCompiler::link): a method and the methods that it calls through references become one function,
//!    which the passes of `rtsl_opt::optimize` simplify.
//! 2. [`specialise`](KernelCompiler::specialise): `rtsl_opt::specialise` simplifies the function for callers with known
//!    values.
//! 3. [`packet`](KernelCompiler::packet): `rtsl_packet::lower` makes packet code with masks, for one call mode and
//!    width.
//! 4. [`kernels`](KernelCompiler::kernels): `rtsl_llvm` writes packet code as text, LLVM compiles the text to an object
//!    file, which `rtsl_jit` loads. Without LLVM the interpreter runs the function of step 2.
//!
//! [`callback`](KernelCompiler::callback) takes the same steps to a function for a host's own packets. Libraries
//! ([`crate::aot`]) are made of the results of steps 2 and 3.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_abi::{CallMode, Layout};
use rtsl_ir::{Constant, Function, Output, VariableId, VariableKind};
use rtsl_jit::{CompiledCallback, CompiledKernel, JitError, Llvm, OptLevel, Target};
use rtsl_link::hit::link_hit;
use rtsl_link::{ClassTree, LinkedMethod, Outputs};
use rtsl_llvm::TargetFeatures;
use rtsl_opt::unchanged::{self, VariableScalar};
use rtsl_packet::interleave;
use rtsl_source::{Diagnostic, Diagnostics};
use rtsl_spec::{Method, lookup_state};

use super::callback::Callback;
use super::counted::CountedKernel;
use super::interpreted::InterpretedKernel;
use super::kernel::Kernel;
use super::kernel_source::KernelSource;
use super::options::{Backend, EngineOptions, Math};
use super::packet_kernel::PacketKernel;
use super::touched::recorded_state_components;
use super::traced_method::Traced;
use super::variant::Variant;
use crate::{errors, nesting};

/// Rays at a time of kernels whose work is recorded, if no width is asked for: the same on every machine.
const COUNTED_WIDTH: u32 = 8;

/// The way in which methods get the light of rays that they trace, and of lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Light {
    /// They wait for it.
    Awaited,
    /// A renderer adds it once they have ended, where they are affine in it.
    Deferred,
}

/// A kernel that was made soon.
pub(crate) struct FirstKernel {
    pub kernel: Kernel,
    /// True if there is no faster code of it.
    pub is_optimised: bool,
}

/// Compiles methods of linked classes to kernels.
#[derive(Debug)]
pub(crate) struct KernelCompiler {
    options: EngineOptions,
    width: u32,
    /// `None`: the interpreter runs all kernels.
    llvm: Option<Arc<Llvm>>,
}

impl KernelCompiler {
    /// Creates a compiler, and a warning if it falls back on the interpreter.
    ///
    /// # Errors
    /// If the options ask for machine code and there is no LLVM, if `RTSL_LLVM` names a library that can't be used, or
    /// if the options have an unknown width or number of vectors.
    pub fn new(options: EngineOptions) -> Result<(KernelCompiler, Diagnostics), Diagnostic> {
        let mut warnings = Diagnostics::new();
        let llvm = match options.backend {
            _ if options.trace.is_some() || options.costs.is_some() => None,
            Backend::Interpreter => None,
            Backend::Jit => Some(Llvm::load().map_err(|error| errors::no_llvm(&error))?),
            Backend::Auto => match Llvm::load() {
                Ok(llvm) => Some(llvm),
                // A user who names a library wants that one, and nothing slower.
                Err(error) if error.chosen_by_user => return Err(errors::no_llvm(&error)),
                Err(error) => {
                    warnings.push(errors::interpreter_instead(&error));
                    None
                }
            },
        };
        let width = options.width.unwrap_or_else(|| match (&llvm, &options.costs) {
            (Some(llvm), _) => natural_width(llvm),
            (None, Some(_)) => COUNTED_WIDTH,
            (None, None) => 1,
        });
        if !KernelSource::WIDTHS.contains(&width) {
            return Err(errors::unknown_width(width));
        }
        if let Some(factor) = options.interleave.filter(|it| !interleave::FACTORS.contains(it)) {
            return Err(errors::unknown_interleave(factor));
        }
        Ok((KernelCompiler { options, width, llvm }, warnings))
    }

    /// The options.
    pub fn options(&self) -> &EngineOptions {
        &self.options
    }

    /// Rays at a time in kernels of variants without a width.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// LLVM; `None` if the interpreter runs kernels.
    pub fn llvm(&self) -> Option<&Llvm> {
        self.llvm.as_deref()
    }

    /// Links a method of the tree's root with the methods that it calls through references, and optimises the whole.
    ///
    /// # Errors
    /// If the class has no such method, or linking passes a limit.
    pub fn link(
        &self,
        tree: &ClassTree,
        method: Method,
        light: Light,
    ) -> Result<LinkedMethod, Diagnostic> {
        let class = &tree.class;
        let nesting = class.methods.get(&method).map_or(0, Function::nesting);
        let link = || self.link_on_this_stack(tree, method, light);
        // Methods that it calls through references become regions of the function.
        if class.references.is_empty() {
            nesting::with_stack_for(nesting, link)
        } else {
            nesting::with_deep_stack(link)
        }
    }

    fn link_on_this_stack(
        &self,
        tree: &ClassTree,
        method: Method,
        light: Light,
    ) -> Result<LinkedMethod, Diagnostic> {
        let linked = rtsl_link::link_method(tree, method);
        let mut linked = linked.ok_or_else(|| errors::missing_method(&tree.class, method))??;
        let set: Vec<VariableScalar> = unchanged::outputs(&linked.function).collect();
        self.optimise(&mut linked.function, light);
        let left: Vec<VariableScalar> = unchanged::outputs(&linked.function).collect();
        linked.unchanged = set.into_iter().filter(|it| !left.contains(it)).collect();
        Ok(LinkedMethod::new(linked))
    }

    /// Optimises a stage of an integrator that is linked with methods: for a variant's objects, and without contraction,
    /// approximation and budget, which its parts have had.
    pub fn optimise_stage(
        &self,
        mut function: Function,
        variant: &Variant,
        layout: &Layout,
    ) -> Function {
        let passes = rtsl_opt::Options {
            contract: false,
            approximate: false,
            budget: None,
            ..self.passes()
        };
        rtsl_opt::optimize(&mut function, &passes);
        let known = known_scalars(&function, variant, layout);
        let caller = rtsl_opt::Caller { known, ..rtsl_opt::Caller::default() };
        rtsl_opt::specialise(&mut function, &caller, self.options.optimization != OptLevel::O0);
        function
    }

    /// Links the constructor of the tree's root and optimises it, without contraction: instances are made without it,
    /// and elements have the same bits.
    ///
    /// # Errors
    /// If linking passes a limit.
    pub fn link_constructor(
        tree: &ClassTree,
        constructor: &Function,
    ) -> Result<Function, Diagnostic> {
        let mut function = rtsl_link::link_function(tree, constructor)?.function;
        let passes = rtsl_opt::Options { contract: false, ..rtsl_opt::Options::default() };
        rtsl_opt::optimize(&mut function, &passes);
        Ok(function)
    }

    /// Runs the passes on a linked method. A traced one keeps its operations as they are written, except for those that
    /// determine its results.
    fn optimise(&self, function: &mut Function, light: Light) {
        let passes = rtsl_opt::Options { defer: light == Light::Deferred, ..self.passes() };
        if self.options.trace.is_none() {
            function.remove_reports();
            return rtsl_opt::optimize(function, &passes);
        }
        let passes = rtsl_opt::Options { budget: None, optimize: false, ..passes };
        rtsl_opt::optimize(function, &passes);
        if let Some(budget) = self.options.loop_budget {
            rtsl_opt::budget::run(function, budget);
        }
    }

    fn passes(&self) -> rtsl_opt::Options {
        rtsl_opt::Options {
            contract: self.options.math != Math::Strict,
            approximate: self.options.math == Math::Fast,
            budget: self.options.loop_budget,
            optimize: self.options.optimization != OptLevel::O0,
            select: true,
            defer: false,
        }
    }

    /// Simplifies a linked method for the callers of a variant. `layout` is that of the program.
    pub fn specialise(
        &self,
        function: &Arc<Function>,
        variant: &Variant,
        layout: &Layout,
    ) -> Arc<Function> {
        let Variant { mode: _, outputs, known, unit_directions, objects: _, placed, width: _ } =
            variant;
        if *outputs == Outputs::ALL && known.is_empty() && !unit_directions && !placed {
            return function.clone();
        }
        let directions = unit_directions.then(|| ray_direction(function)).flatten();
        let caller = rtsl_opt::Caller {
            known: known_scalars(function, variant, layout),
            read: Some(function.outputs.iter().map(|it| is_read(function, *outputs, it)).collect()),
            unit: directions.into_iter().collect(),
            placed: placed.then_some(rtsl_opt::Contract(self.options.math != Math::Strict)),
        };
        let mut function = Function::clone(function);
        let optimises = self.options.optimization != OptLevel::O0 && self.options.trace.is_none();
        rtsl_opt::specialise(&mut function, &caller, optimises);
        Arc::new(function)
    }

    /// Lowers a function to packet code. The caller's stack must bear the nesting of the function.
    ///
    /// # Errors
    /// If there are no kernels of the width, or the packet code passes a limit.
    pub fn packet(&self, source: KernelSource<'_>) -> Result<rtsl_packet::Kernel, Diagnostic> {
        source.check_width()?;
        let KernelSource { function, mode, width, layout } = source;
        let packet = rtsl_packet::lower(function, layout, mode, width);
        let mut packet = packet.map_err(|error| errors::lowering(&function.name, &error))?;
        packet.interleave = interleave::choose(&packet, self.options.interleave);
        Ok(packet)
    }

    /// Makes kernels, all in one module, which costs less than one each.
    ///
    /// # Errors
    /// If one of them can't be made. The error names the first one, so that a caller with several makes them one by
    /// one.
    pub fn kernels(&self, sources: &[KernelSource<'_>]) -> Result<Vec<Kernel>, Diagnostic> {
        let nesting = sources.iter().map(|source| source.function.nesting()).max().unwrap_or(0);
        nesting::with_stack_for(nesting, || match (&self.llvm, &self.options.costs) {
            (Some(llvm), _) => self.compiled(sources, llvm),
            (None, Some(costs)) if self.options.trace.is_none() => {
                let counted = |source: &KernelSource<'_>| {
                    let packets = self.packet_kernel(*source)?;
                    Ok(Kernel::counted(CountedKernel::new(packets, costs)))
                };
                sources.iter().map(counted).collect()
            }
            (None, _) => sources.iter().map(|source| self.interpreted(*source)).collect(),
        })
    }

    /// True if kernels can be made with less effort than [`kernels`](Self::kernels), of slower code.
    pub fn has_cheaper_code(&self) -> bool {
        self.llvm.is_some() && self.options.optimization > OptLevel::O0
    }

    /// Makes a kernel soon: the one of [`kernels`](Self::kernels) if it was compiled before, and otherwise one of the
    /// same bits without optimisation by LLVM, where that is cheaper and its code needs no larger stack frame than there
    /// may be. On a Zen 4, the stages of `Path` in `scenes/three-spheres.pbrt` take two fifths of the time to compile,
    /// and a picture with 16 samples takes a twentieth longer to render.
    ///
    /// Each is a module, so that a cache finds it whatever else a scene has. That takes as long as modules of several
    /// (Zen 5: 1.07 of their time in `scenes/primitives.pbrt`, 0.94 in a bathroom with eleven classes of surfaces).
    ///
    /// # Errors
    /// As for [`kernels`](Self::kernels).
    pub fn first_kernel(&self, source: KernelSource<'_>) -> Result<FirstKernel, Diagnostic> {
        let cheap = self.llvm.as_ref().filter(|_| self.has_cheaper_code()).and_then(|llvm| {
            nesting::with_stack_for(source.function.nesting(), || {
                let packet = self.packet(source).ok()?;
                let (features, level) = (target_features(llvm.host()), self.options.optimization);
                CompiledKernel::compile_soon(llvm, &packet, &features, level).ok()
            })
        });
        let Some((kernel, level)) = cheap else {
            let kernel = self.kernels(&[source])?.pop().expect("each source has a kernel");
            return Ok(FirstKernel { kernel, is_optimised: true });
        };
        Ok(FirstKernel { kernel: Kernel::compiled(kernel), is_optimised: level > OptLevel::O0 })
    }

    fn compiled(
        &self,
        sources: &[KernelSource<'_>],
        llvm: &Arc<Llvm>,
    ) -> Result<Vec<Kernel>, Diagnostic> {
        let packets = sources.iter().map(|source| self.packet(*source));
        let packets = packets.collect::<Result<Vec<_>, _>>()?;
        let features = target_features(llvm.host());
        let kernels = CompiledKernel::compile(llvm, &packets, &features, self.options.optimization);
        if let (&[source], Err(JitError::Frame { bytes, .. })) = (sources, &kernels)
            && let Some(width) = source.narrower_width(*bytes)
        {
            return self.compiled(&[KernelSource { width, ..source }], llvm);
        }
        let first = sources.first();
        let (name, width) = first.map_or(("", 1), |it| (it.function.name.as_str(), it.width));
        let kernels = kernels.map_err(|error| errors::machine_code(name, width, &error))?;
        Ok(kernels.into_iter().map(Kernel::compiled).collect())
    }

    /// Makes a kernel that runs on the interpreter.
    ///
    /// # Errors
    /// If there are no kernels of the width, or the interpreter can't run the function.
    pub fn interpreted(&self, source: KernelSource<'_>) -> Result<Kernel, Diagnostic> {
        let trace = self.options.trace.clone();
        let traced = trace.map(|trace| Traced::method(source.function, trace));
        KernelCompiler::interpreted_for(source, traced)
    }

    /// Makes a kernel that neither a trace nor the costs of lines know: one of the renderer's own texts.
    ///
    /// # Errors
    /// As for [`kernels`](Self::kernels).
    pub fn unrecorded(&self, source: KernelSource<'_>) -> Result<Kernel, Diagnostic> {
        match self.llvm {
            Some(_) => Ok(self.kernels(&[source])?.pop().expect("each source has a kernel")),
            None => KernelCompiler::interpreted_for(source, None),
        }
    }

    /// Makes a kernel that has methods in it, whose calls it reports to a trace.
    ///
    /// # Errors
    /// As for [`kernels`](Self::kernels).
    pub fn linked_kernel(&self, source: KernelSource<'_>) -> Result<Kernel, Diagnostic> {
        match &self.options.trace {
            Some(trace) => {
                let traced = Traced::linked(source.function, trace.clone());
                KernelCompiler::interpreted_for(source, Some(traced))
            }
            None => Ok(self.kernels(&[source])?.pop().expect("each source has a kernel")),
        }
    }

    fn interpreted_for(
        source: KernelSource<'_>,
        traced: Option<Traced>,
    ) -> Result<Kernel, Diagnostic> {
        source.check_width()?;
        let KernelSource { function, layout, .. } = source;
        let kernel = nesting::with_stack_for(function.nesting(), || {
            let mut signature = source.signature();
            if traced.is_some() {
                signature.state = recorded_state_components(function);
            }
            InterpretedKernel::new(function, layout, signature, traced)
        });
        let failed = |error| errors::code_generation(&function.name, &error);
        kernel.map(Kernel::interpreted).map_err(failed)
    }

    /// Makes a kernel that runs on the interpreter of packet code, which counts the work.
    ///
    /// # Errors
    /// As for [`packet`](KernelCompiler::packet).
    pub fn packet_kernel(&self, source: KernelSource<'_>) -> Result<PacketKernel, Diagnostic> {
        let nesting = source.function.nesting();
        let packet = nesting::with_stack_for(nesting, || self.packet(source))?;
        Ok(PacketKernel::new(packet, source.layout, source.signature()))
    }

    /// Makes a function for a host's own packets: `intersect`, and the methods that follow a hit.
    ///
    /// # Errors
    /// Without LLVM; if the class's methods do not set an output, or if linking or code generation fails.
    pub fn callback(
        &self,
        tree: &ClassTree,
        callback: &Callback,
        layout: &Layout,
    ) -> Result<CompiledCallback, Diagnostic> {
        let llvm = self.llvm.as_ref().ok_or_else(|| errors::no_machine_code(&tree.class))?;
        nesting::with_deep_stack(|| {
            let packet = self.callback_packet(tree, callback, layout)?;
            let (record, block_bytes) = (&callback.record, layout.block_words * 4);
            let (features, level) = (target_features(llvm.host()), self.options.optimization);
            let compiled =
                CompiledCallback::compile(llvm, &packet, record, block_bytes, &features, level);
            compiled.map_err(|error| errors::machine_code(&packet.name, packet.width, &error))
        })
    }

    fn callback_packet(
        &self,
        tree: &ClassTree,
        callback: &Callback,
        layout: &Layout,
    ) -> Result<rtsl_packet::Kernel, Diagnostic> {
        let linked = link_hit(tree, &callback.record, callback.outputs);
        let missing = || errors::missing_method(&tree.class, Method::Intersect);
        let mut linked = linked.ok_or_else(missing)??;
        let passes = rtsl_opt::Options { select: callback.width > 1, ..self.passes() };
        rtsl_opt::optimize(&mut linked.function, &passes);
        let (function, width) = (&linked.function, callback.width);
        KernelSource { function, mode: CallMode::Packet, width, layout }.check_width()?;
        let packet = rtsl_packet::lower_packet(function, layout, width);
        packet.map_err(|error| errors::lowering(&function.name, &error))
    }
}

/// Returns the text of packet code that LLVM compiles.
pub(crate) fn llvm_text(packet: &rtsl_packet::Kernel, target: &Target) -> String {
    rtsl_jit::module_text(std::slice::from_ref(packet), &target_features(target))
}

/// Returns the features of a target that decide between LLVM's instructions.
pub(crate) fn target_features(target: &Target) -> TargetFeatures {
    TargetFeatures::new(target.triple(), target.cpu(), target.features())
}

/// Finds the variable of the ray's direction.
pub(crate) fn ray_direction(function: &Function) -> Option<VariableId> {
    function.find_variable(VariableKind::State, "rt_RayDirection")
}

/// True if callers that read `outputs` read this one.
fn is_read(function: &Function, outputs: Outputs, output: &Output) -> bool {
    let variable = function.variable(output.variable);
    match variable.kind {
        VariableKind::State => lookup_state(&variable.name).is_none_or(|it| outputs.has_state(it)),
        VariableKind::Scratch => outputs.has_scratch(),
        VariableKind::Accepted
        | VariableKind::Member
        | VariableKind::Parameter
        | VariableKind::Buffer
        | VariableKind::Local => true,
    }
}

/// The known members of a variant as scalars of the function's variables.
fn known_scalars(
    function: &Function,
    variant: &Variant,
    layout: &Layout,
) -> BTreeMap<(VariableId, u32), Constant> {
    let members = (0..).map(VariableId).zip(&function.variables);
    let members = members.filter(|(_, variable)| variable.kind == VariableKind::Member);
    let known = members.flat_map(|(id, variable)| {
        let first = layout.members[&variable.name];
        (0..variable.len).filter_map(move |index| {
            let bits = variant.known.get(first + index)?;
            Some(((id, index), Constant::from_bits(variable.scalar, bits)))
        })
    });
    known.collect()
}

/// The width of the host's vectors.
fn natural_width(llvm: &Llvm) -> u32 {
    let has = |feature: &str| llvm.host().features().split(',').any(|it| it == feature);
    if has("+avx512f") && has("+avx512vl") {
        16
    } else if has("+avx2") {
        8
    } else {
        4
    }
}
