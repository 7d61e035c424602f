//! `rtsl info`: information on this program and the machine, or on a class.

use std::path::{Path, PathBuf};

use clap::Args;
use rtsl::{
    AnnotationValue, Class, ClassOutline, CodeCache, Compiler, Engine, EngineOptions, FileLoader,
    Llvm, Parameter, ParameterType, Scalar, default_value, library, type_name,
};
use rtsl_image::Denoiser;

use super::shader::{compile_file, compiler_of, is_file_name};
use crate::arguments::SearchPath;
use crate::files::write_result;
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// Default values with more numbers than a matrix are not shown.
const SHOWN_NUMBERS: usize = 16;

/// The command line of `rtsl info`.
#[derive(Debug, Args)]
pub struct InfoArguments {
    /// A class of the standard library, or a file: shows the roles and parameters of its classes. Without one, the
    /// program's version, the LLVM in use and the machine.
    #[arg(value_name = "CLASS|FILE")]
    subject: Option<String>,
    /// Print the source text of the class, or of the classes of the file, with its path.
    #[arg(long, requires = "subject")]
    source: bool,
    #[command(flatten)]
    search_path: SearchPath,
}

/// Prints the information.
pub fn run(arguments: &InfoArguments, reporter: &Reporter) -> CommandResult {
    let text = match &arguments.subject {
        None => about_program(&arguments.search_path.folders()),
        Some(subject) => {
            let path = Path::new(subject);
            let compiler = compiler_of(path, &arguments.search_path, reporter)?;
            if arguments.source {
                let text = source_of(&compiler, path)?;
                write_result(None, text.as_bytes())?;
                return Ok(Outcome::Done);
            }
            if is_file_name(path) {
                match compile_file(&compiler, path, reporter) {
                    Some(unit) => unit.classes().iter().map(|class| about_class(class)).collect(),
                    None => return Ok(Outcome::InputAtFault),
                }
            } else {
                about_library_class(&compiler, subject)?
            }
        }
    };
    write_result(None, text.as_bytes())?;
    Ok(Outcome::Done)
}

fn about_program(search_path: &[PathBuf]) -> String {
    let mut text = format!("rtsl {}\n", env!("CARGO_PKG_VERSION"));
    match Llvm::load() {
        Ok(llvm) => {
            text += &format!("LLVM          {}\n", llvm.version());
            text += &format!("  library     {}\n", llvm.path().display());
            text += &format!("  processor   {}\n", llvm.host().cpu());
            text += &format!("  target      {}\n", llvm.host().triple());
            text += &format!("  features    {}\n", present_features(llvm.host().features()));
        }
        Err(error) => text += &format!("LLVM          none: {error}\n"),
    }
    if let Ok((engine, _)) = Engine::new(EngineOptions::default()) {
        text += &format!("width         {}\n", engine.width());
    }
    text += &about_cache();
    text += &about_denoiser();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    text += &format!("threads       {threads}\n");
    text += &format!("library       {} shaders, built in\n", library::files().len());
    let folders: Vec<String> =
        search_path.iter().map(|folder| folder.display().to_string()).collect();
    let folders = if folders.is_empty() { "none".to_owned() } else { folders.join(" ") };
    text + &format!("search path   {folders}\n")
}

/// The text of a class of the standard library, or of the classes of a file, after lines with their paths.
fn source_of(compiler: &Compiler, source: &Path) -> Result<String, Failure> {
    if !is_file_name(source) {
        let name = source.to_string_lossy();
        if let Some(file) = library::file_of_class(&name) {
            let outline = compiler.outline(file.path, file.text, &mut FileLoader::default());
            if let Some(class) = outline.class(&name) {
                return Ok(shown_source(class));
            }
        }
        return Err(library::unit_of_class(compiler, &name)
            .err()
            .map_or(Failure::Reported, Failure::from));
    }
    let outline = compiler.outline_file(source)?;
    if outline.classes.is_empty() {
        return Err(Failure::Usage(format!("`{}` has no class", source.display())));
    }
    let texts: Vec<String> = outline.classes.iter().map(shown_source).collect();
    Ok(texts.join("\n"))
}

fn shown_source(class: &ClassOutline) -> String {
    format!("// {}:{}\n{}\n", class.file, class.line, class.text)
}

/// Describes the folder of machine code, without creating it.
fn about_cache() -> String {
    let Some(folder) = CodeCache::folder_of_user() else {
        return "cache         none\n".to_owned();
    };
    let shown = format!("cache         {}", folder.display());
    if !folder.exists() {
        return format!("{shown}, empty\n");
    }
    match CodeCache::open(&folder) {
        Ok(cache) => {
            let size = cache.size();
            let megabytes = size.bytes as f64 / 1e6;
            format!("{shown}, {} modules, {megabytes:.1} MB\n", size.modules)
        }
        Err(error) => format!("{shown}, not used: {error}\n"),
    }
}

/// Describes the denoiser that `--denoise` uses.
fn about_denoiser() -> String {
    match Denoiser::load() {
        Ok(denoiser) => {
            let (major, minor) = denoiser.version();
            let path = denoiser.path().display();
            format!("denoiser      Open Image Denoise {major}.{minor}\n  library     {path}\n")
        }
        Err(error) => format!("denoiser      none: {error}\n"),
    }
}

/// The features of the machine in LLVM's list.
fn present_features(features: &str) -> String {
    let present = features.split(',').filter_map(|feature| feature.strip_prefix('+'));
    present.collect::<Vec<_>>().join(" ")
}

fn about_library_class(compiler: &Compiler, name: &str) -> Result<String, Failure> {
    let unit = library::unit_of_class(compiler, name)?;
    Ok(about_class(unit.class(name)?))
}

/// The default value of a parameter in the syntax of scenes; `None` for references, buffers, structs and tables.
fn shown_default(class: &Class, parameter: &Parameter) -> Option<String> {
    let scalar = scalar_of(&parameter.ty)?;
    let words = default_value(class, parameter).filter(|words| words.len() <= SHOWN_NUMBERS)?;
    let choices = parameter.choices();
    let shown = words.iter().map(|word| match scalar {
        Scalar::I32 if let Some(name) = name_of_choice(&choices, *word) => format!("\"{name}\""),
        Scalar::F32 => format!("{:?}", f32::from_bits(*word)),
        Scalar::I32 => word.cast_signed().to_string(),
        Scalar::U32 => word.to_string(),
        Scalar::Bool => (*word != 0).to_string(),
    });
    let shown = shown.collect::<Vec<_>>().join(" ");
    Some(if words.len() == 1 { shown } else { format!("[{shown}]") })
}

/// The name of the choice that has the value.
fn name_of_choice<'c>(choices: &[(&'c str, i32)], word: u32) -> Option<&'c str> {
    choices.iter().find(|(_, value)| *value == word.cast_signed()).map(|(name, _)| *name)
}

/// The scalar type of which values of the type consist.
fn scalar_of(ty: &ParameterType) -> Option<Scalar> {
    match ty {
        ParameterType::Scalar(scalar) | ParameterType::Vector(scalar, _) => Some(*scalar),
        ParameterType::Matrix(..) | ParameterType::Color => Some(Scalar::F32),
        ParameterType::Array(element, _) => scalar_of(element),
        ParameterType::Textured(value) => scalar_of(value),
        ParameterType::Buffer(_) | ParameterType::Struct(..) | ParameterType::Reference(_) => None,
    }
}

fn about_class(class: &Class) -> String {
    let roles: Vec<&str> = class.roles.iter().map(|role| role.name()).collect();
    let mut text = format!("{}: {}\n", class.name, roles.join(", "));
    for line in class.documentation.iter().flat_map(|documentation| documentation.lines()) {
        text += &format!("  {line}\n");
    }
    let methods: Vec<&str> = class.methods.keys().map(|method| method.name()).collect();
    text += &format!("methods: {}\n", methods.join(", "));
    if !class.parameters.is_empty() {
        text += "parameters:\n";
    }
    for parameter in &class.parameters {
        text += &about_parameter(class, parameter);
    }
    text + "\n"
}

fn about_parameter(class: &Class, parameter: &Parameter) -> String {
    let mut text = format!("  {} {}", type_name(&parameter.ty), parameter.name);
    if parameter.required {
        text += ", required";
    } else if let Some(default) = shown_default(class, parameter) {
        text += &format!(" = {default}");
    }
    for annotation in &parameter.annotations {
        match &annotation.value {
            AnnotationValue::None => text += &format!("; {}", annotation.key),
            AnnotationValue::Text(value) => text += &format!("; {} {value:?}", annotation.key),
            AnnotationValue::Constant(value) => text += &format!("; {} {value}", annotation.key),
        }
    }
    text + "\n"
}
