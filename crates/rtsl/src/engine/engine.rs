//! The engine of a host.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

use rtsl_ir::class::Class;
use rtsl_jit::{CodeCache, CodeCacheError, Llvm, OptLevel};
use rtsl_link::{AttributeTable, ClassTree};
use rtsl_source::{Diagnostic, Diagnostics};

use super::background::Background;
use super::specialised::SpecialisedKernel;
use crate::aot::library::{AotLibrary, AotOptions};
use crate::codegen::kernel::Kernel;
use crate::codegen::kernel_compiler::KernelCompiler;
use crate::codegen::kernel_source::KernelSource;
use crate::codegen::options::{Backend, EngineOptions};
use crate::instance::instance::Instance;
use crate::program::kernel_request::KernelRequest;
use crate::program::program::Program;
use crate::program::query_request::QueryRequest;
use crate::threads::{each_on_threads, on_threads, processors};

/// Links instances and makes their kernels, each once. Engines are cheap to clone, and threads can share them.
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
/// // Without LLVM the interpreter runs all kernels, and there is a warning.
/// assert_eq!(engine.llvm().is_none(), warnings.iter().next().is_some());
/// # let ball = rtsl::Instance::new(class, [])?;
/// let program = engine.program(&ball);
/// // All processors make the kernels.
/// let methods = [Method::Intersect, Method::ComputeNormal];
/// let requests = methods.map(|method| KernelRequest::new(&program, method, CallMode::Packet));
/// assert!(engine.compile_all(&requests).iter().all(Result::is_ok));
/// // Threads share an engine.
/// let engine = &engine;
/// std::thread::scope(|scope| scope.spawn(|| assert!(engine.program(&ball).has(Method::Intersect))).join());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Engine {
    compiler: Arc<KernelCompiler>,
    programs: Arc<Mutex<BTreeMap<Vec<usize>, Weak<Program>>>>,
    background: Arc<Background>,
}

impl Engine {
    /// The widths of kernels, in rays.
    pub const WIDTHS: [u32; 4] = KernelSource::WIDTHS;

    /// The numbers of full chunks that kernels can do at a time.
    pub const INTERLEAVES: [u32; 3] = rtsl_packet::interleave::FACTORS;

    /// Creates an engine, and a warning if it falls back on the interpreter.
    ///
    /// # Errors
    /// If the options ask for machine code and there is no LLVM, if `RTSL_LLVM` names a library that can't be used, if
    /// the width is not one of [`Engine::WIDTHS`], or the number of chunks not one of [`Engine::INTERLEAVES`].
    pub fn new(options: EngineOptions) -> Result<(Engine, Diagnostics), Diagnostic> {
        let (compiler, warnings) = KernelCompiler::new(options)?;
        let compiler = Arc::new(compiler);
        let (programs, background) = (Arc::default(), Arc::default());
        Ok((Engine { compiler, programs, background }, warnings))
    }

    /// Creates an engine that interprets everything: it needs no LLVM, and has the same bits.
    pub fn interpreter() -> Engine {
        let options = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
        Engine::new(options).expect("the interpreter is always there").0
    }

    /// Loads LLVM, if there is one, and compiles a small function: the first compilation of a process pages in and
    /// links LLVM's code, which takes longer than most kernels. A host may call this from another thread while it reads
    /// its scene.
    pub fn warm_up() {
        // `Engine::new` reports failures.
        let Ok(llvm) = Llvm::load() else { return };
        let text = "define <8 x float> @f(<8 x float> %a) {\n%b = fadd <8 x float> %a, %a\nret <8 x float> %b\n}";
        // Not from a cache, which would leave LLVM's code where it is.
        let _ = llvm.object(text, llvm.host(), OptLevel::default());
    }

    /// Keeps the machine code of this process in the user's [cache](CodeCache::folder_of_user), and takes what earlier
    /// processes left there, so that a picture that was rendered before begins without LLVM's work. The results are the
    /// same. A host calls this once, before it makes an engine.
    ///
    /// # Errors
    /// If the folder can't be used: code is compiled as without a cache.
    pub fn keep_code() -> Result<(), CodeCacheError> {
        if let Some(folder) = CodeCache::folder_of_user() {
            Llvm::keep_code_in(CodeCache::open(&folder)?);
        }
        Ok(())
    }

    /// Releases the memory that LLVM holds for further compilations, 40 MB and more. A host may call this before it
    /// works with its kernels for long; the next compilation takes some milliseconds longer.
    pub fn cool_down() {
        Llvm::release_memory();
    }

    pub(super) fn background(&self) -> &Background {
        &self.background
    }

    pub(super) fn compiler(&self) -> &Arc<KernelCompiler> {
        &self.compiler
    }

    /// The options.
    pub fn options(&self) -> &EngineOptions {
        self.compiler.options()
    }

    /// Rays at a time in kernels of variants without a width.
    pub fn width(&self) -> u32 {
        self.compiler.width()
    }

    /// LLVM; `None` if the interpreter runs kernels.
    pub fn llvm(&self) -> Option<&Llvm> {
        self.compiler.llvm()
    }

    /// True if kernels run packet code: as machine code, or on the interpreter that counts its work. Only packet code
    /// runs the stages of integrators; without it whole methods ask a host.
    pub fn runs_packets(&self) -> bool {
        let EngineOptions { trace, costs, .. } = self.options();
        self.llvm().is_some() || costs.is_some() && trace.is_none()
    }

    /// Returns the program of an instance: its class, linked with the classes of the instances that it refers to.
    /// Instances of the same classes share it.
    pub fn program(&self, instance: &Instance) -> Arc<Program> {
        self.program_of(instance.tree())
    }

    /// Returns the program of a class with no reference set, for tools that show its code.
    pub fn program_of_class(&self, class: &Arc<Class>) -> Arc<Program> {
        let references = class.references.iter().map(|it| vec![None; it.count.unset()]);
        self.program_of(ClassTree {
            class: class.clone(),
            references: references.collect(),
            attributes: AttributeTable::default(),
        })
    }

    fn program_of(&self, tree: ClassTree) -> Arc<Program> {
        let key = tree.key();
        let mut programs = self.programs.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(program) = programs.get(&key).and_then(Weak::upgrade) {
            return program;
        }
        // The cost of a cleaning is spread over the entries since the last one. The key of a dead entry may be that of
        // new classes, which replaces it.
        if programs.len().is_power_of_two() {
            programs.retain(|_, program| program.strong_count() > 0);
        }
        let program = Arc::new(Program::new(self.compiler.clone(), tree));
        programs.insert(key, Arc::downgrade(&program));
        program
    }

    /// Makes a library of classes. No LLVM is needed until its [object](AotLibrary::object) is.
    ///
    /// # Errors
    /// If two classes or symbols have one name, the prefix is no identifier, none of the classes has a requested
    /// method, or a method can't be linked or lowered.
    pub fn aot_library(
        &self,
        classes: &[Arc<Class>],
        options: &AotOptions,
    ) -> Result<AotLibrary, Diagnostic> {
        let program = |tree| self.program_of(tree);
        AotLibrary::new(classes, options, self.compiler.clone(), program)
    }

    /// Makes kernels on all processors; the results are in the order of the requests.
    pub fn compile_all(&self, requests: &[KernelRequest]) -> Vec<Result<Arc<Kernel>, Diagnostic>> {
        if self.compiler.llvm().is_some() {
            self.compile_together(requests);
        }
        let kernels = requests.iter();
        let kernels = kernels.map(|it| it.program.kernel(it.method, it.variant.clone()));
        kernels.collect()
    }

    /// Makes kernels that answer queries on all processors; the results are in the order of the requests.
    pub fn compile_queries(
        &self,
        requests: &[QueryRequest],
    ) -> Vec<Result<Arc<Kernel>, Diagnostic>> {
        each_on_threads(requests.len(), |index| requests[index].kernel())
    }

    /// Returns a kernel of the request, which a kernel that takes the members of `instance` for constants replaces once
    /// a background thread has made it.
    ///
    /// One thread makes all specialised kernels of an engine. It ends with the engine and these kernels; dropping the
    /// last of them waits for the kernel in progress. Known members of the request are ignored.
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
        let threads = processors();
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
                && !missing.iter().any(|(_, other)| other.is_same(&request))
            {
                missing.push((size, request));
            }
        }
        let sizes: Vec<usize> = missing.iter().map(|(size, _)| *size).collect();
        let modules = into_modules(&sizes, threads);
        on_threads(threads, modules.len(), |index| {
            let module: Vec<_> = modules[index].iter().map(|index| &missing[*index].1).collect();
            KernelRequest::make_together(&module, &self.compiler);
        });
    }
}

/// Distributes kernels of these sizes over modules of about equal work. There are enough modules to keep the threads
/// busy to the end, and few enough that the cost of a module does not matter.
fn into_modules(sizes: &[usize], threads: usize) -> Vec<Vec<usize>> {
    /// The cost of a kernel for LLVM beyond its operations, in operations.
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
