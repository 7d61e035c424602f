//! Output of diagnostics, as text and as JSON.

use std::io::IsTerminal;

use rtsl::{Compilation, Diagnostic, SourceMap, render};
use serde::Serialize;

use crate::arguments::Color;

/// Writes diagnostics to standard error.
#[derive(Clone, Copy, Debug)]
pub struct Reporter {
    color: bool,
    /// True if lines of stages go to standard error.
    is_verbose: bool,
}

impl Reporter {
    /// Creates a reporter according to `--color`, `--verbose` and the environment.
    pub fn new(color: Color, is_verbose: bool) -> Reporter {
        let color = match color {
            Color::Always => true,
            Color::Never => false,
            Color::Auto => {
                let forbidden = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
                let is_dumb = std::env::var_os("TERM").is_some_and(|value| value == "dumb");
                !forbidden && !is_dumb && std::io::stderr().is_terminal()
            }
        };
        Reporter { color, is_verbose }
    }

    /// True with `--verbose`.
    pub fn is_verbose(self) -> bool {
        self.is_verbose
    }

    /// True if standard error supports a progress bar and shows nothing that would tear it.
    pub fn shows_progress(self) -> bool {
        !self.is_verbose && std::io::stderr().is_terminal()
    }

    /// Writes all diagnostics of a compilation.
    pub fn compilation(self, compilation: &Compilation) {
        eprint!("{}", compilation.report(self.color));
        let dropped = compilation.diagnostics.dropped();
        if dropped > 0 {
            self.message("note", &format!("{dropped} further diagnostics are not shown"));
        }
    }

    /// Writes diagnostics whose spans refer to `sources`.
    pub fn diagnostics<'a>(
        self,
        sources: &SourceMap,
        diagnostics: impl IntoIterator<Item = &'a Diagnostic>,
    ) {
        eprint!("{}", render::all_to_text(sources, diagnostics, self.color));
    }

    /// Writes a diagnostic without a position.
    pub fn diagnostic(self, diagnostic: &Diagnostic) {
        self.diagnostics(&SourceMap::new(), [diagnostic]);
    }

    /// Writes a message that is not a diagnostic: of the command line, of progress.
    pub fn message(self, kind: &str, message: &str) {
        if self.color {
            eprintln!("\u{1b}[1m{kind}\u{1b}[0m: {message}");
        } else {
            eprintln!("{kind}: {message}");
        }
    }
}

/// A diagnostic as JSON.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct JsonDiagnostic {
    code: &'static str,
    severity: &'static str,
    message: String,
    file: Option<String>,
    line: Option<u32>,
    column: Option<u32>,
    end_line: Option<u32>,
    end_column: Option<u32>,
    notes: Vec<String>,
    help: Vec<String>,
}

impl JsonDiagnostic {
    /// Converts `diagnostic`, whose spans refer to `sources`.
    pub fn new(sources: &SourceMap, diagnostic: &Diagnostic) -> JsonDiagnostic {
        let span = diagnostic.primary.as_ref().map(|label| label.span);
        let start = span.map(|span| sources.position(span.file, span.start));
        let end = span.map(|span| sources.position(span.file, span.end));
        let suggestions = diagnostic.suggestions.iter().map(|suggestion| {
            if suggestion.replacement.is_empty() {
                suggestion.message.clone()
            } else {
                format!("{}: `{}`", suggestion.message, suggestion.replacement)
            }
        });
        JsonDiagnostic {
            code: diagnostic.code.as_str(),
            severity: diagnostic.severity.name(),
            message: diagnostic.message.clone(),
            file: span.map(|span| sources.file(span.file).name.clone()),
            line: start.map(|position| position.line),
            column: start.map(|position| position.column),
            end_line: end.map(|position| position.line),
            end_column: end.map(|position| position.column),
            notes: diagnostic.notes.clone(),
            help: diagnostic.help.iter().cloned().chain(suggestions).collect(),
        }
    }
}
