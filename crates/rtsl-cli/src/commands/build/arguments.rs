//! The command line of `rtsl build`.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use rtsl::{CallMode, Engine, EngineOptions, Method, OptLevel, Target};
use serde_json::Value as JsonValue;

use crate::arguments::{CodeArguments, SearchPath, VariantArguments, parse_call_mode, parse_width};
use crate::commands::shader::{engine, is_file_name};
use crate::eval::parse_setting;
use crate::names::find_method;
use crate::outcome::Failure;
use crate::report::Reporter;

/// The command line of `rtsl build`.
#[derive(Debug, Args)]
pub struct BuildArguments {
    /// The shader: a file, or a class of the standard library. A library takes several.
    #[arg(value_name = "FILE|CLASS", required = true)]
    pub sources: Vec<PathBuf>,
    /// The form to show or write.
    #[arg(long, value_enum)]
    pub emit: EmitName,
    /// The output file; standard output if not given.
    #[arg(short, long, value_name = "OUT")]
    pub output: Option<PathBuf>,
    /// Print the time of each stage of the compiler to standard output; the form is then only written if `-o` is given.
    #[arg(long)]
    pub timings: bool,
    /// With `--timings`: print one JSON object.
    #[arg(long, requires = "timings")]
    pub json: bool,
    /// The class, if the file has several; for a library its classes, separated by commas, or all if not given.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub class: Vec<String>,
    /// The method; all methods if not given.
    #[arg(long)]
    pub method: Option<String>,
    /// The call mode: the rays of a `packet` call have one object, those of `common-origin` also a common origin, those
    /// of `stream` one object each; `leaf` is for one ray and several objects, `single` for one ray and one object. For
    /// a library several, separated by commas. `packet` if not given, for a library `single`.
    #[arg(long = "call-mode", alias = "shape", value_name = "MODES", value_delimiter = ',', value_parser = parse_call_mode)]
    pub mode: Vec<CallMode>,
    /// The SIMD width in rays, for a library several, separated by commas; selected for the machine if not given. Never
    /// changes results.
    #[arg(long, value_name = "WIDTHS", value_delimiter = ',', value_parser = parse_width)]
    pub width: Vec<u32>,
    #[command(flatten)]
    pub library: LibraryArguments,
    #[command(flatten)]
    pub variant: VariantArguments,
    /// A parameter of the instance; may be repeated.
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = parse_setting,
          requires = "specialise")]
    pub params: Vec<(String, JsonValue)>,
    /// The target machine: x86-64-v2, x86-64-v3, x86-64-v4 or aarch64; this one if not given.
    #[arg(long)]
    pub target: Option<String>,
    /// The optimisation level.
    #[arg(short = 'O', long = "optimize", value_name = "LEVEL", default_value_t = 2,
          value_parser = clap::value_parser!(u8).range(0..=3))]
    pub optimization: u8,
    #[command(flatten)]
    pub code: CodeArguments,
    #[command(flatten)]
    pub search_path: SearchPath,
}

/// Arguments that apply to libraries only.
#[derive(Debug, Args)]
pub struct LibraryArguments {
    /// The class of a reference's target, `Ward.kd=Constant`, in all instances of the first class in the library; may
    /// be repeated. An element of an array of references is `Layered.layers[2]=Ward`; an array without a size has the
    /// elements that are bound, from the first on. References without a binding are unset.
    #[arg(long, value_name = "CLASS.REFERENCE=CLASS", value_parser = parse_binding)]
    pub bind: Vec<Binding>,
    /// The prefix of the library's symbols; `rtsl` if not given.
    #[arg(long)]
    pub prefix: Option<String>,
}

/// A reference and its target, by their names.
#[derive(Clone, Debug)]
pub struct Binding {
    /// The class that has the reference.
    pub class: String,
    /// The reference, with the index of an element.
    pub reference: String,
    /// The class of its target.
    pub to: String,
}

/// The names of the forms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EmitName {
    /// The syntax tree.
    Ast,
    /// The single-ray IR, linked and optimised.
    Ir,
    /// The single-ray IR, split where an integrator waits for the renderer, with the sizes of stages and frame.
    Stages,
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

impl BuildArguments {
    /// Returns the requested methods; `None` for all.
    pub fn methods(&self) -> Result<Option<Vec<Method>>, Failure> {
        let name = self.method.as_deref();
        name.map(|name| find_method(name).map(|it| vec![it]).map_err(Failure::Usage)).transpose()
    }

    /// Returns the requested target; `None` for this machine.
    pub fn target(&self) -> Result<Option<Target>, Failure> {
        match self.target.as_deref() {
            None | Some("host") => Ok(None),
            Some(name) => Target::by_name(name).map(Some).ok_or_else(|| {
                let names = Target::NAMES.join(", ");
                Failure::Usage(format!("there is no target `{name}`: host, {names}"))
            }),
        }
    }

    /// Returns an engine for the first of the widths.
    pub fn engine(&self, reporter: &Reporter) -> Result<Engine, Failure> {
        let optimization = level(self.optimization);
        let width = self.width.first().copied();
        engine(EngineOptions { optimization, width, ..self.code.options() }, reporter)
    }
}

impl LibraryArguments {
    /// True if any of these arguments is given.
    pub fn is_given(&self) -> bool {
        !self.bind.is_empty() || self.prefix.is_some()
    }
}

/// Returns the class that a source names, if it is not a file.
pub fn standard_class(source: &Path) -> Option<&str> {
    if is_file_name(source) { None } else { source.to_str() }
}

fn parse_binding(text: &str) -> Result<Binding, String> {
    let parts = text.split_once('=').and_then(|(reference, to)| {
        let (class, reference) = reference.split_once('.')?;
        Some(Binding {
            class: class.to_owned(),
            reference: reference.to_owned(),
            to: to.to_owned(),
        })
    });
    let parts = parts
        .filter(|it| [&it.class, &it.reference, &it.to].into_iter().all(|name| !name.is_empty()));
    parts.ok_or_else(|| "a binding is written CLASS.REFERENCE=CLASS".to_owned())
}

fn level(number: u8) -> OptLevel {
    match number {
        0 => OptLevel::O0,
        1 => OptLevel::O1,
        2 => OptLevel::O2,
        _ => OptLevel::O3,
    }
}
