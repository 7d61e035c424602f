//! `rtsl check`: reports the errors and warnings of shaders.

use std::path::PathBuf;

use clap::Args;
use rtsl::{Compilation, Severity};

use super::shader::compiler;
use crate::arguments::SearchPath;
use crate::files::write_result;
use crate::outcome::{CommandResult, Outcome};
use crate::report::{JsonDiagnostic, Reporter};

/// The command line of `rtsl check`.
#[derive(Debug, Args)]
pub struct CheckArguments {
    /// The files to check.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Print one JSON object per line for each diagnostic to standard output: code, severity, message, file, line,
    /// column, endLine, endColumn, notes, help.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    search_path: SearchPath,
}

/// Checks all files and reports the number of errors and warnings.
pub fn run(arguments: &CheckArguments, reporter: &Reporter) -> CommandResult {
    let compiler = compiler(&arguments.search_path);
    let (mut errors, mut warnings) = (0, 0);
    for file in &arguments.files {
        let compilation = compiler.compile_file(file);
        for diagnostic in compilation.diagnostics.iter() {
            match diagnostic.severity {
                Severity::Error => errors += 1,
                Severity::Warning => warnings += 1,
            }
        }
        errors += compilation.diagnostics.dropped();
        if arguments.json {
            write_result(None, json_lines(&compilation).as_bytes())?;
        } else {
            reporter.compilation(&compilation);
        }
    }
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

fn json_lines(compilation: &Compilation) -> String {
    let lines = compilation.diagnostics.iter().map(|diagnostic| {
        let diagnostic = JsonDiagnostic::new(&compilation.sources, diagnostic);
        serde_json::to_string(&diagnostic).unwrap_or_default() + "\n"
    });
    lines.collect()
}

fn counted(count: usize, name: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {name}{plural}")
}
