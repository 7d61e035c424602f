//! Libraries of classes.

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl_abi::CallMode;
use rtsl_abi::description::{KernelDescription, LibraryDescription};
use rtsl_cpp::ClassCode;
use rtsl_ir::Function;
use rtsl_ir::class::Class;
use rtsl_jit::{JitError, Llvm, Target};
use rtsl_link::{ClassTree, Outputs};
use rtsl_llvm::{Constructor, Library};
use rtsl_packet::Kernel;
use rtsl_source::{Diagnostic, diagnostic_codes as codes};
use rtsl_spec::Method;

use super::bindings::Bindings;
use super::{class, constructor};
use crate::codegen::kernel_compiler::{KernelCompiler, target_features};
use crate::codegen::variant::Variant;
use crate::program::kernel_description::describe_kernel;
use crate::program::program::Program;
use crate::{errors, nesting};

/// Options of a library.
#[derive(Clone, Debug)]
pub struct AotOptions {
    /// The prefix of symbols, a C identifier. Libraries in one program have different prefixes.
    pub prefix: String,
    /// A kernel of each method for each of these call modes and widths; duplicates count once.
    pub modes: Vec<(CallMode, u32)>,
    /// The outputs of methods that hosts read.
    pub outputs: Outputs,
    /// The methods; all methods of the classes if `None`.
    pub methods: Option<Vec<Method>>,
    /// The classes of references.
    pub bindings: Bindings,
}

impl Default for AotOptions {
    fn default() -> AotOptions {
        AotOptions {
            prefix: "rtsl".to_owned(),
            modes: vec![(CallMode::Single, 1)],
            outputs: Outputs::ALL,
            methods: None,
            bindings: Bindings::default(),
        }
    }
}

/// Classes that are compiled to an object file.
///
/// ```
/// # let text = "class Ball : rt_Primitive; [[min 0]] public float radius = 1.0;
/// #     void intersect() { hit(-rt_RayOrigin.z - radius); }
/// #     void computeNormal() { rt_GeometricNormal = rt_HitPoint; }";
/// # let unit = rtsl::Compiler::default().compile("ball.rtsl", text).unit.expect("it compiles");
/// # let class = unit.class("Ball")?;
/// # let (engine, _) = rtsl::Engine::new(rtsl::EngineOptions::default())?;
/// # let ball = rtsl::Instance::new(class, [("radius", 2.0.into())])?;
/// use rtsl::aot::AotOptions;
/// use rtsl::CallMode;
///
/// let modes = vec![(CallMode::Single, 1), (CallMode::Packet, 8)];
/// let library = engine.aot_library(unit.classes(), &AotOptions { modes, ..AotOptions::default() })?;
/// assert!(library.header().contains("void rtsl_Ball_intersect_packet8(RtslCall *call);"));
/// let radius = &library.description().classes[0].parameters[0];
/// assert_eq!((radius.name.as_str(), radius.offset), ("radius", 0));
/// if engine.llvm().is_some() {
///     assert!(library.object(None)?.starts_with(b"\x7fELF"));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct AotLibrary {
    description: LibraryDescription,
    kernels: Vec<(String, Kernel)>,
    constructors: Vec<Constructor>,
    functions: Vec<ClassFunctions>,
    warnings: Vec<Diagnostic>,
    compiler: Arc<KernelCompiler>,
}

/// The code of a class before it is lowered.
#[derive(Debug, Default)]
struct ClassFunctions {
    constructors: Vec<Function>,
    methods: Vec<(Method, Arc<Function>)>,
}

impl AotLibrary {
    /// Makes a library of classes, each by its program. No LLVM is needed until its [object](AotLibrary::object) is.
    ///
    /// # Errors
    /// If two classes or symbols have one name, the prefix is no identifier, none of the classes has a requested
    /// method, or a method can't be linked or lowered.
    pub(crate) fn new(
        classes: &[Arc<Class>],
        options: &AotOptions,
        compiler: Arc<KernelCompiler>,
        program: impl Fn(ClassTree) -> Arc<Program> + Send + Sync,
    ) -> Result<AotLibrary, Diagnostic> {
        check_prefix(&options.prefix)?;
        check_methods(classes, options)?;
        let mut library = AotLibrary {
            description: LibraryDescription { prefix: options.prefix.clone(), classes: Vec::new() },
            kernels: Vec::new(),
            constructors: Vec::new(),
            functions: Vec::new(),
            warnings: Vec::new(),
            compiler,
        };
        nesting::with_deep_stack(|| {
            for class in classes {
                library.add_class(&program(options.bindings.tree(class)?), options)?;
            }
            library.check_symbols()?;
            Ok(library)
        })
    }

    /// The description of the library for hosts.
    pub fn description(&self) -> &LibraryDescription {
        &self.description
    }

    /// The warnings of linking.
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.warnings
    }

    /// Returns the C header: the [kernel interface](rtsl_cpp::kernel_header), which has a separate guard, and the
    /// symbols of this library. C99 and C++11.
    pub fn header(&self) -> String {
        rtsl_cpp::library_header(&self.description)
    }

    /// Returns the classes as self-contained C++17: a struct for each, with a member function for each method. It
    /// computes the same bits.
    pub fn cpp(&self) -> String {
        nesting::with_deep_stack(|| rtsl_cpp::emit(&self.description, &self.code()))
    }

    /// Returns the code of each class, linked and optimised.
    pub fn code(&self) -> Vec<ClassCode<'_>> {
        let classes = self.functions.iter().map(|functions| ClassCode {
            constructors: functions.constructors.iter().collect(),
            methods: functions.methods.iter().map(|(method, it)| (*method, &**it)).collect(),
        });
        classes.collect()
    }

    /// Returns an object file (ELF, position independent) for a machine, this one if `None`. It needs only `memcpy`,
    /// `memmove` and `memset`, and an exact `fmaf` on machines without fused multiply-add.
    ///
    /// # Errors
    /// Without LLVM, or if LLVM fails.
    pub fn object(&self, target: Option<&Target>) -> Result<Vec<u8>, Diagnostic> {
        let llvm = Llvm::load().map_err(|error| errors::no_llvm(&error))?;
        let target = target.unwrap_or(llvm.host());
        let level = self.compiler.options().optimization;
        let text = nesting::with_deep_stack(|| self.llvm_text(target));
        let compile = |level| llvm.object(&text, target, level);
        let object = level.compile_kernels(self.all_kernels(), compile);
        object.map_err(|error| self.object_error(&error))
    }

    fn object_error(&self, error: &JitError) -> Diagnostic {
        let JitError::Frame { function, .. } = error else {
            return errors::machine_code(&self.description.symbol(), 1, error);
        };
        let kernel = self.kernels.iter().find(|(symbol, _)| symbol == function);
        errors::machine_code(function, kernel.map_or(1, |(_, kernel)| kernel.width), error)
    }

    /// The kernels of methods and constructors, with their symbols.
    fn all_kernels(&self) -> impl Iterator<Item = (&str, &Kernel)> {
        let methods = self.kernels.iter().map(|(symbol, kernel)| (symbol.as_str(), kernel));
        let constructors = self.constructors.iter().flat_map(|constructor| {
            constructor.parts.iter().map(|part| (constructor.symbol.as_str(), &part.kernel))
        });
        methods.chain(constructors)
    }

    /// Returns the text that LLVM compiles.
    fn llvm_text(&self, target: &Target) -> String {
        let library = Library {
            description: &self.description,
            kernels: &self.kernels,
            constructors: &self.constructors,
            target: target.cpu(),
            version: env!("CARGO_PKG_VERSION"),
        };
        rtsl_llvm::emit_library(&library, &target_features(target))
    }

    fn add_class(&mut self, program: &Program, options: &AotOptions) -> Result<(), Diagnostic> {
        let class = program.class().clone();
        let prefix = format!("{}_{}", options.prefix, class.name);
        let (mut description, construction) = class::describe(program)?;
        let constructor =
            constructor::constructor(program, &construction, &prefix, &self.compiler)?;
        description.constructor = constructor.as_ref().map(|it| it.symbol.clone());
        self.constructors.extend(constructor);
        let constructors = constructor::constructor_functions(program)?;
        self.functions.push(ClassFunctions { constructors, methods: Vec::new() });
        let is_wanted = |it: &&Method| options.methods.as_ref().is_none_or(|all| all.contains(it));
        for &method in class.methods.keys().filter(is_wanted) {
            description.kernels.extend(self.add_method(program, method, &prefix, options)?);
        }
        self.description.classes.push(description);
        Ok(())
    }

    fn add_method(
        &mut self,
        program: &Program,
        method: Method,
        prefix: &str,
        options: &AotOptions,
    ) -> Result<Vec<KernelDescription>, Diagnostic> {
        let linked = program.method(method)?;
        program.refuse_questions(method, "the hosts of libraries")?;
        self.warnings.extend(linked.warnings.iter().cloned());
        let variant = Variant::new(CallMode::Single).reading(options.outputs);
        let function = program.specialise(&linked, &program.canonical(&linked, variant));
        if let Some(functions) = self.functions.last_mut() {
            functions.methods.push((method, function));
        }
        let variants = options.modes.iter().map(|(mode, width)| {
            let variant = Variant::new(*mode).with_width(*width).reading(options.outputs);
            program.canonical(&linked, variant)
        });
        let variants: BTreeSet<Variant> = variants.collect();
        let mut descriptions = Vec::new();
        for variant in variants {
            let kernel = program.packet(&linked, &variant)?;
            let (mode, width) = (variant.mode, kernel.width);
            let symbol = kernel_symbol(prefix, method, mode, width);
            let description = describe_kernel(method, &linked, &variant, width, symbol);
            self.kernels.push((description.symbol.clone(), kernel));
            descriptions.push(description);
        }
        Ok(descriptions)
    }

    /// Checks that symbols are distinct.
    fn check_symbols(&self) -> Result<(), Diagnostic> {
        let description = &self.description;
        let classes = description.classes.iter().map(|class| description.class_symbol(class));
        let kernels = self.kernels.iter().map(|(symbol, _)| symbol.clone());
        let constructors = self.constructors.iter().map(|constructor| constructor.symbol.clone());
        let symbols = classes.chain(kernels).chain(constructors);
        let mut seen = BTreeSet::from([description.symbol()]);
        for symbol in symbols {
            if seen.contains(&symbol) {
                return Err(same_symbol(&symbol));
            }
            seen.insert(symbol);
        }
        Ok(())
    }
}

/// Returns the symbol of a kernel: `rtsl_Sphere_intersect_single`, `rtsl_Sphere_intersect_packet8`.
fn kernel_symbol(prefix: &str, method: Method, mode: CallMode, width: u32) -> String {
    let (method, name) = (method.name(), mode.name().replace('-', "_"));
    match mode {
        CallMode::Single => format!("{prefix}_{method}_{name}"),
        CallMode::Packet | CallMode::CommonOrigin | CallMode::Stream | CallMode::Leaf => {
            format!("{prefix}_{method}_{name}{width}")
        }
    }
}

/// Checks that each requested method exists in a class.
fn check_methods(classes: &[Arc<Class>], options: &AotOptions) -> Result<(), Diagnostic> {
    let methods = options.methods.iter().flatten();
    for method in methods {
        let has = classes.iter().any(|class| class.methods.contains_key(method));
        if let (false, Some(class)) = (has, classes.first()) {
            return Err(errors::missing_method(class, *method));
        }
    }
    Ok(())
}

fn check_prefix(prefix: &str) -> Result<(), Diagnostic> {
    let begins_well = prefix.starts_with(|first: char| first.is_ascii_alphabetic());
    let goes_on_well = prefix.chars().all(|it| it.is_ascii_alphanumeric() || it == '_');
    if begins_well && goes_on_well {
        return Ok(());
    }
    let problem = format!("`{prefix}` can't begin the names of symbols");
    let problem = Diagnostic::new(codes::WRONG_VALUE, problem);
    Err(problem.help("take letters, digits and `_`, a letter first"))
}

fn same_symbol(symbol: &str) -> Diagnostic {
    let problem = format!("the library would have two symbols `{symbol}`");
    Diagnostic::new(codes::DUPLICATE_NAME, problem)
        .help("rename a class, or leave one of them out; a library's symbols are its classes' names, with its prefix")
}
