//! What the command line says.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use rtsl::{Backend, CallMode, EngineOptions, Math, Outputs, StateVariable, Variant};
use rtsl_memory::Amount;

use crate::names::find_state;

/// The loop iterations of one ray in one call, or of one constructor, past which a command takes a loop for endless.
pub const DEFAULT_LOOP_BUDGET: u32 = 1 << 24;

/// RTSL, the Ray Tracing Shading Language: check, compile, run and render.
#[derive(Debug, Parser)]
#[command(name = "rtsl", version, disable_help_subcommand = true)]
pub struct Arguments {
    /// When diagnostics have colours; `auto`: on a terminal, unless NO_COLOR is set.
    #[arg(long, global = true, value_enum, default_value_t = Color::Auto)]
    pub color: Color,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// When output has colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Color {
    /// On a terminal.
    Auto,
    /// Everywhere.
    Always,
    /// Nowhere.
    Never,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Check shaders and report what is wrong with them.
    Check(crate::commands::check::CheckArguments),
    /// Show a shader on its way to machine code, or write it as a file.
    Build(crate::commands::build::BuildArguments),
    /// Run one method on values given here and print what it sets.
    Eval(crate::commands::eval::EvalArguments),
    /// Check what classes promise to renderers: is the density the sampler's, do bounds hold, is energy conserved?
    Test(crate::commands::test::TestArguments),
    /// Measure how long methods take per ray, for each shape and width.
    Bench(crate::commands::bench::BenchArguments),
    /// Render a scene to a picture.
    Render(crate::commands::render::RenderArguments),
    /// Show a scene in a window: fly through it, set parameters, edit its shaders.
    View(crate::commands::view::ViewArguments),
    /// Tell about this program and the machine, or about a class.
    Info(crate::commands::info::InfoArguments),
    /// Explain the code of an error or a warning.
    Explain(crate::commands::explain::ExplainArguments),
    /// Print the help of a command, or a part of the book.
    Help(crate::commands::help::HelpArguments),
}

/// Where included files are looked for.
#[derive(Clone, Debug, Default, Args)]
pub struct SearchPath {
    /// A folder in which `#include` looks after that of the including file; may be repeated.
    #[arg(short = 'I', long = "include", value_name = "FOLDER")]
    pub search_path: Vec<PathBuf>,
}

/// How files of scenes are read.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct InputArguments {
    /// The memory that the scene's files may take: texts, images, meshes. 4 GiB if not given, or what the machine has
    /// free if that is less.
    #[arg(long, value_name = "AMOUNT")]
    pub input_memory: Option<Amount>,
}

/// How code is made and run.
#[derive(Clone, Copy, Debug, Args)]
pub struct EngineArguments {
    /// What runs the code: machine code or the interpreter; `auto` takes machine code where there
    /// is an LLVM.
    #[arg(long, value_enum, default_value_t = BackendName::Auto)]
    pub backend: BackendName,
    /// Rays at a time; what suits the machine if not given. Never changes results.
    #[arg(long, value_parser = parse_width)]
    pub width: Option<u32>,
    #[command(flatten)]
    pub code: CodeArguments,
}

impl EngineArguments {
    /// As the embedding API says it.
    pub fn options(self) -> EngineOptions {
        EngineOptions { backend: self.backend.into(), width: self.width, ..self.code.options() }
    }
}

/// What code is like, whatever runs it.
#[derive(Clone, Copy, Debug, Args)]
pub struct CodeArguments {
    /// How many vectors full chunks of rays are done at a time: 1, 2 or 4; what suits each kernel
    /// if not given. Never changes results.
    #[arg(long, value_parser = parse_interleave)]
    interleave: Option<u32>,
    /// How exact arithmetic is.
    #[arg(long, value_enum, default_value_t = MathName::Contract)]
    pub math: MathName,
}

impl CodeArguments {
    /// As the embedding API says it.
    pub fn options(self) -> EngineOptions {
        EngineOptions {
            interleave: self.interleave,
            math: self.math.into(),
            ..EngineOptions::default()
        }
    }
}

/// What is known of the callers of kernels.
#[derive(Clone, Debug, Default, Args)]
pub struct VariantArguments {
    /// Take the members of an instance for constants: those of `--param`, else the defaults.
    #[arg(long)]
    pub specialise: bool,
    /// The state variables that the caller reads, with commas between; all that the method sets, and
    /// scratch, if not given.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = find_state)]
    pub reads: Option<Vec<&'static StateVariable>>,
}

impl VariantArguments {
    /// The variant for callers that read this, of instances with any members.
    pub fn reading(&self, shape: CallMode) -> Variant {
        let variant = Variant::new(shape);
        match &self.reads {
            Some(variables) => variant.reading(Outputs::state(variables.iter().copied())),
            None => variant,
        }
    }
}

/// A width that there are kernels for.
pub fn parse_width(text: &str) -> Result<u32, String> {
    let width = text.parse().ok().filter(|width| rtsl::Engine::WIDTHS.contains(width));
    width.ok_or_else(|| "the widths are 1, 4, 8 and 16".to_owned())
}

/// A shape by its name.
pub fn parse_shape(name: &str) -> Result<CallMode, String> {
    CallMode::from_name(name).ok_or_else(|| {
        let names: Vec<&str> = CallMode::ALL.iter().map(|shape| shape.name()).collect();
        format!("the shapes are {}", names.join(", "))
    })
}

fn parse_interleave(text: &str) -> Result<u32, String> {
    let factor = text.parse().ok().filter(|it| rtsl::Engine::INTERLEAVES.contains(it));
    factor.ok_or_else(|| "the numbers of vectors are 1, 2 and 4".to_owned())
}

/// The names of [`Backend`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    /// Machine code where there is an LLVM, else the interpreter.
    Auto,
    /// Machine code.
    Jit,
    /// The interpreter.
    Interp,
}

impl From<BackendName> for Backend {
    fn from(name: BackendName) -> Backend {
        match name {
            BackendName::Auto => Backend::Auto,
            BackendName::Jit => Backend::Jit,
            BackendName::Interp => Backend::Interpreter,
        }
    }
}

/// The names of [`Math`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MathName {
    /// `a * b + c` is rounded once where one rule says so; the same on every machine.
    Contract,
    /// Every operation is rounded.
    Strict,
    /// May reassociate and approximate; results may differ from machine to machine.
    Fast,
}

impl From<MathName> for Math {
    fn from(name: MathName) -> Math {
        match name {
            MathName::Contract => Math::Contract,
            MathName::Strict => Math::Strict,
            MathName::Fast => Math::Fast,
        }
    }
}
