//! Kernels of the stages of integrators.

use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};

use rtsl_abi::Layout;
use rtsl_integrate::camera::FOOTPRINTS;
use rtsl_integrate::contribution::place_of_contribution;
use rtsl_integrate::next_stages::NextStages;
use rtsl_integrate::prepared_surface::{self, Operand, property_column};
use rtsl_integrate::search::{GROUP_COLUMN, SEARCHES_COLUMN, SURFACE_COLUMN, Search};
use rtsl_integrate::sequences::Purpose;
use rtsl_integrate::shade_call::is_shaded_column;
use rtsl_integrate::spawning::place_of_spawn;
use rtsl_integrate::stage::asks_host;
use rtsl_integrate::unread_slots;
use rtsl_ir::{Function, OpKind, Query, Variable, VariableKind};
use rtsl_opt::{dce, dead_outputs};
use rtsl_source::Diagnostic;
use rtsl_spec::lookup_state;
use rtsl_stages::{Port, ResumedBy};

use super::background::{Answer, wait};
use super::engine::Engine;
use super::tiered_kernel::TieredKernel;
use crate::codegen::kernel_compiler::FirstKernel;
use crate::codegen::kernel_source::KernelSource;
use crate::codegen::variant::Variant;
use crate::nesting;
use crate::program::camera_program::CameraProgram;
use crate::program::staged_program::{PATH_COLUMNS, StageRequest, StagedProgram, may_draw};
use crate::threads::each_on_threads;

/// A kernel of a stage, with the data that it reads and sets.
#[derive(Debug)]
pub struct StageKernel {
    /// The kernel.
    pub kernel: Arc<TieredKernel>,
    /// The number of its operations, of which each path in a vector costs a part.
    pub operations: usize,
    /// The scratch arrays of the stage that it reads.
    pub reads: Vec<usize>,
    /// The scratch arrays of ports that it stores.
    pub ports: Vec<usize>,
    /// True if all its paths end.
    pub ends: bool,
    /// The number of places at which it makes contributions that it stores.
    pub contributions: usize,
    /// The number of places at which it spawns paths that it stores.
    pub spawns: usize,
    /// True if it makes requests of a host that depend on the path's random sequences.
    pub asks_host: bool,
    /// The queries among them, in order.
    pub queries: Vec<Query>,
    /// The scratch arrays of the integrator that it stores for paths that end.
    pub outputs: Vec<usize>,
    /// The components of state that it stores for paths that end.
    pub state: Vec<usize>,
    /// The components of state that it reads.
    pub reads_state: Vec<usize>,
    /// The surface whose properties it reads, if a renderer has to prepare them.
    pub prepared: Option<PreparedSurface>,
}

/// A surface whose properties a renderer stores before it calls a kernel.
#[derive(Debug)]
pub struct PreparedSurface {
    /// The operands of the [query](rtsl_ir::Query::SurfaceProperties) for them.
    pub operands: Vec<PreparedOperand>,
    /// The results that the kernel reads, by their indices, and their scratch arrays.
    pub properties: Vec<(usize, usize)>,
}

/// An operand of a query that a renderer answers before it calls a kernel.
#[derive(Clone, Copy, Debug)]
pub enum PreparedOperand {
    /// That of each path in a scratch array.
    Array(usize),
    /// The same bits for all paths.
    Constant(u32),
}

/// The kernels of stages, and what is left to be optimised.
#[derive(Debug)]
pub struct StageKernels {
    /// The kernels, in the order of their requests, then those that search, then that of the camera.
    pub kernels: Vec<StageKernel>,
    /// The kinds of searches, with the indices of their kernels.
    searches: Vec<(Search, usize)>,
    /// The index of the camera's kernel.
    camera: Option<usize>,
    /// The functions of the kernels, in their order.
    linked: Vec<Arc<Linked>>,
    /// The linked stages as requested, before they lost what no other kernel reads; none unless kernels may serve again.
    requested: Vec<Linked>,
    /// The work of the background, once it has begun.
    begun: OnceLock<Vec<Answer<()>>>,
}

/// Kernels of an earlier state of a scene, with what they were made for.
#[derive(Clone, Copy)]
pub struct EarlierKernels<'a> {
    /// The program.
    pub program: &'a StagedProgram,
    /// The requests.
    pub requests: &'a [StageRequest],
    /// The kernels.
    pub kernels: &'a StageKernels,
}

/// A linked stage on its way to code.
#[derive(Clone, Debug)]
struct Linked {
    function: Function,
    layout: Layout,
    variant: Variant,
    prepared: Option<prepared_surface::PreparedSurface>,
}

/// The results of an integrator that a host reads beside its radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadResults<'a> {
    /// The names of outputs.
    pub outputs: &'a [&'a str],
    /// True if the hits of first searches are read.
    pub first_hits: bool,
}

impl Engine {
    /// Makes kernels of stages on all processors; the results are in the order of the requests, which are those for all
    /// stages and all surfaces of a scene: kernels leave out what nobody reads, of which `read` is what the host reads. If
    /// the program searches a scene, the kernels for the searches that stages do not make themselves come next; that of
    /// the camera is the last. The code is not [optimised](StageKernels::optimise) yet. Stages that are as they were
    /// earlier, of the same engine, are not linked again, and kernels that compute the same are not compiled again.
    ///
    /// # Errors
    /// If linking passes a limit, or code generation fails.
    pub fn stage_kernels(
        &self,
        program: &StagedProgram,
        requests: &[StageRequest],
        read: ReadResults<'_>,
        earlier: Option<EarlierKernels<'_>>,
    ) -> Result<StageKernels, Diagnostic> {
        let mut linked = self.link_stages(program, requests, earlier)?;
        let requested = if program.values_may_change() { linked.clone() } else { Vec::new() };
        let stages = requests.iter().map(|request| request.stage);
        let functions = linked.iter_mut().map(|linked| &mut linked.function);
        let mut functions: Vec<_> = stages.zip(functions).collect();
        let all = program.program().class().outputs.iter().map(|(name, _)| name.as_str());
        let unread: BTreeSet<&str> = all.filter(|name| !read.outputs.contains(name)).collect();
        let answered = if read.first_hits { BTreeSet::new() } else { program.answered() };
        nesting::with_deep_stack(|| unread_slots::remove(&mut functions, &unread, &answered));
        for linked in &mut linked {
            let prepare = || prepared_surface::prepare(&mut linked.function);
            linked.prepared = nesting::with_deep_stack(prepare);
        }
        let mut searches = Vec::new();
        if let Some(searched) = program.searched() {
            let scratch = read_scratch(&linked, read.first_hits);
            let is_read = |name: &str| scratch.contains(name);
            if program.searches_at_end() {
                linked.iter_mut().for_each(|linked| linked.forget_answers(&is_read));
            }
            let left = searches_left(program, &linked);
            searches = left.iter().copied().zip(linked.len()..).collect();
            let link = || searched.link(&left, program.layout(), &is_read, self.compiler());
            let searching = nesting::with_deep_stack(link)?.into_iter();
            linked.extend(searching.map(|(function, layout, variant)| Linked {
                function,
                layout,
                variant,
                prepared: None,
            }));
        }
        let camera = program.camera().map(|_| linked.len());
        if let Some(camera) = program.camera() {
            let first = requests.iter().zip(&linked).find(|(request, _)| request.stage == 0);
            let has_footprints = first.is_some_and(|(_, linked)| linked.reads_footprints());
            linked.push(self.link_camera(camera, has_footprints)?);
        }
        let linked: Vec<Arc<Linked>> = linked.into_iter().map(Arc::new).collect();
        let kernels = self.compile_stages(&linked, earlier.map(|earlier| earlier.kernels))?;
        let made = kernels.into_iter().zip(&linked);
        let kernels = made.map(|(kernel, linked)| StageKernel::new(kernel, linked)).collect();
        Ok(StageKernels { kernels, searches, camera, linked, requested, begun: OnceLock::new() })
    }

    /// Makes the kernel of a camera, which computes footprints too, without stages.
    ///
    /// # Errors
    /// If linking passes a limit, or code generation fails.
    pub fn camera_kernel(&self, camera: &CameraProgram) -> Result<Arc<TieredKernel>, Diagnostic> {
        let linked = self.link_camera(camera, true)?;
        let kernels = self.compiler().kernels(&[linked.source(self.width())])?;
        let kernel = kernels.into_iter().next().expect("each source has a kernel");
        Ok(Arc::new(TieredKernel::new(FirstKernel { kernel, is_optimised: true })))
    }

    fn link_camera(
        &self,
        camera: &CameraProgram,
        has_footprints: bool,
    ) -> Result<Linked, Diagnostic> {
        let link = || camera.link(has_footprints, self.compiler());
        let (function, layout, variant) = nesting::with_deep_stack(link)?;
        Ok(Linked { function, layout, variant, prepared: None })
    }

    fn link_stages(
        &self,
        program: &StagedProgram,
        requests: &[StageRequest],
        earlier: Option<EarlierKernels<'_>>,
    ) -> Result<Vec<Linked>, Diagnostic> {
        let may_draw = |requests| nesting::with_deep_stack(|| may_draw(requests));
        let draws = may_draw(requests);
        let earlier = earlier.filter(|earlier| {
            earlier.program.is_like(program) && may_draw(earlier.requests) == draws
        });
        let linked = each_on_threads(requests.len(), |index| {
            let request = &requests[index];
            if let Some(linked) = earlier.and_then(|earlier| earlier.stage_like(request)) {
                return Ok(linked.clone());
            }
            let link = || program.link(request, draws, self.compiler());
            let (function, layout, variant) = nesting::with_deep_stack(link)?;
            Ok(Linked { function, layout, variant, prepared: None })
        });
        linked.into_iter().collect()
    }

    /// Returns the kernels of linked stages: earlier ones that compute the same, and new ones.
    fn compile_stages(
        &self,
        linked: &[Arc<Linked>],
        earlier: Option<&StageKernels>,
    ) -> Result<Vec<Arc<TieredKernel>>, Diagnostic> {
        let kept = |linked: &Arc<Linked>| earlier.and_then(|earlier| earlier.kernel_of(linked));
        let mut kernels: Vec<Option<Arc<TieredKernel>>> = linked.iter().map(kept).collect();
        let mut new: Vec<usize> = (0..linked.len()).filter(|it| kernels[*it].is_none()).collect();
        // The largest first, so that none is left over at the end.
        new.sort_by_key(|index| std::cmp::Reverse(linked[*index].function.values.len()));
        let width = self.width();
        let made = each_on_threads(new.len(), |index| {
            self.compiler().first_kernel(linked[new[index]].source(width))
        });
        // Of several errors the first in the order of the kernels counts.
        let mut made: Vec<_> = new.into_iter().zip(made).collect();
        made.sort_unstable_by_key(|(index, _)| *index);
        for (index, first) in made {
            kernels[index] = Some(Arc::new(TieredKernel::new(first?)));
        }
        Ok(kernels.into_iter().flatten().collect())
    }
}

impl StageKernels {
    /// The kernel that finds the nearest hits of requested rays, unless each stage does so at its end.
    pub fn nearest_search(&self) -> Option<&StageKernel> {
        self.search(Search::Nearest)
    }

    /// The kernel that finds out whether rays hit anything, if stages leave that to a host.
    pub fn any_search(&self) -> Option<&StageKernel> {
        self.search(Search::Any)
    }

    fn search(&self, search: Search) -> Option<&StageKernel> {
        let (_, index) = self.searches.iter().find(|(it, _)| *it == search)?;
        self.kernels.get(*index)
    }

    /// The kernel of the camera, if the program has one.
    pub fn camera(&self) -> Option<&StageKernel> {
        self.kernels.get(self.camera?)
    }

    /// Has a background thread of the engine optimise the kernels, at the first call. Calls use each as soon as it is
    /// ready. Dropping this value cancels what has not begun.
    pub fn optimise(&self, engine: &Engine) {
        self.begun.get_or_init(|| {
            let width = engine.width();
            let begin = |(kernel, linked): (&StageKernel, &Arc<Linked>)| {
                let (kernel, linked) = (kernel.kernel.clone(), linked.clone());
                let compiler = engine.compiler().clone();
                engine.background().start(move || {
                    let made = compiler.kernels(&[linked.source(width)])?;
                    made.into_iter().for_each(|made| kernel.set_optimised(made));
                    // The render needs the memory now.
                    Engine::cool_down();
                    Ok(())
                })
            };
            let has_better = engine.compiler().has_cheaper_code();
            let all = self.kernels.iter().zip(&self.linked);
            all.filter(|(it, _)| has_better && !it.kernel.is_optimised()).map(begin).collect()
        });
    }

    /// Waits until the background has optimised all kernels, or failed to.
    pub fn wait(&self) {
        for work in self.begun.get().into_iter().flatten() {
            wait(work);
        }
    }
}

impl StageKernels {
    /// Returns the kernel of a function that is the same as one of these.
    fn kernel_of(&self, linked: &Linked) -> Option<Arc<TieredKernel>> {
        let index = self.linked.iter().position(|it| it.has_code_of(linked))?;
        Some(self.kernels[index].kernel.clone())
    }
}

impl<'a> EarlierKernels<'a> {
    /// Returns the linked stage of a request like this one.
    fn stage_like(self, request: &StageRequest) -> Option<&'a Linked> {
        let mut stages = self.requests.iter().zip(&self.kernels.requested);
        stages.find(|(earlier, _)| request.is_like(earlier)).map(|(_, stage)| stage)
    }
}

impl Linked {
    /// True if the kernels of both have the same code.
    fn has_code_of(&self, other: &Linked) -> bool {
        (&self.function, &self.layout, &self.variant)
            == (&other.function, &other.layout, &other.variant)
    }

    /// True if the function reads the footprints of rays.
    fn reads_footprints(&self) -> bool {
        let mut reads = false;
        self.function.body.for_each_op(&mut |op| {
            if let OpKind::Load(variable, _) = &op.kind {
                let Variable { kind, name, .. } = self.function.variable(*variable);
                reads |= *kind == VariableKind::State && FOOTPRINTS.contains(&name.as_str());
            }
        });
        reads
    }

    /// Removes the answers of searches that no one reads.
    fn forget_answers(&mut self, is_read: &impl Fn(&str) -> bool) {
        let is_needed = |variable: &Variable| {
            let is_count = Purpose::ALL.iter().any(|it| it.column() == variable.name);
            let is_answer = matches!(Port::of(variable), Some(Port::Answer(_)));
            !(is_answer || is_count) || is_read(&variable.name)
        };
        let function = &mut self.function;
        let outputs = function.outputs.iter();
        let read: Vec<bool> = outputs.map(|it| is_needed(function.variable(it.variable))).collect();
        dead_outputs::run(function, &read);
        dce::run(function);
        function.renumber();
    }

    fn source(&self, width: u32) -> KernelSource<'_> {
        let Linked { function, layout, variant, .. } = self;
        KernelSource::new(function, variant, layout, width)
    }
}

/// Returns the searches that linked stages leave to kernels of their own.
fn searches_left(program: &StagedProgram, linked: &[Linked]) -> Vec<Search> {
    if !program.searches_at_end() {
        return vec![Search::Nearest, Search::Any];
    }
    let mut needs_any = program.stages().iter().any(|it| it.resumed_by == ResumedBy::Occluded);
    for Linked { function, .. } in linked {
        function.body.for_each_op(&mut |op| {
            let adds_light = [Query::Contribute, Query::OwnShade];
            needs_any |= matches!(&op.kind, OpKind::Query(query, _) if adds_light.contains(query));
        });
    }
    needs_any.then_some(Search::Any).into_iter().collect()
}

/// Returns the scratch that anyone reads: kernels, those who prepare surfaces, and hosts, which read the objects and
/// the elements that searches have found, the numbers of searches, and all of first hits if these are read.
fn read_scratch(linked: &[Linked], first_hits: bool) -> BTreeSet<String> {
    let answers = if first_hits { &[0, 1, 3, 4][..] } else { &[1, 3] };
    let mut read: BTreeSet<String> =
        answers.iter().map(|index| Port::Answer(*index).name()).collect();
    read.extend([GROUP_COLUMN, SURFACE_COLUMN, SEARCHES_COLUMN].map(str::to_owned));
    for Linked { function, prepared, .. } in linked {
        function.body.for_each_op(&mut |op| {
            let OpKind::Load(variable, _) = &op.kind else { return };
            let variable = function.variable(*variable);
            if variable.kind == VariableKind::Scratch {
                read.insert(variable.name.clone());
            }
        });
        let operands = prepared.iter().flat_map(|surface| &surface.operands);
        read.extend(operands.filter_map(|operand| match operand {
            Operand::Column(name) => Some(name.clone()),
            Operand::Constant(_) => None,
        }));
    }
    read
}

impl StageKernel {
    fn new(kernel: Arc<TieredKernel>, linked: &Linked) -> StageKernel {
        let Linked { function, layout, prepared, .. } = linked;
        let mut made = StageKernel {
            kernel,
            operations: function.values.len(),
            reads: Vec::new(),
            ports: Vec::new(),
            ends: NextStages::of(function).is_among(&BTreeSet::new()),
            contributions: 0,
            spawns: 0,
            asks_host: false,
            queries: Vec::new(),
            outputs: Vec::new(),
            state: Vec::new(),
            reads_state: Vec::new(),
            prepared: prepared.as_ref().map(|surface| PreparedSurface::new(surface, layout)),
        };
        let (mut reads, mut read_state) = (BTreeSet::new(), BTreeSet::new());
        let mut queries = BTreeSet::new();
        function.body.for_each_op(&mut |op| {
            // What is the same for all rays does not depend on their sequences.
            let is_uniform = matches!(op.kind, OpKind::LightCount | OpKind::Ambient);
            made.asks_host |= asks_host(&op.kind) && !is_uniform;
            if let OpKind::Query(query, _) = &op.kind {
                queries.insert(*query);
            }
            let OpKind::Load(variable, _) = &op.kind else { return };
            let variable = function.variable(*variable);
            match variable.kind {
                VariableKind::Scratch if is_of_stages(variable) => {
                    reads.insert(layout.scratch[&variable.name] as usize);
                }
                VariableKind::State => {
                    let first = lookup_state(&variable.name).map_or(0, |it| it.first_component);
                    read_state.extend((first..first + variable.len).map(|it| it as usize));
                }
                _ => {}
            }
        });
        made.queries = queries.into_iter().collect();
        made.reads = reads.into_iter().collect();
        made.reads_state = read_state.into_iter().collect();
        for output in &function.outputs {
            let variable = function.variable(output.variable);
            let component = output.component as usize;
            match variable.kind {
                VariableKind::Scratch => {
                    if let Some(place) = place_of_contribution(variable) {
                        made.contributions = made.contributions.max(place + 1);
                        continue;
                    }
                    if let Some(place) = place_of_spawn(variable) {
                        made.spawns = made.spawns.max(place + 1);
                        continue;
                    }
                    let array = layout.scratch[&variable.name] as usize + component;
                    let is_port = is_of_stages(variable);
                    if is_port { &mut made.ports } else { &mut made.outputs }.push(array);
                }
                VariableKind::State => {
                    let first = lookup_state(&variable.name).map_or(0, |it| it.first_component);
                    made.state.push(first as usize + component);
                }
                _ => {}
            }
        }
        made
    }
}

impl PreparedSurface {
    /// Returns the scratch arrays of the operands.
    pub fn arrays(&self) -> impl Iterator<Item = usize> {
        self.operands.iter().filter_map(|operand| match operand {
            PreparedOperand::Array(array) => Some(*array),
            PreparedOperand::Constant(_) => None,
        })
    }

    fn new(surface: &prepared_surface::PreparedSurface, layout: &Layout) -> PreparedSurface {
        let array = |name: &str| layout.scratch[name] as usize;
        let operand = |operand: &Operand| match operand {
            Operand::Column(name) => PreparedOperand::Array(array(name)),
            Operand::Constant(bits) => PreparedOperand::Constant(*bits),
        };
        let property = |index: &usize| (*index, array(&property_column(*index)));
        PreparedSurface {
            operands: surface.operands.iter().map(operand).collect(),
            properties: surface.properties.iter().map(property).collect(),
        }
    }
}

/// True for scratch that stages have beside that of the integrator.
fn is_of_stages(variable: &Variable) -> bool {
    Port::of(variable).is_some()
        || PATH_COLUMNS.contains(&variable.name.as_str())
        || is_shaded_column(variable)
}
