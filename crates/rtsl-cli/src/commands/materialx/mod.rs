//! `rtsl materialx`: materials of MaterialX documents as classes.

mod survey;

use std::path::{Path, PathBuf};

use clap::Args;
use rtsl::{Compiler, Diagnostic, SourceMap};
use rtsl_materialx::{Document, translate, translate_outputs};
use rtsl_memory::InputBudget;
use rtsl_scene::materialx::read_document;
use rtsl_scene::reader::DiskFiles;

use crate::files::write_result;
use crate::outcome::{CommandResult, Outcome};
use crate::report::Reporter;

/// The command line of `rtsl materialx`.
#[derive(Debug, Args)]
pub struct MaterialXArguments {
    /// The document; with `--check`, also a folder of documents.
    #[arg(value_name = "DOCUMENT")]
    document: PathBuf,
    /// The file for the classes; without it, they go to standard output.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// The material; without it, all of the document.
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// Translate the outputs of graphs to textures, instead of the materials.
    #[arg(long, conflicts_with = "material")]
    outputs: bool,
    /// Write nothing, but count the documents that can be translated, compiled and evaluated.
    #[arg(long, conflicts_with_all = ["output", "material", "outputs"])]
    check: bool,
    /// With `--check`: the result as JSON.
    #[arg(long, requires = "check")]
    json: bool,
}

/// Translates the document, checks the result, and writes it.
pub fn run(arguments: &MaterialXArguments, reporter: &Reporter) -> CommandResult {
    if arguments.check {
        return survey::run(&arguments.document, arguments.json);
    }
    let mut sources = SourceMap::new();
    let document = match read(&arguments.document, &mut sources) {
        Ok(document) => document,
        Err(diagnostic) => {
            reporter.diagnostics(&sources, [&*diagnostic]);
            return Ok(Outcome::InputAtFault);
        }
    };
    let title = title(&arguments.document);
    let translation = match arguments.outputs {
        true => translate_outputs(&document, &title),
        false => translate(&document, &title, arguments.material.as_deref()),
    };
    reporter.diagnostics(&sources, translation.warnings.iter().chain(&translation.errors));
    if !translation.errors.is_empty() {
        return Ok(Outcome::InputAtFault);
    }
    let text = translation.text();
    let compilation = Compiler::default().compile(&format!("{title}.rtsl"), &text);
    if compilation.diagnostics.has_errors() {
        reporter.compilation(&compilation);
        return Ok(Outcome::InputAtFault);
    }
    write_result(arguments.output.as_deref(), text.as_bytes())?;
    Ok(Outcome::Done)
}

fn read(path: &Path, sources: &mut SourceMap) -> Result<Document, Box<Diagnostic>> {
    read_document(path, None, &DiskFiles, &InputBudget::new(None), sources)
}

/// The name of a document in comments.
fn title(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
