//! Formats diagnostics as rustc does, with `codespan-reporting`. The output is short even for very
//! long lines and spans.

use std::collections::BTreeMap;

use codespan_reporting::diagnostic::{self as codespan, LabelStyle};
use codespan_reporting::files;
use codespan_reporting::term::{self, Config};

use crate::excerpt::Excerpt;
use crate::{Diagnostic, FileId, Label, Severity, SourceMap};

/// Formats one diagnostic with the source lines it refers to. `color` adds ANSI colours.
pub fn to_text(map: &SourceMap, diagnostic: &Diagnostic, color: bool) -> String {
    let files = Files::new(map, diagnostic);
    let shown = files.convert(diagnostic);
    let config = Config::default();
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
        // Only a span outside its file gets here. The message is printed without its span.
        Err(_) => {
            format!("{}[{}]: {}\n", diagnostic.severity.name(), diagnostic.code, diagnostic.message)
        }
    }
}

/// Formats all diagnostics, one after the other.
pub fn all_to_text<'a>(
    map: &SourceMap,
    diagnostics: impl IntoIterator<Item = &'a Diagnostic>,
    color: bool,
) -> String {
    diagnostics.into_iter().map(|diagnostic| to_text(map, diagnostic, color)).collect()
}

/// The excerpts that a diagnostic shows, as `codespan-reporting` reads them.
struct Files<'a> {
    map: &'a SourceMap,
    excerpts: BTreeMap<FileId, Excerpt>,
}

impl<'a> Files<'a> {
    fn new(map: &'a SourceMap, diagnostic: &Diagnostic) -> Self {
        let labels = diagnostic.primary.iter().chain(&diagnostic.labels);
        let mut excerpts = BTreeMap::new();
        for label in labels.clone() {
            let file = label.span.file;
            excerpts.entry(file).or_insert_with(|| Excerpt::new(map, file, labels.clone()));
        }
        Files { map, excerpts }
    }

    fn convert(&self, diagnostic: &Diagnostic) -> codespan::Diagnostic<FileId> {
        let severity = match diagnostic.severity {
            Severity::Warning => codespan::Severity::Warning,
            Severity::Error => codespan::Severity::Error,
        };
        let label = |style, label: &Label| {
            let file = label.span.file;
            let place = self.excerpts[&file].place(self.map, label.span);
            codespan::Label::new(style, file, place).with_message(&label.message)
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

    fn excerpt(&self, id: FileId) -> Result<&Excerpt, files::Error> {
        self.excerpts.get(&id).ok_or(files::Error::FileMissing)
    }
}

impl<'a> files::Files<'a> for Files<'_> {
    type FileId = FileId;
    type Name = &'a str;
    type Source = &'a str;

    fn name(&'a self, id: FileId) -> Result<&'a str, files::Error> {
        Ok(&self.map.file(id).name)
    }

    fn source(&'a self, id: FileId) -> Result<&'a str, files::Error> {
        Ok(&self.excerpt(id)?.text)
    }

    fn line_index(&'a self, id: FileId, byte_index: usize) -> Result<usize, files::Error> {
        Ok(self.excerpt(id)?.line_of(byte_index))
    }

    fn column_number(
        &'a self,
        id: FileId,
        line_index: usize,
        byte_index: usize,
    ) -> Result<usize, files::Error> {
        let original = self.excerpt(id)?.original(line_index, byte_index).unwrap_or(0);
        Ok(self.map.position(id, original as u32).column as usize)
    }

    fn line_range(
        &'a self,
        id: FileId,
        line_index: usize,
    ) -> Result<std::ops::Range<usize>, files::Error> {
        let max = self.map.line_count(id);
        let missing = files::Error::LineTooLarge { given: line_index, max };
        self.excerpt(id)?.line_range(line_index).ok_or(missing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Span, diagnostic_codes as codes};
    use expect_test::expect;

    fn show(text: &str, start: usize, end: usize) -> String {
        let mut map = SourceMap::new();
        let file = map.add("test.rtsl", text);
        let span = Span::new(file, start as u32, end as u32);
        let diagnostic = Diagnostic::new(codes::UNEXPECTED_TOKEN, "message").at(span, "label");
        to_text(&map, &diagnostic, false)
    }

    #[test]
    fn a_long_line_is_shortened() {
        let text = format!("{}here{}\nnext", "a".repeat(1 << 21), "b".repeat(1 << 21));
        let shown = show(&text, 1 << 21, (1 << 21) + 4);
        assert!(shown.len() < 1000);
        assert!(shown.contains("test.rtsl:1:2097153"), "{shown}");
        assert!(shown.contains("aahereb"), "{shown}");
        let whole = show(&text, 0, text.len());
        assert!(whole.len() < 2000, "{}", whole.len());
    }

    #[test]
    fn a_long_span_is_shortened() {
        let text = "line\n".repeat(100_000);
        expect![[r#"
            error[E0101]: message
              ┌─ test.rtsl:3:1
              │
            3 │ line
              │ ^^^^ label

        "#]]
        .assert_eq(&show(&text, 10, text.len()));
    }

    #[test]
    fn spans_at_and_past_the_end_are_shown() {
        expect![[r#"
            error[E0101]: message
              ┌─ test.rtsl:1:4
              │
            1 │ abc
              │    ^ label

        "#]]
        .assert_eq(&show("abc", 3, 3));
        assert_eq!(show("abc", 3, 3), show("abc", 7, 9));
        show("", 0, 0);
        show("\n", 1, 1);
        show("é", 1, 2);
    }
}
