//! The meaning of names: hover, definition, references, renaming.

use std::collections::{BTreeSet, HashMap};

use lsp_server::ErrorCode;
use lsp_types::{
    DocumentHighlight, DocumentHighlightKind, DocumentHighlightParams, GotoDefinitionParams,
    GotoDefinitionResponse, Hover, HoverContents, HoverParams, Location, MarkupContent, MarkupKind,
    PrepareRenameResponse, ReferenceParams, RenameParams, TextDocumentPositionParams, TextEdit,
    Uri, WorkspaceEdit,
};
use rtsl_ide::{Document, Key, Occurrence};

use super::{Refusal, document_at, location_of, range_of};
use crate::workspace::Workspace;

/// Describes the word at a position.
pub fn hover(workspace: &mut Workspace, asked: &HoverParams) -> Result<Option<Hover>, Refusal> {
    let at = &asked.text_document_position_params;
    let Some((document, offset)) = document_at(workspace, at) else { return Ok(None) };
    Ok(rtsl_ide::hover(&document, offset).map(|hover| Hover {
        contents: HoverContents::Markup(markdown(hover.text)),
        range: Some(range_of(workspace, &document, hover.span)),
    }))
}

/// A text in Markdown.
pub fn markdown(value: String) -> MarkupContent {
    MarkupContent { kind: MarkupKind::Markdown, value }
}

/// Returns where the word at a position is declared.
pub fn definition(
    workspace: &mut Workspace,
    asked: &GotoDefinitionParams,
) -> Result<Option<GotoDefinitionResponse>, Refusal> {
    let at = &asked.text_document_position_params;
    let Some((document, offset)) = document_at(workspace, at) else { return Ok(None) };
    let span = rtsl_ide::definition(&document, offset);
    let uri = &at.text_document.uri;
    let location = span.and_then(|span| location_of(workspace, &document, uri, span));
    Ok(location.map(GotoDefinitionResponse::Scalar))
}

/// Returns the uses of the word at a position in all texts.
pub fn references(
    workspace: &mut Workspace,
    asked: &ReferenceParams,
) -> Result<Option<Vec<Location>>, Refusal> {
    let at = &asked.text_document_position;
    let Some((document, offset)) = document_at(workspace, at) else { return Ok(None) };
    let Some((key, name)) = key_and_name(&document, offset) else { return Ok(None) };
    let mut found = everywhere(workspace, &key, &name);
    if !asked.context.include_declaration {
        found.retain(|(_, occurrence)| !occurrence.is_declaration);
    }
    Ok(Some(found.into_iter().map(|(location, _)| location).collect()))
}

/// Returns the uses of the word at a position in its text.
pub fn highlights(
    workspace: &mut Workspace,
    asked: &DocumentHighlightParams,
) -> Result<Option<Vec<DocumentHighlight>>, Refusal> {
    let at = &asked.text_document_position_params;
    let Some((document, offset)) = document_at(workspace, at) else { return Ok(None) };
    let Some(key) = rtsl_ide::key_at(&document, offset) else { return Ok(None) };
    let own = rtsl_ide::occurrences(&document, &key).into_iter();
    let own = own.filter(|occurrence| occurrence.span.file == document.file());
    let highlight = |occurrence: Occurrence| DocumentHighlight {
        range: range_of(workspace, &document, occurrence.span),
        kind: Some(match occurrence.is_declaration {
            true => DocumentHighlightKind::WRITE,
            false => DocumentHighlightKind::READ,
        }),
    };
    Ok(Some(own.map(highlight).collect()))
}

/// Tells whether the word at a position can be renamed.
pub fn prepare_rename(
    workspace: &mut Workspace,
    asked: &TextDocumentPositionParams,
) -> Result<Option<PrepareRenameResponse>, Refusal> {
    let Some((document, offset)) = document_at(workspace, asked) else { return Ok(None) };
    refuse(rtsl_ide::rename_refusal(&document, offset))?;
    let Some(word) = document.word(offset) else { return Ok(None) };
    Ok(Some(PrepareRenameResponse::Range(range_of(workspace, &document, word.span))))
}

/// Renames the word at a position in all texts.
pub fn rename(
    workspace: &mut Workspace,
    asked: &RenameParams,
) -> Result<Option<WorkspaceEdit>, Refusal> {
    let at = &asked.text_document_position;
    let Some((document, offset)) = document_at(workspace, at) else { return Ok(None) };
    refuse(rtsl_ide::rename_refusal(&document, offset))?;
    refuse(rtsl_ide::name_refusal(&asked.new_name))?;
    let Some((key, name)) = key_and_name(&document, offset) else { return Ok(None) };
    // URIs have no interior mutability that their hashes would show.
    #[allow(clippy::mutable_key_type, reason = "a URI caches nothing that its hash depends on")]
    let mut changes: HashMap<Uri, Vec<TextEdit>> = HashMap::new();
    for (location, _) in everywhere(workspace, &key, &name) {
        let new_text = asked.new_name.clone();
        changes.entry(location.uri).or_default().push(TextEdit { range: location.range, new_text });
    }
    Ok(Some(WorkspaceEdit { changes: Some(changes), ..WorkspaceEdit::default() }))
}

fn refuse(reason: Option<String>) -> Result<(), Refusal> {
    reason.map_or(Ok(()), |reason| Err(Refusal::new(ErrorCode::RequestFailed, reason)))
}

fn key_and_name(document: &Document, offset: u32) -> Option<(Key, String)> {
    let word = document.word(offset)?;
    let name = document.analysis.sources.text(word.span).to_owned();
    Some((rtsl_ide::key_at(document, offset)?, name))
}

/// The places in all texts at which something occurs, each once.
fn everywhere(workspace: &mut Workspace, key: &Key, name: &str) -> Vec<(Location, Occurrence)> {
    let mut found = Vec::new();
    let mut seen = BTreeSet::new();
    for (uri, document) in workspace.documents_where(|text| text.contains(name)) {
        for occurrence in rtsl_ide::occurrences(&document, key) {
            let location = location_of(workspace, &document, &uri, occurrence.span);
            let Some(location) = location else { continue };
            let start = location.range.start;
            if seen.insert((location.uri.as_str().to_owned(), start.line, start.character)) {
                found.push((location, occurrence));
            }
        }
    }
    found
}
