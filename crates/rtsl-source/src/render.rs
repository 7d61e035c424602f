//! Diagnostics as text for people: rustc's manner, by `codespan-reporting`.

use codespan_reporting::diagnostic::{self as codespan, LabelStyle};
use codespan_reporting::files;
use codespan_reporting::term::{self, Config};

use crate::{Diagnostic, FileId, Severity, SourceMap};

/// The text for one diagnostic, with the lines of source it speaks of. `color` adds ANSI colours.
pub fn to_text(map: &SourceMap, diagnostic: &Diagnostic, color: bool) -> String {
    let shown = convert(map, diagnostic);
    let config = Config::default();
    let files = Files(map);
    let text = if color {
        let mut buffer = term::termcolor::Ansi::new(Vec::new());
        term::emit_to_write_style(&mut buffer, &config, &files, &shown)
            .map(|()| buffer.into_inner())
    } else {
        let mut buffer = term::termcolor::NoColor::new(Vec::new());
        term::emit_to_write_style(&mut buffer, &config, &files, &shown)
            .map(|()| buffer.into_inner())
    };
    match text {
        Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
        // Only a span outside its file brings us here; the message is worth more than its place.
        Err(_) => {
            format!("{}[{}]: {}\n", diagnostic.severity.name(), diagnostic.code, diagnostic.message)
        }
    }
}

/// The texts for all of them, one after the other.
pub fn all_to_text<'a>(
    map: &SourceMap,
    diagnostics: impl IntoIterator<Item = &'a Diagnostic>,
    color: bool,
) -> String {
    diagnostics.into_iter().map(|diagnostic| to_text(map, diagnostic, color)).collect()
}

fn convert(map: &SourceMap, diagnostic: &Diagnostic) -> codespan::Diagnostic<FileId> {
    let severity = match diagnostic.severity {
        Severity::Warning => codespan::Severity::Warning,
        Severity::Error => codespan::Severity::Error,
    };
    let label = |style, label: &crate::Label| {
        let text_length = map.file(label.span.file).text.len();
        let end = (label.span.end as usize).min(text_length);
        let start = (label.span.start as usize).min(end);
        codespan::Label::new(style, label.span.file, start..end).with_message(&label.message)
    };
    let primary = diagnostic.primary.iter().map(|primary| label(LabelStyle::Primary, primary));
    let others = diagnostic.labels.iter().map(|other| label(LabelStyle::Secondary, other));
    let notes = diagnostic.notes.iter().map(|note| format!("note: {note}"));
    let help = diagnostic.help.iter().map(|help| format!("help: {help}"));
    let suggestions = diagnostic.suggestions.iter().map(|suggestion| {
        if suggestion.replacement.is_empty() {
            format!("help: {}", suggestion.message)
        } else {
            format!("help: {}: `{}`", suggestion.message, suggestion.replacement)
        }
    });
    codespan::Diagnostic::new(severity)
        .with_code(diagnostic.code.as_str())
        .with_message(&diagnostic.message)
        .with_labels(primary.chain(others).collect())
        .with_notes(notes.chain(help).chain(suggestions).collect())
}

struct Files<'a>(&'a SourceMap);

impl<'a> files::Files<'a> for Files<'a> {
    type FileId = FileId;
    type Name = &'a str;
    type Source = &'a str;

    fn name(&'a self, id: FileId) -> Result<&'a str, files::Error> {
        Ok(&self.0.file(id).name)
    }

    fn source(&'a self, id: FileId) -> Result<&'a str, files::Error> {
        Ok(&self.0.file(id).text)
    }

    fn line_index(&'a self, id: FileId, byte_index: usize) -> Result<usize, files::Error> {
        Ok(self.0.position(id, byte_index as u32).line as usize - 1)
    }

    fn line_range(
        &'a self,
        id: FileId,
        line_index: usize,
    ) -> Result<std::ops::Range<usize>, files::Error> {
        self.0
            .line_range(id, line_index)
            .ok_or(files::Error::LineTooLarge { given: line_index, max: self.0.line_count(id) })
    }
}
