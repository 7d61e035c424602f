//! A class linked with those it refers to, and its kernels.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rtsl_abi::description::KernelDescription;
use rtsl_abi::{InstanceBlock, LaneBlock, Layout, ObjectForm, Objects};
use rtsl_ir::class::Class;
use rtsl_ir::{Function, Variable};
use rtsl_jit::CompiledCallback;
use rtsl_opt::placed::PLACEMENT_SCALARS;
use rtsl_source::Diagnostic;
use rtsl_spec::Method;

use super::elements::ElementMaker;
use super::kernel_cache::KernelCache;
use super::kernel_description::describe_kernel;
use crate::codegen::callback::Callback;
use crate::codegen::emit::EmitRequest;
use crate::codegen::kernel::Kernel;
use crate::codegen::kernel_compiler::{KernelCompiler, ray_direction};
use crate::codegen::kernel_source::KernelSource;
use crate::codegen::options::Math;
use crate::codegen::packet_kernel::PacketKernel;
use crate::codegen::variant::{KnownMembers, Variant};
use crate::instance::instance::Instance;
use crate::link::class_tree::{ClassTree, TreeVariables};
use crate::link::linked_method::LinkedMethod;
use crate::{errors, nesting};

/// A class, linked with the classes of the instances that it refers to. Its methods become
/// kernels when they are first asked for.
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
/// // Instances of one class share a program, as long as somebody keeps it; so a changed parameter compiles nothing.
/// let other = rtsl::Instance::new(class, [("radius", 3.0.into())])?;
/// assert!(std::sync::Arc::ptr_eq(&program, &engine.program(&other)));
/// // What a method reads and sets, for hosts that compute no more than that.
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
    methods: BTreeMap<Method, OnceLock<Result<Arc<LinkedMethod>, Diagnostic>>>,
    kernels: KernelCache,
    callbacks: Mutex<BTreeMap<Callback, CompiledCallback>>,
    elements: OnceLock<Result<Box<ElementMaker>, Diagnostic>>,
}

/// An affine map from the space of rays into an object's own: the images of the three axes, then that
/// of the origin.
pub type Placement = [f32; PLACEMENT_SCALARS as usize];

impl Program {
    pub(crate) fn new(compiler: Arc<KernelCompiler>, tree: ClassTree) -> Program {
        let variables = tree.variables();
        let layout = variables.layout();
        let methods = tree.class.methods.keys().map(|method| (*method, OnceLock::new())).collect();
        let (kernels, elements) = (KernelCache::default(), OnceLock::new());
        let callbacks = Mutex::default();
        Program { compiler, tree, variables, layout, methods, kernels, callbacks, elements }
    }

    /// The class.
    pub fn class(&self) -> &Arc<Class> {
        &self.tree.class
    }

    /// Rays at a time.
    pub fn width(&self) -> u32 {
        self.compiler.width()
    }

    /// Whether the class has the method, itself or implied by others.
    pub fn has(&self, method: Method) -> bool {
        self.methods.contains_key(&method)
    }

    /// Where data lies.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The per-ray storage of the class, leaf by leaf; a leaf's arrays start at
    /// [`Layout::scratch`].
    pub fn scratch(&self) -> &[Variable] {
        &self.variables.scratch
    }

    /// Scratch for `lanes` rays, all zero.
    pub fn new_scratch(&self, lanes: usize) -> LaneBlock {
        LaneBlock::new(self.layout.scratch_arrays as usize, lanes)
    }

    /// The data of an instance, as this program's kernels read it.
    ///
    /// # Panics
    /// If the instance belongs to another program.
    pub fn block(&self, instance: &Instance) -> InstanceBlock {
        assert!(self.serves(instance), "an instance of this program");
        instance.block(&self.layout)
    }

    /// The data of instances by number, as this program's kernels for many objects read it. The instances
    /// share nothing.
    ///
    /// # Panics
    /// If one belongs to another program.
    pub fn objects<'a>(&self, instances: impl IntoIterator<Item = &'a Instance>) -> Objects {
        let blocks = instances.into_iter().map(|instance| self.block(instance));
        Objects::of_instances(self.separate_objects(false), blocks)
    }

    /// The same, with once what none of them has for itself: their [form](Objects::form) has the members in which
    /// they differ.
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

    /// The same with placements, for kernels that are [placed](Variant::placed).
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

    /// The data of an instance with its placement, for kernels that are [placed](Variant::placed).
    ///
    /// # Panics
    /// If the instance belongs to another program.
    pub fn placed_block(&self, instance: &Instance, placement: &Placement) -> InstanceBlock {
        let block = self.block(instance);
        let words: Vec<u32> =
            block.words().iter().copied().chain(placement.map(f32::to_bits)).collect();
        InstanceBlock::new(&words, block.buffers().to_vec())
    }

    /// The elements of an instance of a class with an [element parameter](Class::element), as many as
    /// [`Instance::element_count`] says, made by one kernel. They share buffers, and all members that
    /// do not depend on the element. What each has, to the bit, is what an instance with its number
    /// would have.
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

    /// The same with one placement for all of them, for kernels that are [placed](Variant::placed).
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

    /// Elements in an order of the host's, such as that of a hierarchy's leaves: object `i` is the element
    /// of number `numbers[i]`, however often that occurs. It takes as long as
    /// [`Program::elements`], where [`Objects::in_order`] would be another pass over all of them. With a
    /// placement they are for kernels that are [placed](Variant::placed).
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
        let maker = self.elements.get_or_init(|| {
            nesting::with_deep_stack(|| ElementMaker::new(&self.tree, &self.layout).map(Box::new))
        });
        let maker = maker.as_ref().map_err(Clone::clone)?;
        maker.make((instance, block), count, number, &self.compiler)
    }

    /// The form of objects that share nothing, with placements or without.
    pub fn separate_objects(&self, placed: bool) -> ObjectForm {
        let words = self.layout.block_words;
        ObjectForm::new(0..if placed { words + PLACEMENT_SCALARS } else { words })
    }

    /// Whether an instance is of this program: of its class, referring to instances of the same classes.
    pub fn serves(&self, instance: &Instance) -> bool {
        instance.tree().key() == self.tree.key()
    }

    /// What hosts without a compiler are told of a kernel; its symbol is empty.
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

    /// A method, linked.
    ///
    /// # Errors
    /// If the class has no such method, or linking passes a limit.
    pub fn method(&self, method: Method) -> Result<Arc<LinkedMethod>, Diagnostic> {
        let Some(cell) = self.methods.get(&method) else {
            return Err(errors::missing_method(self.class(), method));
        };
        cell.get_or_init(|| self.compiler.link(&self.tree, method).map(Arc::new)).clone()
    }

    /// The members of an instance as known values, for [`Variant::knowing`].
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

    /// A kernel of a method, made at the first call.
    ///
    /// A kernel that [knows](Variant::known) members must be called for instances that have
    /// them: for others its results are unspecified.
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

    /// A function for a host's own packets, made at the first call. It serves all instances of the program, whose
    /// blocks are [`Layout::block_words`] long.
    ///
    /// # Errors
    /// If the engine makes no machine code, the class has no `intersect` or asks its host for something there, no method sets
    /// what is wanted, the record has no row for it, there are no packets of that width, or linking or code generation fails.
    pub fn callback(&self, callback: &Callback) -> Result<CompiledCallback, Diagnostic> {
        let mut callbacks = self.callbacks.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(compiled) = callbacks.get(callback) {
            return Ok(compiled.clone());
        }
        let compiled = self.compiler.callback(&self.tree, callback, &self.layout)?;
        callbacks.insert(callback.clone(), compiled.clone());
        Ok(compiled)
    }

    /// The packet code of a kernel, to be run on an interpreter that counts what it does.
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

    /// A method in one of the forms that it takes on its way to machine code, as text.
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

    /// The function of a variant.
    pub(crate) fn specialise(&self, method: &LinkedMethod, variant: &Variant) -> Arc<Function> {
        nesting::with_stack_for(method.nesting, || {
            let method = method.in_mode(variant.mode);
            self.compiler.specialise(&method.function, variant, &self.layout)
        })
    }

    /// The variant without what makes no difference to the method, so that equal kernels are
    /// made once.
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

    /// The kernel of a variant, or the error, if it has been made and kept.
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

    /// The packet code of a canonical variant.
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
}
