//! Arguments that several commands have.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use rtsl::{Backend, CallMode, EngineOptions, Math, Outputs, StateVariable, Variant};
use rtsl_memory::Amount;
use rtsl_scene::LoadOptions;

use crate::names::find_state;
use crate::outcome::Failure;
use crate::project_file::ProjectFile;
use crate::report::Reporter;

/// The use of colours in output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Color {
    /// On a terminal.
    Auto,
    /// Everywhere.
    Always,
    /// Nowhere.
    Never,
}

/// The folders of included files.
#[derive(Clone, Debug, Default, Args)]
pub struct SearchPath {
    /// A folder in which `#include` and `import` look after that of the including file; may be repeated. Those of
    /// the file `rtsl.toml` beside the shader or scene follow, and those of the environment variable RTSL_PATH.
    #[arg(short = 'I', long = "include", value_name = "FOLDER")]
    search_path: Vec<PathBuf>,
}

impl SearchPath {
    /// Creates a search path of these folders.
    pub fn of(search_path: Vec<PathBuf>) -> SearchPath {
        SearchPath { search_path }
    }

    /// Returns the search path of a file, with the folders that the project file beside it names. Faults of that are
    /// reported.
    ///
    /// # Errors
    /// If the project file is wrong.
    pub fn beside(&self, file: &Path, reporter: &Reporter) -> Result<SearchPath, Failure> {
        let project = ProjectFile::beside(file, &self.folders());
        reporter.diagnostics(&project.sources, project.diagnostics.iter());
        if project.diagnostics.has_errors() {
            return Err(Failure::Reported);
        }
        Ok(self.with(project))
    }

    /// Returns the search path with the folders of a project file.
    pub fn with(&self, project: ProjectFile) -> SearchPath {
        let folders = self.search_path.iter().cloned();
        SearchPath { search_path: folders.chain(project.search_path).collect() }
    }

    /// Returns the folders, with those of the environment.
    pub fn folders(&self) -> Vec<PathBuf> {
        let of_environment = std::env::var_os(SEARCH_PATH_VARIABLE).unwrap_or_default();
        let of_environment = std::env::split_paths(&of_environment);
        let of_environment = of_environment.filter(|folder| !folder.as_os_str().is_empty());
        self.search_path.iter().cloned().chain(of_environment).collect()
    }
}

/// The environment variable with folders, which the system's separator divides.
const SEARCH_PATH_VARIABLE: &str = "RTSL_PATH";

/// Limits of reading a scene's files.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct InputArguments {
    /// The memory for the scene's files: texts, images, meshes. Three quarters of the free memory if not given.
    #[arg(long, value_name = "AMOUNT")]
    pub input_memory: Option<Amount>,
    /// The memory for textures from images; an eighth of that for all files if not given. Further images are in temporary
    /// files, in the folder `TMPDIR` or `/var/tmp`.
    #[arg(long, value_name = "AMOUNT")]
    pub texture_memory: Option<Amount>,
}

impl InputArguments {
    /// Returns the options of reading a scene within these limits.
    pub fn options(self) -> LoadOptions {
        let InputArguments { input_memory, texture_memory } = self;
        LoadOptions { input_memory, texture_memory, ..LoadOptions::default() }
    }
}

/// The arguments of reading a scene.
#[derive(Clone, Debug, Args)]
pub struct LoadArguments {
    /// The camera of a glTF file, by its name or index; its first one if not given.
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Light the scene by a studio, besides its own lights: that of glTF files without lights.
    #[arg(long)]
    pub studio: bool,
    /// The integrator, overriding the scene's: a class written in RTSL such as `Normals`, or a name of the pbrt format.
    /// It takes over the parameters of the scene's that it has, too; `-D integrator.NAME=VALUE` sets others.
    #[arg(long, value_name = "NAME")]
    pub integrator: Option<String>,
    /// Set a parameter of the scene: `camera.fov=30`, `lamp.intensity=10,9,8`; may be repeated.
    #[arg(short = 'D', long = "define", value_name = "NAME.PARAMETER=VALUE")]
    pub defines: Vec<String>,
    #[command(flatten)]
    pub search_path: SearchPath,
    #[command(flatten)]
    pub input: InputArguments,
}

impl LoadArguments {
    /// Returns the options of reading the scene, with a search path that has the folders of its project file.
    pub fn options(&self, search_path: &SearchPath) -> LoadOptions {
        LoadOptions {
            defines: self.defines.clone(),
            search_path: search_path.folders(),
            camera: self.camera.clone(),
            studio: self.studio,
            integrator: self.integrator.clone(),
            ..self.input.options()
        }
    }
}

/// The selection of an engine.
#[derive(Clone, Copy, Debug, Args)]
pub struct EngineArguments {
    /// The backend: machine code or the interpreter; `auto` selects machine code if an LLVM is found.
    #[arg(long, value_enum, default_value_t = BackendName::Auto)]
    pub backend: BackendName,
    /// The SIMD width in rays; selected for the machine if not given. Never changes results.
    #[arg(long, value_parser = parse_width)]
    pub width: Option<u32>,
    #[command(flatten)]
    pub code: CodeArguments,
}

impl EngineArguments {
    /// Returns the options for the embedding API.
    pub fn options(self) -> EngineOptions {
        EngineOptions { backend: self.backend.into(), width: self.width, ..self.code.options() }
    }
}

/// Options of compiling that do not depend on the backend.
#[derive(Clone, Copy, Debug, Args)]
pub struct CodeArguments {
    /// The number of SIMD vectors that full packets process at a time: 1, 2 or 4; selected for each kernel if not
    /// given. Never changes results.
    #[arg(long, value_parser = parse_interleave)]
    interleave: Option<u32>,
    /// The accuracy of arithmetic.
    #[arg(long, value_enum, default_value_t = MathName::Contract)]
    pub math: MathName,
}

impl CodeArguments {
    /// Returns the options for the embedding API.
    pub fn options(self) -> EngineOptions {
        EngineOptions {
            interleave: self.interleave,
            math: self.math.into(),
            ..EngineOptions::default()
        }
    }
}

/// Properties of a kernel's calls that are known when it is compiled.
#[derive(Clone, Debug, Default, Args)]
pub struct VariantArguments {
    /// Treat the members of an instance as constants: those of `--param`, or the defaults.
    #[arg(long)]
    pub specialise: bool,
    /// The state variables that the caller reads, separated by commas; all outputs of the method, and scratch, if not
    /// given.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = find_state)]
    pub reads: Option<Vec<&'static StateVariable>>,
}

impl VariantArguments {
    /// Returns the variant for callers that read these outputs, with instances of any members.
    pub fn reading(&self, mode: CallMode) -> Variant {
        let variant = Variant::new(mode);
        match &self.reads {
            Some(variables) => variant.reading(Outputs::state(variables.iter().copied())),
            None => variant,
        }
    }
}

/// Parses a width that kernels support.
pub fn parse_width(text: &str) -> Result<u32, String> {
    let width = text.parse().ok().filter(|width| rtsl::Engine::WIDTHS.contains(width));
    width.ok_or_else(|| "the widths are 1, 4, 8 and 16".to_owned())
}

/// Parses the name of a call mode.
pub fn parse_call_mode(name: &str) -> Result<CallMode, String> {
    CallMode::from_name(name).ok_or_else(|| {
        let names: Vec<&str> = CallMode::ALL.iter().map(|mode| mode.name()).collect();
        format!("the call modes are {}", names.join(", "))
    })
}

fn parse_interleave(text: &str) -> Result<u32, String> {
    let factor = text.parse().ok().filter(|it| rtsl::Engine::INTERLEAVES.contains(it));
    factor.ok_or_else(|| "the numbers of vectors are 1, 2 and 4".to_owned())
}

/// The names of [`Backend`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    /// Machine code if an LLVM is found, else the interpreter.
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
    /// `a * b + c` is rounded once, by a rule that is the same on every machine.
    Contract,
    /// Every operation is rounded.
    Strict,
    /// May reassociate and approximate; results may differ between machines.
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
