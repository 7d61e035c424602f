//! `rtsl check`: reports the errors and warnings of shaders and scenes.

use std::path::{Path, PathBuf};

use clap::Args;
use rtsl::{Compilation, Diagnostic, Messages, Severity, SourceMap};
use rtsl_scene::gltf::is_gltf;
use rtsl_scene::is_mesh_file;
use rtsl_scene::reader::DiskFiles;
use rtsl_scene::{LoadOptions, load_scene};

use super::deferral;
use super::render::report;
use super::shader::{compiler, traced_compiler};
use crate::arguments::SearchPath;
use crate::files::write_result;
use crate::outcome::{CommandResult, Outcome};
use crate::project_file::ProjectFile;
use crate::report::{JsonDiagnostic, Reporter};

/// The command line of `rtsl check`.
#[derive(Debug, Args)]
pub struct CheckArguments {
    /// The files to check: shaders, or scenes, whose names end with `.pbrt`, `.gltf` or `.glb`, and
    /// meshes (`.ply`, `.obj`, `.stl`).
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print one JSON object per line for each diagnostic to standard output: code, severity, message, file, line,
    /// column, endLine, endColumn, notes, help.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    search_path: SearchPath,
}

/// The numbers of errors and warnings.
#[derive(Default)]
struct Counts {
    errors: usize,
    warnings: usize,
}

impl Counts {
    fn count<'d>(&mut self, diagnostics: impl Iterator<Item = &'d Diagnostic>) {
        for diagnostic in diagnostics {
            match diagnostic.severity {
                Severity::Error => self.errors += 1,
                Severity::Warning => self.warnings += 1,
            }
        }
    }
}

/// Checks all files and reports the number of errors and warnings.
pub fn run(arguments: &CheckArguments, reporter: &Reporter) -> CommandResult {
    let mut counts = Counts::default();
    for file in &arguments.files {
        let project = ProjectFile::beside(file, &arguments.search_path.folders());
        counts.count(project.diagnostics.iter());
        match arguments.json {
            true => {
                let lines = project.diagnostics.iter().map(|it| (&project.sources, it));
                write_result(None, json_lines(lines).as_bytes())?;
            }
            false => reporter.diagnostics(&project.sources, project.diagnostics.iter()),
        }
        let search_path = &arguments.search_path.with(project);
        if is_scene(file) {
            let messages = messages_of_scene(file, search_path);
            counts.count(messages.iter().map(|(_, diagnostic)| diagnostic));
            match arguments.json {
                true => write_result(None, json_lines(messages.iter()).as_bytes())?,
                false => report(&messages, reporter),
            }
            continue;
        }
        let compilation = compiler(search_path).compile_file(file);
        counts.count(compilation.diagnostics.iter());
        counts.errors += compilation.diagnostics.dropped();
        match arguments.json {
            true => write_result(None, json_of(&compilation).as_bytes())?,
            false => reporter.compilation(&compilation),
        }
        if reporter.is_verbose() && compilation.unit.is_some() {
            let unit = traced_compiler(search_path).compile_file(file).unit;
            let classes = unit.iter().flat_map(|unit| unit.classes());
            classes.for_each(|class| deferral::report(class, reporter));
        }
    }
    let Counts { errors, warnings } = counts;
    if !arguments.json && errors + warnings > 0 {
        let files = counted(arguments.files.len(), "file");
        let counts = [(errors, "error"), (warnings, "warning")];
        let counts: Vec<String> = counts
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, name)| counted(count, name))
            .collect();
        let kind = if errors > 0 { "error" } else { "warning" };
        reporter.message(kind, &format!("{} in {files}", counts.join(" and ")));
    }
    Ok(if errors > 0 { Outcome::InputAtFault } else { Outcome::Done })
}

/// True for the names of scenes, compressed ones too.
pub fn is_scene(file: &Path) -> bool {
    let name = file.to_string_lossy().to_ascii_lowercase();
    is_gltf(file) || is_mesh_file(file) || name.ends_with(".pbrt") || name.ends_with(".pbrt.gz")
}

/// The messages of a scene and of its shaders, which are loaded and not rendered.
fn messages_of_scene(file: &Path, search_path: &SearchPath) -> Messages {
    let options = LoadOptions { search_path: search_path.folders(), ..LoadOptions::default() };
    match load_scene(file, &DiskFiles, &options) {
        Ok(loaded) => loaded.warnings,
        Err(messages) => messages,
    }
}

fn json_of(compilation: &Compilation) -> String {
    json_lines(compilation.diagnostics.iter().map(|it| (&compilation.sources, it)))
}

fn json_lines<'d>(diagnostics: impl Iterator<Item = (&'d SourceMap, &'d Diagnostic)>) -> String {
    let line = |(sources, diagnostic)| {
        let diagnostic = JsonDiagnostic::new(sources, diagnostic);
        serde_json::to_string(&diagnostic).unwrap_or_default() + "\n"
    };
    diagnostics.map(line).collect()
}

fn counted(count: usize, name: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {name}{plural}")
}
