//! `rtsl build`: the stages of compiling a shader, or a library of shaders for other programs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::{Args, ValueEnum};
use rtsl::{
    CallMode, Class, Emit, EmitRequest, Engine, EngineOptions, Method, OptLevel, Target, Unit,
};
use serde_json::Value as JsonValue;

use super::build_library::{self, LibraryArguments, LibraryForm};
use super::eval::parse_setting;
use super::{CommandResult, Failure, Outcome, choose_class, compiler, engine, instance, unit_of};
use crate::arguments::{CodeArguments, SearchPath, VariantArguments, parse_shape, parse_width};
use crate::files::write_result;
use crate::names::find_method;
use crate::report::Reporter;

/// The command line of `rtsl build`.
#[derive(Debug, Args)]
pub struct BuildArguments {
    /// The shader: a file, or a class of the standard library. A library takes several.
    #[arg(value_name = "FILE|CLASS", required = true)]
    pub(super) sources: Vec<PathBuf>,
    /// The form to show or write.
    #[arg(long, value_enum)]
    emit: EmitName,
    /// The output file; standard output if not given.
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// The class, if the file has several; for a library its classes, separated by commas, or all if not given.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(super) class: Vec<String>,
    /// The method; all methods if not given.
    #[arg(long)]
    method: Option<String>,
    /// The call mode: the rays of a `packet` call have one object, those of `common-origin` also a common origin, those
    /// of `stream` one object each; `leaf` is for one ray and several objects, `single` for one ray and one object. For
    /// a library several, separated by commas. `packet` if not given, for a library `single`.
    #[arg(long, value_name = "SHAPES", value_delimiter = ',', value_parser = parse_shape)]
    pub(super) shape: Vec<CallMode>,
    /// The SIMD width in rays, for a library several, separated by commas; selected for the machine if not given. Never
    /// changes results.
    #[arg(long, value_name = "WIDTHS", value_delimiter = ',', value_parser = parse_width)]
    pub(super) width: Vec<u32>,
    #[command(flatten)]
    pub(super) library: LibraryArguments,
    #[command(flatten)]
    pub(super) variant: VariantArguments,
    /// A parameter of the instance; may be repeated.
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = parse_setting,
          requires = "specialise")]
    params: Vec<(String, JsonValue)>,
    /// The target machine: x86-64-v2, x86-64-v3, x86-64-v4 or aarch64; this one if not given.
    #[arg(long)]
    target: Option<String>,
    /// The optimisation level.
    #[arg(short = 'O', long = "optimize", value_name = "LEVEL", default_value_t = 2,
          value_parser = clap::value_parser!(u8).range(0..=3))]
    optimization: u8,
    #[command(flatten)]
    code: CodeArguments,
    #[command(flatten)]
    pub(super) search_path: SearchPath,
}

/// The names of the forms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum EmitName {
    /// The syntax tree.
    Ast,
    /// The single-ray IR, linked and optimised.
    Ir,
    /// Packet code with explicit masks.
    Packet,
    /// LLVM IR as text.
    Llvm,
    /// Assembly.
    Asm,
    /// A library: an object file with all methods of all classes.
    Obj,
    /// The C header of that object file.
    Header,
    /// The description of that object file's classes and parameters, as JSON.
    Layout,
    /// The classes as standalone C++17, which any compiler can build.
    Cpp,
}

/// The meaning of a form's name.
enum Form {
    Tree,
    Method(Emit),
    Library(LibraryForm),
}

impl EmitName {
    fn form(self) -> Form {
        match self {
            EmitName::Ast => Form::Tree,
            EmitName::Ir => Form::Method(Emit::Ir),
            EmitName::Packet => Form::Method(Emit::Packet),
            EmitName::Llvm => Form::Method(Emit::Llvm),
            EmitName::Asm => Form::Method(Emit::Assembly),
            EmitName::Obj => Form::Library(LibraryForm::Object),
            EmitName::Header => Form::Library(LibraryForm::Header),
            EmitName::Layout => Form::Library(LibraryForm::Layout),
            EmitName::Cpp => Form::Library(LibraryForm::Cpp),
        }
    }
}

/// Prints or writes the form.
pub fn run(arguments: &BuildArguments, reporter: &Reporter) -> CommandResult {
    let contents = match arguments.emit.form() {
        Form::Tree => syntax_tree(arguments, reporter)?,
        Form::Method(form) => emit_methods(arguments, form, reporter)?,
        Form::Library(form) => build_library::emit(arguments, form, reporter)?,
    };
    let Some(contents) = contents else { return Ok(Outcome::InputAtFault) };
    write_result(arguments.output.as_deref(), &contents)?;
    Ok(Outcome::Done)
}

impl BuildArguments {
    /// Returns the requested methods; `None` for all.
    pub(super) fn methods(&self) -> Result<Option<Vec<Method>>, Failure> {
        let name = self.method.as_deref();
        name.map(|name| find_method(name).map(|it| vec![it]).map_err(Failure::Usage)).transpose()
    }

    /// Returns the requested target; `None` for this machine.
    pub(super) fn target(&self) -> Result<Option<Target>, Failure> {
        match self.target.as_deref() {
            None | Some("host") => Ok(None),
            Some(name) => Target::by_name(name).map(Some).ok_or_else(|| {
                let names = Target::NAMES.join(", ");
                Failure::Usage(format!("there is no target `{name}`: host, {names}"))
            }),
        }
    }

    /// Returns an engine for the first of the widths.
    pub(super) fn engine(&self, reporter: &Reporter) -> Result<Engine, Failure> {
        let optimization = level(self.optimization);
        let width = self.width.first().copied();
        engine(EngineOptions { optimization, width, ..self.code.options() }, reporter)
    }

    /// Returns the source of a form that has only one.
    fn source(&self) -> Result<&Path, Failure> {
        only("source", &self.sources)?;
        Ok(&self.sources[0])
    }
}

/// Rejects several values for a form that takes one.
fn only<T>(what: &str, given: &[T]) -> Result<(), Failure> {
    if given.len() > 1 {
        let message = format!(
            "this form is of one {what}; libraries (`obj`, `header`, `layout`, `cpp`) take several"
        );
        return Err(Failure::Usage(message));
    }
    Ok(())
}

fn syntax_tree(
    arguments: &BuildArguments,
    reporter: &Reporter,
) -> Result<Option<Vec<u8>>, Failure> {
    let compiler = compiler(&arguments.search_path);
    let (tree, compilation) = compiler.print_syntax_tree(arguments.source()?);
    reporter.compilation(&compilation);
    Ok((!compilation.diagnostics.has_errors()).then(|| tree.into_bytes()))
}

fn emit_methods(
    arguments: &BuildArguments,
    form: Emit,
    reporter: &Reporter,
) -> Result<Option<Vec<u8>>, Failure> {
    let source = arguments.source()?;
    only("class", &arguments.class)?;
    only("shape", &arguments.shape)?;
    only("width", &arguments.width)?;
    if arguments.library.is_given() {
        let message = "`--bind` and `--prefix` are for libraries: `obj`, `header`, `layout`, `cpp`";
        return Err(Failure::Usage(message.to_owned()));
    }
    let compiler = compiler(&arguments.search_path);
    let Some(unit) = unit_of(&compiler, source, reporter)? else { return Ok(None) };
    let name = arguments.class.first().map(String::as_str);
    let class = choose_class(&unit, name.or_else(|| standard_class(source)))?;
    emit_class(arguments, form, class, &unit, reporter).map(Some)
}

/// Returns the class that a source names, if it is not a file.
pub(super) fn standard_class(source: &Path) -> Option<&str> {
    if super::is_file_name(source) { None } else { source.to_str() }
}

fn emit_class(
    arguments: &BuildArguments,
    form: Emit,
    class: &Arc<Class>,
    unit: &Unit,
    reporter: &Reporter,
) -> Result<Vec<u8>, Failure> {
    let methods: Vec<Method> = match arguments.methods()? {
        Some(methods) => methods,
        None if class.methods.is_empty() => {
            return Err(Failure::Usage(format!("class `{}` has no methods", class.name)));
        }
        None => class.methods.keys().copied().collect(),
    };
    let engine = arguments.engine(reporter)?;
    let mut program = engine.program_of_class(class);
    let shape = arguments.shape.first().copied().unwrap_or(CallMode::Packet);
    let mut variant = arguments.variant.reading(shape);
    if arguments.variant.specialise {
        let instance = instance(&arguments.params, class, unit)?;
        program = engine.program(&instance);
        variant = variant.knowing(program.known_members(&instance));
    }
    let mut contents = Vec::new();
    for method in methods {
        let request = EmitRequest {
            emit: form,
            method,
            variant: variant.clone(),
            target: arguments.target()?,
        };
        contents.extend(program.emit(&request)?);
        if contents.last().is_some_and(|last| *last != b'\n') {
            contents.push(b'\n');
        }
    }
    Ok(contents)
}

fn level(number: u8) -> OptLevel {
    match number {
        0 => OptLevel::O0,
        1 => OptLevel::O1,
        2 => OptLevel::O2,
        _ => OptLevel::O3,
    }
}
