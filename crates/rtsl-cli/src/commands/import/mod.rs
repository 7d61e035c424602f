//! `rtsl import`: programs of other languages as classes.

mod shadertoy;
mod words;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use rtsl::{Compiler, Diagnostic, SourceMap};

use crate::files::{read_text, write_result};
use crate::outcome::{CommandResult, Failure, Outcome};
use crate::report::Reporter;

/// The greatest size of a program in bytes.
const GREATEST_PROGRAM: u64 = 1 << 22;

/// The command line of `rtsl import`.
#[derive(Debug, Args)]
pub struct ImportArguments {
    /// The program of Shadertoy: the text of one pass, with `mainImage`.
    #[arg(value_name = "PROGRAM")]
    program: PathBuf,
    /// The file for the class; without it, the class goes to standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// The role of the class.
    #[arg(long = "as", value_enum, default_value_t = Form::Texture)]
    form: Form,
    /// The name of the class; without it, that of the file.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
}

/// The role that a program gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Form {
    /// A texture: the program's colour at each place
    Texture,
    /// A matte material of this colour
    Material,
    /// A material that emits this colour
    Emission,
}

/// Translates the program, checks the result, and writes it.
pub fn run(arguments: &ImportArguments, reporter: &Reporter) -> CommandResult {
    let path = &arguments.program;
    let text = read_text(path, GREATEST_PROGRAM)?;
    let name = arguments.name.clone().unwrap_or_else(|| class_name(path));
    if !is_name(&name) {
        return Err(Failure::Usage(format!("`{name}` is no name of a class")));
    }
    let mut sources = SourceMap::new();
    let file = sources.add(path.display().to_string(), text.clone());
    let problem = |diagnostic: Diagnostic| {
        reporter.diagnostics(&sources, [&diagnostic]);
        Ok(Outcome::InputAtFault)
    };
    let imported = match shadertoy::import(&text, file, &name, arguments.form) {
        Ok(imported) => imported,
        Err(diagnostic) => return problem(*diagnostic),
    };
    let compilation = Compiler::default().compile(&format!("{name}.rtsl"), &imported.text);
    let errors: Vec<Diagnostic> = (compilation.diagnostics.iter())
        .filter(|diagnostic| diagnostic.is_error())
        .map(|diagnostic| imported.place(diagnostic))
        .collect();
    if !errors.is_empty() {
        reporter.diagnostics(&sources, &errors);
        return Ok(Outcome::InputAtFault);
    }
    write_result(arguments.output.as_deref(), imported.text.as_bytes())?;
    Ok(Outcome::Done)
}

fn is_name(text: &str) -> bool {
    text.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        && text.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
}

/// The name of a file as that of a class: `warped-noise.glsl` gives `WarpedNoise`.
fn class_name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let words = stem.split(|letter: char| !letter.is_ascii_alphanumeric());
    let name: String = words
        .filter_map(|word| {
            let first = word.chars().next()?;
            Some(format!("{}{}", first.to_ascii_uppercase(), &word[first.len_utf8()..]))
        })
        .collect();
    match name.chars().next() {
        Some(first) if first.is_ascii_alphabetic() => name,
        _ => format!("Imported{name}"),
    }
}
