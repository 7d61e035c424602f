//! Makes kernels.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use rtsl_ir::class::Class;
use rtsl_jit::Llvm;
use rtsl_packet::Shape;
use rtsl_source::{Diagnostic, Diagnostics, diagnostic_codes as codes};
use rtsl_spec::Method;

use crate::Instance;
use crate::kernel::Kernel;
use crate::options::{Backend, EngineOptions};
use crate::program::Program;
use crate::tree::ClassTree;

/// Links instances and makes kernels for them, each once. Cheap to clone; safe to share among
/// threads.
#[derive(Clone, Debug)]
pub struct Engine {
    shared: Arc<Shared>,
    programs: Arc<Mutex<BTreeMap<Vec<usize>, Weak<Program>>>>,
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
pub type KernelRequest = (Arc<Program>, Method, Shape);

impl Engine {
    /// The widths that there are kernels for.
    pub const WIDTHS: [u32; 4] = [1, 4, 8, 16];

    /// An engine, and a warning if it falls back on the interpreter.
    ///
    /// # Errors
    /// If machine code is asked for and there is no LLVM, or the width is none of
    /// [`Engine::WIDTHS`].
    pub fn new(options: EngineOptions) -> Result<(Engine, Diagnostics), Diagnostic> {
        let mut warnings = Diagnostics::new();
        let llvm = match options.backend {
            Backend::Interpreter => None,
            Backend::Jit => Some(Llvm::load().map_err(|error| no_llvm(&error))?),
            Backend::Auto => match Llvm::load() {
                Ok(llvm) => Some(llvm),
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
        let shared = Arc::new(Shared { options, width, llvm });
        Ok((Engine { shared, programs: Arc::default() }, warnings))
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

    fn program_of(&self, tree: ClassTree) -> Arc<Program> {
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
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let next = std::sync::atomic::AtomicUsize::new(0);
        let work = || {
            loop {
                let index = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                let Some((program, method, shape)) = requests.get(index) else { break };
                // Kept by the program; asked for again below.
                let _ = program.kernel(*method, *shape);
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..threads.min(requests.len()) {
                scope.spawn(work);
            }
            work();
        });
        let kernels =
            requests.iter().map(|(program, method, shape)| program.kernel(*method, *shape));
        kernels.collect()
    }
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

fn unknown_width(width: u32) -> Diagnostic {
    Diagnostic::new(
        codes::UNKNOWN_WIDTH,
        format!("there are no kernels for {width} rays at a time"),
    )
    .help("the widths are 1, 4, 8 and 16")
}
