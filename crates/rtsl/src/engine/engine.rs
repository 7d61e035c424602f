//! Makes kernels.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

use rtsl_ir::class::Class;
use rtsl_jit::{Llvm, OptLevel};
use rtsl_source::{Diagnostic, Diagnostics, diagnostic_codes as codes};
use rtsl_spec::Method;

use crate::codegen::kernel::Kernel;
use crate::codegen::options::{Backend, EngineOptions};
use crate::codegen::variant::Variant;
use crate::engine::background::Background;
use crate::engine::specialised::SpecialisedKernel;
use crate::instance::instance::Instance;
use crate::link::class_tree::ClassTree;
use crate::program::program::Program;

/// Links instances and makes kernels for them, each once. Cheap to clone; safe to share among
/// threads.
///
/// ```
/// # let text = "class Ball : rt_Primitive; [[min 0]] public float radius = 1.0;
/// #     void intersect() { hit(-rt_RayOrigin.z - radius); }
/// #     void computeNormal() { rt_GeometricNormal = rt_HitPoint; }";
/// # let unit = rtsl::Compiler::default().compile("ball.rtsl", text).unit.expect("it compiles");
/// # let class = unit.class("Ball")?;
/// use rtsl::{Backend, Engine, EngineOptions, KernelRequest, Method, CallMode};
///
/// let (engine, warnings) = Engine::new(EngineOptions { backend: Backend::Auto, ..EngineOptions::default() })?;
/// // Without LLVM everything runs on the interpreter, with a warning.
/// assert_eq!(engine.llvm().is_none(), warnings.iter().next().is_some());
/// # let ball = rtsl::Instance::new(class, [])?;
/// let program = engine.program(&ball);
/// // Kernels that are needed at once are made at once, on all processors.
/// let methods = [Method::Intersect, Method::ComputeNormal];
/// let requests = methods.map(|method| KernelRequest::new(&program, method, CallMode::Packet));
/// assert!(engine.compile_all(&requests).iter().all(Result::is_ok));
/// // An engine is for all threads.
/// let engine = &engine;
/// std::thread::scope(|scope| scope.spawn(|| assert!(engine.program(&ball).has(Method::Intersect))).join());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Engine {
    shared: Arc<Shared>,
    programs: Arc<Mutex<BTreeMap<Vec<usize>, Weak<Program>>>>,
    background: Arc<Background>,
}

/// What programs need of their engine.
#[derive(Debug)]
pub(crate) struct Shared {
    pub options: EngineOptions,
    pub width: u32,
    /// `None`: the interpreter runs everything.
    pub llvm: Option<Arc<Llvm>>,
}

/// A kernel to make.
#[derive(Clone, Debug)]
pub struct KernelRequest {
    /// The program.
    pub program: Arc<Program>,
    /// One of its methods.
    pub method: Method,
    /// Which of the method's kernels.
    pub variant: Variant,
}

impl KernelRequest {
    /// A kernel of a method; a [`CallMode`](rtsl_abi::CallMode) asks for the plain one of the shape.
    pub fn new(program: &Arc<Program>, method: Method, variant: impl Into<Variant>) -> Self {
        KernelRequest { program: program.clone(), method, variant: variant.into() }
    }

    fn is(&self, other: &KernelRequest) -> bool {
        Arc::ptr_eq(&self.program, &other.program)
            && self.method == other.method
            && self.variant == other.variant
    }
}

impl Engine {
    /// The widths that there are kernels for.
    pub const WIDTHS: [u32; 4] = [1, 4, 8, 16];

    /// How many full chunks kernels can do at a time.
    pub const INTERLEAVES: [u32; 3] = rtsl_packet::interleave::FACTORS;

    /// An engine, and a warning if it falls back on the interpreter.
    ///
    /// # Errors
    /// If machine code is asked for and there is no LLVM, or `RTSL_LLVM` names one that can't be
    /// used, or the width is none of [`Engine::WIDTHS`], or the chunks at a time none of
    /// [`Engine::INTERLEAVES`].
    pub fn new(options: EngineOptions) -> Result<(Engine, Diagnostics), Diagnostic> {
        let mut warnings = Diagnostics::new();
        let llvm = match options.backend {
            Backend::Interpreter => None,
            Backend::Jit => Some(Llvm::load().map_err(|error| no_llvm(&error))?),
            Backend::Auto => match Llvm::load() {
                Ok(llvm) => Some(llvm),
                // Who names a library wants that one, not something slower.
                Err(error) if error.chosen_by_user => return Err(no_llvm(&error)),
                Err(error) => {
                    warnings.push(interpreter_instead(&error));
                    None
                }
            },
        };
        let width = options.width.unwrap_or_else(|| llvm.as_deref().map_or(1, natural_width));
        if !Engine::WIDTHS.contains(&width) {
            return Err(unknown_width(width));
        }
        if let Some(factor) = options.interleave.filter(|it| !Engine::INTERLEAVES.contains(it)) {
            return Err(unknown_interleave(factor));
        }
        let shared = Arc::new(Shared { options, width, llvm });
        let (programs, background) = (Arc::default(), Arc::default());
        Ok((Engine { shared, programs, background }, warnings))
    }

    /// Loads LLVM, if there is one, and has it compile something: the first compilation of a process
    /// pages in and links LLVM's code, which takes longer than most kernels. A host may
    /// call this from another thread while it reads its scene.
    pub fn warm_up() {
        // Whoever makes an engine hears of failures.
        let Ok(llvm) = Llvm::load() else { return };
        let text = "define <8 x float> @f(<8 x float> %a) {\n%b = fadd <8 x float> %a, %a\nret <8 x float> %b\n}";
        let _ = llvm.compile(text, llvm.host(), OptLevel::default());
    }

    /// Gives back what memory LLVM holds for further compilations, 40 MB and more. A host may call this before it works with
    /// its kernels for long; what it compiles afterwards takes some milliseconds longer.
    pub fn cool_down() {
        Llvm::release_memory();
    }

    pub(crate) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// How it makes kernels.
    pub fn options(&self) -> &EngineOptions {
        &self.shared.options
    }

    /// Rays at a time.
    pub fn width(&self) -> u32 {
        self.shared.width
    }

    /// The LLVM that compiles; `None` where the interpreter runs kernels.
    pub fn llvm(&self) -> Option<&Llvm> {
        self.shared.llvm.as_deref()
    }

    /// The program of an instance: its class, linked with those of the instances that it refers
    /// to. Instances of the same classes share it.
    pub fn program(&self, instance: &Instance) -> Arc<Program> {
        self.program_of(ClassTree::of(instance))
    }

    /// The program of a class with no reference set: to look at its code.
    pub fn program_of_class(&self, class: &Arc<Class>) -> Arc<Program> {
        let count = |count: Option<u32>| count.map_or(1, |count| count as usize);
        let references = class.references.iter().map(|it| vec![None; count(it.count)]);
        self.program_of(ClassTree { class: class.clone(), references: references.collect() })
    }

    pub(crate) fn program_of(&self, tree: ClassTree) -> Arc<Program> {
        let key = tree.key();
        let mut programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(program) = programs.get(&key).and_then(Weak::upgrade) {
            return program;
        }
        // Dead entries go when they are the greater part, so that cleaning costs nothing on
        // average. A dead entry's key may come back as that of other classes; it is replaced.
        if programs.len().is_power_of_two() {
            programs.retain(|_, program| program.strong_count() > 0);
        }
        let program = Arc::new(Program::new(self.shared.clone(), tree));
        programs.insert(key, Arc::downgrade(&program));
        program
    }

    /// Makes kernels on all processors; the results are in the order of the requests.
    pub fn compile_all(&self, requests: &[KernelRequest]) -> Vec<Result<Arc<Kernel>, Diagnostic>> {
        if self.shared.llvm.is_some() {
            self.compile_together(requests);
        }
        let kernels = requests.iter();
        let kernels = kernels.map(|it| it.program.kernel(it.method, it.variant.clone()));
        kernels.collect()
    }

    /// A kernel that becomes faster by itself: one that takes the members of `instance` for
    /// constants is made in the background.
    ///
    /// All that an engine specialises is made by one thread, which ends with the engine and these
    /// kernels; dropping the last of them waits for what has begun. What the request says is
    /// known of members does not count.
    ///
    /// # Errors
    /// As for [`Program::kernel`].
    ///
    /// # Panics
    /// If the instance belongs to another program.
    pub fn specialise(
        &self,
        request: &KernelRequest,
        instance: &Instance,
    ) -> Result<SpecialisedKernel, Diagnostic> {
        SpecialisedKernel::new(&self.background, request, instance)
    }

    fn compile_together(&self, requests: &[KernelRequest]) {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let linked = requests.iter().map(|_| OnceLock::new()).collect::<Vec<_>>();
        on_threads(threads, requests.len(), |index| {
            let KernelRequest { program, method, variant } = &requests[index];
            let Ok(method) = program.method(*method) else { return };
            let size = method.function.values.len();
            let _ = linked[index].set((size, program.canonical(&method, variant.clone())));
        });
        let mut missing: Vec<(usize, KernelRequest)> = Vec::new();
        for (request, linked) in requests.iter().zip(linked) {
            let Some((size, variant)) = linked.into_inner() else { continue };
            let request = KernelRequest { variant, ..request.clone() };
            let KernelRequest { program, method, variant } = &request;
            if program.made(*method, variant).is_none()
                && !missing.iter().any(|(_, other)| other.is(&request))
            {
                missing.push((size, request));
            }
        }
        let sizes: Vec<usize> = missing.iter().map(|(size, _)| *size).collect();
        let modules = into_modules(&sizes, threads);
        on_threads(threads, modules.len(), |index| {
            let module: Vec<_> = modules[index].iter().map(|index| &missing[*index].1).collect();
            Program::make_together(&module, &self.shared);
        });
    }
}

/// Shares kernels of these sizes out among modules of about equal work: enough modules to keep
/// the threads busy to the end, few enough that what each costs by itself does not count.
fn into_modules(sizes: &[usize], threads: usize) -> Vec<Vec<usize>> {
    /// What a kernel costs LLVM beyond its operations, in operations.
    const KERNEL_COST: usize = 50;
    const MODULES_PER_THREAD: usize = 2;
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|index| std::cmp::Reverse(sizes[*index]));
    let count = (threads * MODULES_PER_THREAD).min(sizes.len());
    let mut modules = vec![(0, Vec::new()); count];
    for index in order {
        if let Some((work, module)) = modules.iter_mut().min_by_key(|(work, _)| *work) {
            *work += sizes[index] + KERNEL_COST;
            module.push(index);
        }
    }
    modules.into_iter().map(|(_, module)| module).collect()
}

/// Does the pieces of work `0..count` on threads, each piece once.
fn on_threads(threads: usize, count: usize, work: impl Fn(usize) + Sync) {
    let next = AtomicUsize::new(0);
    let take = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= count {
                break;
            }
            work(index);
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads.min(count) {
            scope.spawn(take);
        }
        take();
    });
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

pub(crate) fn no_llvm(error: &rtsl_jit::LlvmError) -> Diagnostic {
    let diagnostic = Diagnostic::new(codes::NO_LLVM, error.to_string());
    diagnostic.help("the interpreter needs no LLVM: `--backend interp`")
}

fn interpreter_instead(error: &rtsl_jit::LlvmError) -> Diagnostic {
    Diagnostic::new(codes::INTERPRETER_INSTEAD, error.to_string())
        .note("everything runs on the interpreter, which is slower by far")
}

fn unknown_interleave(factor: u32) -> Diagnostic {
    Diagnostic::new(
        codes::UNKNOWN_WIDTH,
        format!("there are no kernels for {factor} vectors of rays at a time"),
    )
    .help("they do 1, 2 or 4")
}

pub(crate) fn unknown_width(width: u32) -> Diagnostic {
    Diagnostic::new(
        codes::UNKNOWN_WIDTH,
        format!("there are no kernels for {width} rays at a time"),
    )
    .help("the widths are 1, 4, 8 and 16")
}
