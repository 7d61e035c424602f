//! Diagnostics of a text, the edits that mend it, and formatting.

use std::collections::HashMap;

use lsp_server::ErrorCode;
use lsp_types::{
    CodeAction, CodeActionKind, CodeActionOrCommand, CodeActionParams, Diagnostic,
    DiagnosticRelatedInformation, DiagnosticSeverity, DiagnosticTag, DocumentFormattingParams,
    NumberOrString, Range, TextEdit, Uri, WorkspaceEdit,
};
use rtsl::{FileId, Severity, Span, diagnostic_codes as codes};
use rtsl_ide::{Document, advice, use_of_file};

use super::{Refusal, beginning, location_of, range_of};
use crate::place::Lines;
use crate::workspace::Workspace;

/// Returns the errors and warnings of an open text.
pub fn diagnostics(workspace: &mut Workspace, uri: &Uri) -> Vec<Diagnostic> {
    if workspace.is_of_library(uri) {
        return Vec::new();
    }
    let Some(document) = workspace.document(uri) else { return Vec::new() };
    let found = document.analysis.diagnostics.iter();
    found.map(|diagnostic| diagnostic_of(workspace, &document, uri, diagnostic)).collect()
}

fn diagnostic_of(
    workspace: &Workspace,
    document: &Document,
    uri: &Uri,
    found: &rtsl::Diagnostic,
) -> Diagnostic {
    let place = found.primary.as_ref().map(|label| label.span);
    let own = place.filter(|span| span.file == document.file());
    let elsewhere = place.filter(|span| span.file != document.file());
    let range = match (own, elsewhere) {
        (Some(span), _) => range_of(workspace, document, span),
        (None, Some(span)) => range_of_use(workspace, document, span.file),
        (None, None) => beginning(),
    };
    let mut related: Vec<DiagnosticRelatedInformation> = Vec::new();
    let located = |span: Span, message: &str| {
        let location = location_of(workspace, document, uri, span)?;
        Some(DiagnosticRelatedInformation { location, message: message.to_owned() })
    };
    let primary = found.primary.iter().filter(|label| label.span.file != document.file());
    related.extend(primary.filter_map(|label| located(label.span, &label.message)));
    related.extend(found.labels.iter().filter_map(|label| located(label.span, &label.message)));
    let is_unneeded = [codes::UNUSED_VARIABLE, codes::UNREACHABLE].contains(&found.code);
    Diagnostic {
        range,
        severity: Some(match found.severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
        }),
        code: Some(NumberOrString::String(found.code.as_str().to_owned())),
        source: Some("rtsl".to_owned()),
        message: message_of(document, found, elsewhere),
        related_information: (!related.is_empty()).then_some(related),
        tags: is_unneeded.then(|| vec![DiagnosticTag::UNNECESSARY]),
        ..Diagnostic::default()
    }
}

/// The message with its label, notes and advice.
fn message_of(document: &Document, found: &rtsl::Diagnostic, elsewhere: Option<Span>) -> String {
    let mut lines = vec![found.message.clone()];
    if let Some(span) = elsewhere {
        let name = &document.analysis.sources.file(span.file).name;
        lines[0] = format!("in `{name}`: {}", found.message);
    }
    let label = found.primary.as_ref().map(|label| label.message.as_str()).unwrap_or_default();
    if !label.is_empty() && !found.message.contains(label) {
        lines.push(label.to_owned());
    }
    lines.extend(found.notes.iter().map(|note| format!("note: {note}")));
    lines.extend(found.help.iter().map(|help| format!("help: {help}")));
    lines.extend(found.suggestions.iter().map(|it| format!("help: {}", advice(it))));
    lines.join("\n")
}

/// The part of a text that includes or imports a file, or its beginning.
fn range_of_use(workspace: &Workspace, document: &Document, file: FileId) -> Range {
    let span = use_of_file(document, file);
    span.map_or(beginning(), |span| range_of(workspace, document, span))
}

/// Returns the edits that diagnostics in a range suggest.
pub fn actions(
    workspace: &mut Workspace,
    asked: &CodeActionParams,
) -> Result<Option<Vec<CodeActionOrCommand>>, Refusal> {
    let uri = &asked.text_document.uri;
    let Some(document) = workspace.document(uri) else { return Ok(None) };
    let lines = Lines::of(&document.analysis.sources, document.file(), workspace.encoding);
    let (start, end) = (lines.offset(asked.range.start), lines.offset(asked.range.end));
    let touches = |span: Span| {
        span.file == document.file() && span.start as usize <= end && start <= span.end as usize
    };
    let mut actions = Vec::new();
    for found in document.analysis.diagnostics.iter() {
        let label = found.primary.as_ref().map(|label| label.span);
        let own = found.suggestions.iter().filter(|it| it.span.file == document.file());
        for suggestion in own.filter(|it| label.is_some_and(touches) || touches(it.span)) {
            let edit = TextEdit {
                range: range_of(workspace, &document, suggestion.span),
                new_text: suggestion.replacement.clone(),
            };
            #[allow(
                clippy::mutable_key_type,
                reason = "a URI caches nothing that its hash depends on"
            )]
            let changes = HashMap::from([(uri.clone(), vec![edit])]);
            actions.push(CodeActionOrCommand::CodeAction(CodeAction {
                title: advice(suggestion),
                kind: Some(CodeActionKind::QUICKFIX),
                diagnostics: Some(vec![diagnostic_of(workspace, &document, uri, found)]),
                edit: Some(WorkspaceEdit { changes: Some(changes), ..WorkspaceEdit::default() }),
                is_preferred: Some(found.suggestions.len() == 1),
                ..CodeAction::default()
            }));
        }
    }
    Ok(Some(actions))
}

/// Returns the edits that format a text: one for the lines from the first to the last that change.
pub fn formatting(
    workspace: &mut Workspace,
    asked: &DocumentFormattingParams,
) -> Result<Option<Vec<TextEdit>>, Refusal> {
    let uri = &asked.text_document.uri;
    let Some(text) = workspace.text(uri) else { return Ok(None) };
    let formatted = rtsl_format::format(FileId(0), text)
        .map_err(|error| Refusal::new(ErrorCode::RequestFailed, error.message.clone()))?;
    if formatted == text {
        return Ok(Some(Vec::new()));
    }
    let same = |(left, right): &(&str, &str)| left == right;
    let before = text.split_inclusive('\n').zip(formatted.split_inclusive('\n'));
    let start: usize = before.take_while(same).map(|(line, _)| line.len()).sum();
    let (old, new) = (&text[start..], &formatted[start..]);
    let after = old.split_inclusive('\n').rev().zip(new.split_inclusive('\n').rev());
    let rest: usize = after.take_while(same).map(|(line, _)| line.len()).sum();
    let rest = rest.min(old.len()).min(new.len());
    let range = Lines::new(text, workspace.encoding).range(start, text.len() - rest);
    Ok(Some(vec![TextEdit { range, new_text: new[..new.len() - rest].to_owned() }]))
}
