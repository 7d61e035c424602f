//! Views of a whole text: symbols, folds, colours, hints, commands.

use lsp_types::{
    CodeLens, CodeLensParams, Command, DocumentSymbol, DocumentSymbolParams,
    DocumentSymbolResponse, FoldingRange, FoldingRangeKind, FoldingRangeParams, InlayHint,
    InlayHintLabel, InlayHintParams, InlayHintTooltip, SemanticToken, SemanticTokens,
    SemanticTokensParams, SemanticTokensResult, SymbolInformation, SymbolKind,
    WorkspaceSymbolParams, WorkspaceSymbolResponse,
};
use rtsl_ide::{DeclarationKind, Document, Lens, OutlineEntry, SemanticKind};
use serde_json::{Value, json};

use super::{LINE_COSTS, Refusal, location_of, range_of};
use crate::look::Looks;
use crate::place::Lines;
use crate::workspace::Workspace;

/// Returns the outline of a text.
pub fn symbols(
    workspace: &mut Workspace,
    asked: &DocumentSymbolParams,
) -> Result<Option<DocumentSymbolResponse>, Refusal> {
    let Some(document) = workspace.document(&asked.text_document.uri) else { return Ok(None) };
    let entries = rtsl_ide::outline(&document);
    let symbols = entries.into_iter().map(|entry| symbol(workspace, &document, entry));
    Ok(Some(DocumentSymbolResponse::Nested(symbols.collect())))
}

#[allow(deprecated, reason = "the structure has a field that the protocol no longer uses")]
fn symbol(workspace: &Workspace, document: &Document, entry: OutlineEntry) -> DocumentSymbol {
    let children = entry.children.into_iter().map(|it| symbol(workspace, document, it));
    let children: Vec<DocumentSymbol> = children.collect();
    DocumentSymbol {
        name: entry.name,
        detail: Some(entry.detail),
        kind: symbol_kind(entry.kind),
        tags: None,
        deprecated: None,
        range: range_of(workspace, document, entry.extent),
        selection_range: range_of(workspace, document, entry.span),
        children: (!children.is_empty()).then_some(children),
    }
}

fn symbol_kind(kind: DeclarationKind) -> SymbolKind {
    match kind {
        DeclarationKind::Class => SymbolKind::CLASS,
        DeclarationKind::Struct => SymbolKind::STRUCT,
        DeclarationKind::Enumeration => SymbolKind::ENUM,
        DeclarationKind::Choice => SymbolKind::ENUM_MEMBER,
        DeclarationKind::Field | DeclarationKind::Member => SymbolKind::FIELD,
        DeclarationKind::Function => SymbolKind::FUNCTION,
        DeclarationKind::Constructor => SymbolKind::CONSTRUCTOR,
        DeclarationKind::Parameter => SymbolKind::PROPERTY,
        DeclarationKind::Constant => SymbolKind::CONSTANT,
        DeclarationKind::Local | DeclarationKind::Argument => SymbolKind::VARIABLE,
        DeclarationKind::Module => SymbolKind::MODULE,
    }
}

/// Returns the declarations of all texts whose names contain a text.
#[allow(deprecated, reason = "the structure has a field that the protocol no longer uses")]
pub fn workspace_symbols(
    workspace: &mut Workspace,
    asked: &WorkspaceSymbolParams,
) -> Result<Option<WorkspaceSymbolResponse>, Refusal> {
    const MAX_SYMBOLS: usize = 500;
    let mut symbols = Vec::new();
    let wanted = asked.query.to_lowercase();
    // Everything is no answer to a question.
    if wanted.is_empty() {
        return Ok(None);
    }
    let contains = |text: &str| text.to_lowercase().contains(&wanted);
    for (uri, document) in workspace.documents_where(contains) {
        let own = document.declarations.iter().map(|(_, it)| it).filter(|it| {
            let is_inside = matches!(it.kind, DeclarationKind::Local | DeclarationKind::Argument);
            let is_own = it.span.file == document.file() && !is_inside;
            is_own && it.name.to_lowercase().contains(&wanted)
        });
        for declaration in own {
            let location = location_of(workspace, &document, &uri, declaration.span);
            let parent = declaration.parent.map(|id| document.declarations.get(id).name.clone());
            symbols.extend(location.map(|location| SymbolInformation {
                name: declaration.name.clone(),
                kind: symbol_kind(declaration.kind),
                tags: None,
                deprecated: None,
                location,
                container_name: parent,
            }));
        }
    }
    symbols.truncate(MAX_SYMBOLS);
    Ok(Some(WorkspaceSymbolResponse::Flat(symbols)))
}

/// Returns what can be folded.
pub fn folds(
    workspace: &mut Workspace,
    asked: &FoldingRangeParams,
) -> Result<Option<Vec<FoldingRange>>, Refusal> {
    let Some(text) = workspace.text(&asked.text_document.uri) else { return Ok(None) };
    let folds = rtsl_ide::folds(text).into_iter().map(|fold| FoldingRange {
        start_line: fold.first,
        end_line: fold.last,
        kind: fold.is_comment.then_some(FoldingRangeKind::Comment),
        ..FoldingRange::default()
    });
    Ok(Some(folds.collect()))
}

/// Returns the kinds of a text's words. Words of several lines, such as comments, have a token for each line.
pub fn semantic_tokens(
    workspace: &mut Workspace,
    asked: &SemanticTokensParams,
) -> Result<Option<SemanticTokensResult>, Refusal> {
    let Some(document) = workspace.document(&asked.text_document.uri) else { return Ok(None) };
    let text = document.text();
    let lines = Lines::of(&document.analysis.sources, document.file(), workspace.encoding);
    let (mut line, mut start) = (0, 0);
    let mut data = Vec::new();
    for token in rtsl_ide::semantic_tokens(&document) {
        let mut offset = token.start as usize;
        for part in text[offset..token.end as usize].split_inclusive('\n') {
            let end = offset + part.trim_end_matches(['\n', '\r']).len();
            let range = lines.range(offset, end);
            offset += part.len();
            let length = range.end.character - range.start.character;
            if length == 0 {
                continue;
            }
            let delta_line = range.start.line - line;
            let delta_start = match delta_line {
                0 => range.start.character - start,
                _ => range.start.character,
            };
            (line, start) = (range.start.line, range.start.character);
            data.push(SemanticToken {
                delta_line,
                delta_start,
                length,
                token_type: number(token.kind),
                token_modifiers_bitset: u32::from(token.is_declaration)
                    | u32::from(token.is_readonly) << 1
                    | u32::from(token.is_of_language) << 2,
            });
        }
    }
    Ok(Some(SemanticTokens { result_id: None, data }.into()))
}

fn number(kind: SemanticKind) -> u32 {
    SemanticKind::ALL.iter().position(|it| *it == kind).unwrap_or(0) as u32
}

/// Returns the hints of a part of a text: those of its analysis, and the notes of looks.
pub fn hints(
    workspace: &mut Workspace,
    looks: &Looks,
    asked: &InlayHintParams,
) -> Result<Option<Vec<InlayHint>>, Refusal> {
    let uri = &asked.text_document.uri;
    let Some(document) = workspace.document(uri) else { return Ok(None) };
    let lines = Lines::of(&document.analysis.sources, document.file(), workspace.encoding);
    let wanted = lines.offset(asked.range.start)..=lines.offset(asked.range.end);
    let hints = rtsl_ide::hints(&document).into_iter();
    let hints =
        hints.filter(|hint| wanted.contains(&(hint.offset as usize))).map(|hint| InlayHint {
            position: lines.position(hint.offset as usize),
            padding_left: Some(hint.label == "fma"),
            label: InlayHintLabel::String(hint.label),
            kind: None,
            text_edits: None,
            tooltip: Some(InlayHintTooltip::String(hint.tooltip)),
            padding_right: None,
            data: None,
        });
    let mut hints: Vec<InlayHint> = hints.collect();
    let (start, end) = (asked.range.start.line, asked.range.end.line);
    let notes = super::looks::notes(workspace, looks, uri).into_iter();
    hints.extend(notes.filter(|note| (start..=end).contains(&note.position.line)));
    Ok(Some(hints))
}

/// Returns the commands beside classes and methods. Editors run them, but for the costs of lines, which are offered if
/// the editor can show them.
pub fn lenses(
    workspace: &mut Workspace,
    shows_costs: bool,
    asked: &CodeLensParams,
) -> Result<Option<Vec<CodeLens>>, Refusal> {
    let uri = &asked.text_document.uri;
    let Some(document) = workspace.document(uri) else { return Ok(None) };
    let mut lenses = Vec::new();
    for lens in rtsl_ide::lenses(&document) {
        let Lens { span, class, method } = lens;
        let range = range_of(workspace, &document, span);
        let mut add = |title: &str, command: &str, arguments: Vec<Value>| {
            let command = Command::new(title.to_owned(), command.to_owned(), Some(arguments));
            lenses.push(CodeLens { range, command: Some(command), data: None });
        };
        let uri = uri.as_str();
        let Some(method) = method else {
            add("Test", "rtsl.test", vec![json!(uri), json!(class)]);
            continue;
        };
        add("Measure", "rtsl.bench", vec![json!(uri), json!(class), json!(method)]);
        if shows_costs {
            let argument = json!({"uri": uri, "class": class, "method": method});
            add("Costs of lines", LINE_COSTS, vec![argument]);
        }
    }
    Ok(Some(lenses))
}
