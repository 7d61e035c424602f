//! The looks at running shaders, as hints and diagnostics.

use lsp_types::{
    Diagnostic, DiagnosticRelatedInformation, DiagnosticSeverity, InlayHint, InlayHintLabel,
    InlayHintTooltip, Location, MarkupContent, MarkupKind, NumberOrString, Position, Range, Uri,
};

use crate::look::{Fault, FaultCall, Looks, PlacedNote, path_of_name};
use crate::place::{Lines, path_of, uri_of};
use crate::workspace::{Workspace, small_text, without_links};

/// Returns the notes at the ends of the lines of an open text.
pub fn notes(workspace: &Workspace, looks: &Looks, uri: &Uri) -> Vec<InlayHint> {
    let (Some(path), Some(text)) = (path_of(uri), workspace.text(uri)) else { return Vec::new() };
    let lines = Lines::new(text, workspace.encoding);
    let notes = looks.notes(&path, text).into_iter().map(|PlacedNote { line, note }| InlayHint {
        position: lines.position(line_end(text, &lines, line)),
        label: InlayHintLabel::String(note.label.clone()),
        kind: None,
        text_edits: None,
        tooltip: Some(InlayHintTooltip::MarkupContent(MarkupContent {
            kind: MarkupKind::PlainText,
            value: note.tooltip.clone(),
        })),
        padding_left: Some(true),
        padding_right: None,
        data: None,
    });
    notes.collect()
}

/// Returns the faults of a text, open or not.
pub fn faults(workspace: &Workspace, looks: &Looks, uri: &Uri) -> Vec<Diagnostic> {
    let Some(path) = path_of(uri) else { return Vec::new() };
    let read = || small_text(&path);
    let Some(text) = workspace.text(uri).map(str::to_owned).or_else(read) else {
        return Vec::new();
    };
    let lines = Lines::new(&text, workspace.encoding);
    let faults = looks.faults(&path, &text).into_iter().map(|PlacedNote { line, note }| {
        let Fault { start, end, .. } = note;
        let last = line + end.0 - start.0;
        let (first, last) =
            (offset(&text, &lines, line, start.1), offset(&text, &lines, last, end.1));
        let calls = note.calls.iter().filter_map(|call| related(workspace, looks, call));
        let calls: Vec<DiagnosticRelatedInformation> = calls.collect();
        Diagnostic {
            range: lines.range(first, last),
            severity: Some(DiagnosticSeverity::WARNING),
            code: Some(NumberOrString::String(note.code.clone())),
            source: Some("rtsl".to_owned()),
            message: note.message.clone(),
            related_information: (!calls.is_empty()).then_some(calls),
            ..Diagnostic::default()
        }
    });
    faults.collect()
}

/// The line of a caller, unless it has changed.
fn related(
    workspace: &Workspace,
    looks: &Looks,
    call: &FaultCall,
) -> Option<DiagnosticRelatedInformation> {
    let path = path_of_name(&call.name, workspace)?;
    let open = workspace.open_at(&without_links(&path));
    let (uri, text) = match open {
        Some((uri, text)) => (uri.clone(), text.to_owned()),
        None => (uri_of(&path)?, small_text(&path)?),
    };
    let lines = Lines::new(&text, workspace.encoding);
    let line = looks.line_now(&path, &text, call.line)?;
    let location = Location { uri, range: line_range(&text, &lines, line) };
    Some(DiagnosticRelatedInformation { location, message: call.message.clone() })
}

/// The range of a line's text.
fn line_range(text: &str, lines: &Lines<'_>, line: u32) -> Range {
    let start = lines.offset(Position { line, character: 0 });
    let end = line_end(text, lines, line).max(start);
    let indent = text[start..end].len() - text[start..end].trim_start().len();
    lines.range(start + indent, end)
}

/// The offset of the end of a line, without its break.
fn line_end(text: &str, lines: &Lines<'_>, line: u32) -> usize {
    let end = lines.offset(Position { line, character: u32::MAX });
    text[..end].strip_suffix('\r').map_or(end, str::len)
}

/// The offset of a column in characters.
fn offset(text: &str, lines: &Lines<'_>, line: u32, column: u32) -> usize {
    let start = lines.offset(Position { line, character: 0 });
    let end = line_end(text, lines, line).max(start);
    let mut letters = text[start..end].char_indices();
    letters.nth(column as usize).map_or(end, |(at, _)| start + at)
}
