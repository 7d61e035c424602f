//! A linked class and its kernels.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rtsl_abi::description::KernelDescription;
use rtsl_abi::{CallMode, InstanceBlock, LaneBlock, Layout, ObjectForm, Objects};
use rtsl_ir::class::Class;
use rtsl_ir::{Function, Scalar, Variable};
use rtsl_jit::CompiledCallback;
use rtsl_link::attributes::methods_of;
use rtsl_link::class_tree::{ClassTree, TreeVariables};
use rtsl_link::{Linked, LinkedMethod};
use rtsl_opt::placed::PLACEMENT_SCALARS;
use rtsl_source::Diagnostic;
use rtsl_spec::Method;

use super::elements::ElementMaker;
use super::kernel_cache::KernelCache;
use super::kernel_description::describe_kernel;
use super::query_request::QueryKernels;
use crate::codegen::callback::Callback;
use crate::codegen::emit::EmitRequest;
use crate::codegen::kernel::Kernel;
use crate::codegen::kernel_compiler::{KernelCompiler, Light, ray_direction};
use crate::codegen::kernel_source::KernelSource;
use crate::codegen::options::Math;
use crate::codegen::packet_kernel::PacketKernel;
use crate::codegen::variant::{KnownMembers, Variant};
use crate::instance::instance::Instance;
use crate::{errors, nesting};

/// A class, linked with the classes of the instances that it refers to. A kernel is made when it is first requested.
///
/// ```
/// # let text = "class Ball : rt_Primitive; [[min 0]] public float radius = 1.0;
/// #     void intersect() { hit(-rt_RayOrigin.z - radius); }
/// #     void computeNormal() { rt_GeometricNormal = rt_HitPoint; }";
/// # let unit = rtsl::Compiler::default().compile("ball.rtsl", text).unit.expect("it compiles");
/// # let class = unit.class("Ball")?;
/// # let (engine, _) = rtsl::Engine::new(rtsl::EngineOptions::default())?;
/// # let ball = rtsl::Instance::new(class, [("radius", 2.0.into())])?;
/// use rtsl::{Method, CallMode, Variant, lookup_state};
///
/// let program = engine.program(&ball);
/// // Instances of one class share a program as long as a handle to it lives, so a changed parameter compiles nothing.
/// let other = rtsl::Instance::new(class, [("radius", 3.0.into())])?;
/// assert!(std::sync::Arc::ptr_eq(&program, &engine.program(&other)));
/// // The state that a method reads and sets, for hosts that compute no more than that.
/// let intersect = program.method(Method::Intersect)?;
/// assert!(intersect.writes.iter().any(|it| it.name == "rt_HitDistance"));
/// // Kernels by call mode and width.
/// let kernel = program.kernel(Method::Intersect, Variant::new(CallMode::Packet).with_width(16))?;
/// let origin = lookup_state("rt_RayOrigin").expect("the table has it").first_component;
/// assert!(kernel.state_components().contains(origin + 2));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Program {
    compiler: Arc<KernelCompiler>,
    tree: ClassTree,
    variables: TreeVariables,
    layout: Layout,
    methods: MethodTable,
    /// The methods that defer light: see [`Program::deferring_method`].
    deferring: MethodTable,
    kernels: KernelCache,
    queries: QueryKernels,
    callbacks: Mutex<BTreeMap<Callback, CompiledCallback>>,
    elements: OnceLock<Result<Box<ElementMaker>, Diagnostic>>,
}

/// Linked methods, each from its first use on.
type MethodTable = BTreeMap<Method, OnceLock<Result<Arc<LinkedMethod>, Diagnostic>>>;

/// An affine map from the space of rays into object space: the images of the three axes, then that of the origin.
pub type Placement = [f32; PLACEMENT_SCALARS as usize];

impl Program {
    pub(crate) fn new(compiler: Arc<KernelCompiler>, tree: ClassTree) -> Program {
        let variables = tree.variables();
        let layout = variables.layout();
        let methods: MethodTable =
            methods_of(&tree).into_iter().map(|it| (it, OnceLock::new())).collect();
        let deferring = [Method::Radiance, Method::Shade].into_iter();
        let deferring = deferring.filter(|it| methods.contains_key(it));
        let deferring = deferring.map(|it| (it, OnceLock::new())).collect();
        let (kernels, elements) = (KernelCache::default(), OnceLock::new());
        let queries = QueryKernels::default();
        let callbacks = Mutex::default();
        Program {
            compiler,
            tree,
            variables,
            layout,
            methods,
            deferring,
            kernels,
            queries,
            callbacks,
            elements,
        }
    }

    /// The class.
    pub fn class(&self) -> &Arc<Class> {
        &self.tree.class
    }

    /// Rays at a time in kernels of variants without a width.
    pub fn width(&self) -> u32 {
        self.compiler.width()
    }

    /// True if the class has the method, written or implied by others.
    pub fn has(&self, method: Method) -> bool {
        self.methods.contains_key(&method)
    }

    /// The layout of instances and scratch.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The scratch variables of the class, leaf by leaf. A leaf's arrays start at [`Layout::scratch`].
    pub fn scratch(&self) -> &[Variable] {
        &self.variables.scratch
    }

    /// Creates scratch for `lanes` rays, all zero.
    pub fn new_scratch(&self, lanes: usize) -> LaneBlock {
        LaneBlock::new(self.layout.scratch_arrays as usize, lanes)
    }

    /// Returns the data of an instance, as this program's kernels read it.
    ///
    /// # Panics
    /// If the instance belongs to another program.
    pub fn block(&self, instance: &Instance) -> InstanceBlock {
        assert!(self.serves(instance), "an instance of this program");
        instance.block(&self.layout)
    }

    /// Returns the data of instances by index, as this program's kernels for many objects read it. The objects share
    /// nothing.
    ///
    /// # Panics
    /// If one belongs to another program.
    pub fn objects<'a>(&self, instances: impl IntoIterator<Item = &'a Instance>) -> Objects {
        let blocks = instances.into_iter().map(|instance| self.block(instance));
        Objects::of_instances(self.separate_objects(false), blocks)
    }

    /// Like [`Program::objects`], but words that all instances have in common are stored once: the objects'
    /// [form](Objects::form) has the members in which the instances differ.
    ///
    /// # Panics
    /// If one belongs to another program.
    pub fn differing_objects<'a>(
        &self,
        instances: impl IntoIterator<Item = &'a Instance>,
    ) -> Objects {
        let blocks: Vec<InstanceBlock> =
            instances.into_iter().map(|instance| self.block(instance)).collect();
        let differs = |word: &u32| {
            let word = *word as usize;
            blocks.windows(2).any(|pair| pair[0].words()[word] != pair[1].words()[word])
        };
        let places = self.layout.variables();
        let differing = places.filter(|place| place.clone().any(|word| differs(&word)));
        Objects::of_instances(ObjectForm::new(differing.flatten()), blocks)
    }

    /// Like [`Program::objects`] with placements, for kernels that are [placed](Variant::placed).
    ///
    /// # Panics
    /// If one belongs to another program.
    pub fn placed_objects<'a>(
        &self,
        instances: impl IntoIterator<Item = (&'a Instance, &'a Placement)>,
    ) -> Objects {
        let blocks = instances.into_iter().map(|(it, placement)| self.placed_block(it, placement));
        Objects::of_instances(self.separate_objects(true), blocks)
    }

    /// Returns the data of an instance with its placement, for kernels that are [placed](Variant::placed).
    ///
    /// # Panics
    /// If the instance belongs to another program.
    pub fn placed_block(&self, instance: &Instance, placement: &Placement) -> InstanceBlock {
        let block = self.block(instance);
        let words: Vec<u32> =
            block.words().iter().copied().chain(placement.map(f32::to_bits)).collect();
        InstanceBlock::new(&words, block.buffers().to_vec())
    }

    /// Makes the [`Instance::element_count`] elements of an instance of a class with an
    /// [element parameter](Class::element), by one kernel. They share buffers and all members that do not depend on the
    /// element. Each has the same bits as an instance with the element's number.
    ///
    /// # Errors
    /// If the class has no element parameter, its constructor has no code, or runs past its
    /// budget.
    ///
    /// # Panics
    /// If the instance belongs to another program.
    pub fn elements(&self, instance: &Instance) -> Result<Objects, Diagnostic> {
        let count = self.element_count(instance)?;
        self.make_elements(instance, self.block(instance), count, |index| index as u32)
    }

    /// Like [`Program::elements`] with one placement for all of them, for kernels that are [placed](Variant::placed).
    ///
    /// # Errors
    /// As for [`Program::elements`].
    ///
    /// # Panics
    /// If the instance belongs to another program.
    pub fn placed_elements(
        &self,
        instance: &Instance,
        placement: &Placement,
    ) -> Result<Objects, Diagnostic> {
        let (count, block) =
            (self.element_count(instance)?, self.placed_block(instance, placement));
        self.make_elements(instance, block, count, |index| index as u32)
    }

    /// Makes elements in the order of a host, such as that of a hierarchy's leaves: object `i` is the element
    /// `numbers[i]`, and numbers may repeat. This takes as long as [`Program::elements`], whereas [`Objects::in_order`]
    /// would be another pass over all objects. With a placement they are for kernels that are
    /// [placed](Variant::placed).
    ///
    /// # Errors
    /// As for [`Program::elements`].
    ///
    /// # Panics
    /// If the instance belongs to another program, or has no element of such a number.
    pub fn elements_in_order(
        &self,
        instance: &Instance,
        placement: Option<&Placement>,
        numbers: &[u32],
    ) -> Result<Objects, Diagnostic> {
        let count = self.element_count(instance)?;
        let are_elements = numbers.iter().all(|number| (*number as usize) < count);
        assert!(are_elements, "each number is that of one of {count} elements");
        let block = match placement {
            Some(placement) => self.placed_block(instance, placement),
            None => self.block(instance),
        };
        self.make_elements(instance, block, numbers.len(), |index| numbers[index])
    }

    /// True if a method reads nothing but data that each element has of its own: one kernel and one table then serve the
    /// elements of several instances.
    pub fn reads_elements_alone(&self, method: Method) -> bool {
        let (Ok(maker), Ok(method)) = (self.element_maker(), self.method(method)) else {
            return false;
        };
        maker.has_all_of(&method.function, &self.layout)
    }

    fn element_maker(&self) -> Result<&ElementMaker, Diagnostic> {
        let make = || ElementMaker::new(&self.tree, &self.layout).map(Box::new);
        let maker = self.elements.get_or_init(|| nesting::with_deep_stack(make));
        maker.as_deref().map_err(Clone::clone)
    }

    fn element_count(&self, instance: &Instance) -> Result<usize, Diagnostic> {
        let count = instance.element_count().ok_or_else(|| errors::no_elements(self.class()))?;
        Ok(count as usize)
    }

    fn make_elements(
        &self,
        instance: &Instance,
        block: InstanceBlock,
        count: usize,
        number: impl Fn(usize) -> u32,
    ) -> Result<Objects, Diagnostic> {
        self.element_maker()?.make(instance, block, count, number, &self.compiler)
    }

    /// Returns the form of objects that share nothing, with placements or without.
    pub fn separate_objects(&self, placed: bool) -> ObjectForm {
        let words = self.layout.block_words;
        ObjectForm::new(0..if placed { words + PLACEMENT_SCALARS } else { words })
    }

    /// True if an instance belongs to this program: it is of the class and refers to instances of the same classes.
    pub fn serves(&self, instance: &Instance) -> bool {
        instance.tree().key() == self.tree.key()
    }

    /// Describes a kernel for hosts without a compiler; its symbol is empty.
    ///
    /// # Errors
    /// As for [`Program::method`].
    pub fn describe_kernel(
        &self,
        method: Method,
        variant: &Variant,
    ) -> Result<KernelDescription, Diagnostic> {
        let linked = self.method(method)?;
        Ok(nesting::with_stack_for(linked.nesting, || {
            let variant = self.canonical(&linked, variant.clone());
            let width = variant.width_in(self.width());
            describe_kernel(method, &linked, &variant, width, String::new())
        }))
    }

    /// Returns a linked method.
    ///
    /// # Errors
    /// If the class has no such method, or linking passes a limit.
    pub fn method(&self, method: Method) -> Result<Arc<LinkedMethod>, Diagnostic> {
        let Some(cell) = self.methods.get(&method) else {
            return Err(errors::missing_method(self.class(), method));
        };
        cell.get_or_init(|| self.compiler.link(&self.tree, method, Light::Awaited).map(Arc::new))
            .clone()
    }

    /// Returns `radiance` or `shade` for a renderer that follows traced rays, and finds out what blocks light, once the
    /// method has ended. Where the colour is not affine in such light, the method waits for it as it is written.
    ///
    /// # Errors
    /// As for [`Program::method`].
    pub fn deferring_method(&self, method: Method) -> Result<Arc<LinkedMethod>, Diagnostic> {
        let Some(cell) = self.deferring.get(&method) else {
            return Err(errors::missing_method(self.class(), method));
        };
        cell.get_or_init(|| self.compiler.link(&self.tree, method, Light::Deferred).map(Arc::new))
            .clone()
    }

    /// Refuses a method that asks the scene, for `hosts` that can't answer.
    ///
    /// # Errors
    /// If the method asks, linking fails, or the class has no such method.
    pub fn refuse_questions(&self, method: Method, hosts: &str) -> Result<(), Diagnostic> {
        let linked = self.method(method)?;
        if linked.asks_scene() {
            return Err(errors::asks_scene(&linked.function.name, hosts));
        }
        Ok(())
    }

    /// Returns a method for objects with a placement, if they have one: see [`Variant::placed`].
    pub(crate) fn placed_method(
        &self,
        method: Method,
        is_placed: bool,
    ) -> Result<Arc<LinkedMethod>, Diagnostic> {
        let linked = self.method(method)?;
        if !is_placed {
            return Ok(linked);
        }
        let variant = Variant::new(CallMode::Packet).placed();
        let function = self.specialise(&linked, &variant);
        let function = Function::clone(&function);
        let (warnings, unchanged) = (linked.warnings.clone(), Vec::new());
        let mut placed = LinkedMethod::new(Linked { function, unchanged, warnings });
        placed.hit_placement = linked.hit_placement;
        Ok(Arc::new(placed))
    }

    /// Returns the members of an instance as known values, for [`Variant::knowing`].
    ///
    /// # Panics
    /// If the instance belongs to another program.
    pub fn known_members(&self, instance: &Instance) -> KnownMembers {
        let block = self.block(instance);
        let words = self.variables.members.iter().flat_map(|place| {
            let first = self.layout.members[&place.name];
            (first..first + place.len).map(|word| (word, block.words()[word as usize]))
        });
        KnownMembers::new(words.collect())
    }

    /// Returns the integers and booleans that objects share as known values, for [`Variant::knowing`]. Such members
    /// mostly select between parts of a method, of which a kernel then has one; they change more rarely than others.
    ///
    /// # Panics
    /// If the objects are of another program.
    pub fn known_choices(&self, objects: &Objects) -> KnownMembers {
        let shared = objects.shared().words();
        let choices = self.variables.members.iter().filter(|it| it.scalar != Scalar::F32);
        let words = choices.flat_map(|place| {
            let first = self.layout.members[&place.name];
            first..first + place.len
        });
        let known = words.filter(|word| !objects.form().overlaps(*word, 1));
        KnownMembers::new(known.map(|word| (word, shared[word as usize])).collect())
    }

    /// Returns a kernel of a method, made at the first call.
    ///
    /// A kernel with [known](Variant::known) members must be called for instances that have them: for others its
    /// results are unspecified.
    ///
    /// # Errors
    /// As for [`Program::method`], or if code generation fails.
    pub fn kernel(
        &self,
        method: Method,
        variant: impl Into<Variant>,
    ) -> Result<Arc<Kernel>, Diagnostic> {
        let linked = self.method(method)?;
        let variant = self.canonical(&linked, variant.into());
        let cell = self.kernels.cell(method, &variant);
        cell.get_or_init(|| {
            let function = self.specialise(&linked, &variant);
            let layout = variant.layout(&self.layout);
            let source = KernelSource::new(&function, &variant, &layout, self.width());
            let mut kernels = self.compiler.kernels(&[source])?;
            Ok(Arc::new(kernels.remove(0)))
        })
        .clone()
    }

    /// Returns a kernel that runs on the interpreter, whatever the engine makes otherwise.
    ///
    /// # Errors
    /// As for [`Program::method`], or if the interpreter can't run the method.
    pub fn interpreted_kernel(
        &self,
        method: Method,
        variant: impl Into<Variant>,
    ) -> Result<Kernel, Diagnostic> {
        self.interpreted(&*self.method(method)?, variant.into())
    }

    /// Returns such a kernel of a [deferring method](Program::deferring_method).
    ///
    /// # Errors
    /// As for [`Program::interpreted_kernel`].
    pub fn interpreted_deferring_kernel(
        &self,
        method: Method,
        variant: impl Into<Variant>,
    ) -> Result<Kernel, Diagnostic> {
        self.interpreted(&*self.deferring_method(method)?, variant.into())
    }

    fn interpreted(&self, linked: &LinkedMethod, variant: Variant) -> Result<Kernel, Diagnostic> {
        let variant = self.canonical(linked, variant);
        let function = self.specialise(linked, &variant);
        let layout = variant.layout(&self.layout);
        self.compiler.interpreted(KernelSource::new(&function, &variant, &layout, self.width()))
    }

    /// Returns a function for a host's own packets, made at the first call. It serves all instances of the program,
    /// whose blocks are [`Layout::block_words`] long.
    ///
    /// # Errors
    /// If the engine makes no machine code, the class has no `intersect`, its `intersect` requests something of the
    /// host, no method sets an output, the record has no row for it, there are no packets of that width, or linking or
    /// code generation fails.
    pub fn callback(&self, callback: &Callback) -> Result<CompiledCallback, Diagnostic> {
        let mut callbacks = self.callbacks.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(compiled) = callbacks.get(callback) {
            return Ok(compiled.clone());
        }
        let compiled = self.compiler.callback(&self.tree, callback, &self.layout)?;
        callbacks.insert(callback.clone(), compiled.clone());
        Ok(compiled)
    }

    /// Returns the packet code of a kernel, for the interpreter that counts its operations.
    ///
    /// # Errors
    /// As for [`Program::method`], or if there is no packet code.
    pub fn packet_kernel(
        &self,
        method: Method,
        variant: impl Into<Variant>,
    ) -> Result<PacketKernel, Diagnostic> {
        let linked = self.method(method)?;
        let variant = self.canonical(&linked, variant.into());
        let function = self.specialise(&linked, &variant);
        let layout = variant.layout(&self.layout);
        let source = KernelSource::new(&function, &variant, &layout, self.width());
        self.compiler.packet_kernel(source)
    }

    /// Returns a method in one of its forms, as text.
    ///
    /// # Errors
    /// As for [`Program::kernel`]; without LLVM, for the forms that need it.
    pub fn emit(&self, request: &EmitRequest) -> Result<Vec<u8>, Diagnostic> {
        let linked = self.method(request.method)?;
        nesting::with_stack_for(linked.nesting, || {
            let variant = self.canonical(&linked, request.variant.clone());
            let function = self.specialise(&linked, &variant);
            let layout = variant.layout(&self.layout);
            let source = KernelSource::new(&function, &variant, &layout, self.width());
            request.emit(source, &self.compiler)
        })
    }

    /// Returns the function of a variant.
    pub(crate) fn specialise(&self, method: &LinkedMethod, variant: &Variant) -> Arc<Function> {
        nesting::with_stack_for(method.nesting, || {
            let method = method.in_mode(variant.mode);
            self.compiler.specialise(&method.function, variant, &self.layout)
        })
    }

    /// Returns the variant without properties that make no difference to the method, so that equal kernels are made
    /// once.
    pub(crate) fn canonical(&self, method: &LinkedMethod, variant: Variant) -> Variant {
        nesting::with_stack_for(method.nesting, || self.canonical_of_shallow(method, variant))
    }

    fn canonical_of_shallow(&self, method: &LinkedMethod, variant: Variant) -> Variant {
        let method = method.in_mode(variant.mode);
        let outputs = variant.stored().of_method(&method);
        let known = variant.known.of_function(&method.function, &self.layout);
        let unit_directions = variant.unit_directions
            && self.compiler.options().math == Math::Fast
            && ray_direction(&method.function).is_some();
        let Variant { mode, placed, .. } = variant;
        let width = Some(variant.width_in(self.width()));
        let form = || mode.has_many_objects().then(|| self.separate_objects(placed));
        let objects = variant.objects.clone().or_else(form);
        Variant { mode, outputs, known, unit_directions, objects, placed, width }
    }

    /// Returns the kernel of a variant, or its error, if the cache has it.
    pub(crate) fn made(
        &self,
        method: Method,
        variant: &Variant,
    ) -> Option<Result<Arc<Kernel>, Diagnostic>> {
        let linked = self.methods.get(&method)?.get()?.as_ref().ok()?;
        let variant = self.canonical(linked, variant.clone());
        self.kernels.cell(method, &variant).get().cloned()
    }

    /// Keeps a kernel of a canonical variant, unless another thread was faster; both give the same results.
    pub(crate) fn keep(&self, method: Method, variant: &Variant, kernel: Kernel) {
        let _ = self.kernels.cell(method, variant).set(Ok(Arc::new(kernel)));
    }

    /// Returns the packet code of a canonical variant.
    pub(crate) fn packet(
        &self,
        method: &LinkedMethod,
        variant: &Variant,
    ) -> Result<rtsl_packet::Kernel, Diagnostic> {
        let function = self.specialise(method, variant);
        let layout = variant.layout(&self.layout);
        let source = KernelSource::new(&function, variant, &layout, self.width());
        nesting::with_stack_for(method.nesting, || self.compiler.packet(source))
    }

    pub(crate) fn tree(&self) -> &ClassTree {
        &self.tree
    }

    pub(super) fn queries(&self) -> &QueryKernels {
        &self.queries
    }

    pub(super) fn compiler(&self) -> &KernelCompiler {
        &self.compiler
    }
}
