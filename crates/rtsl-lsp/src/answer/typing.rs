//! Help while typing: completion and signatures.

use lsp_types::{
    CompletionItem, CompletionItemKind, CompletionParams, CompletionResponse, CompletionTextEdit,
    Documentation, InsertTextFormat, ParameterInformation, ParameterLabel, SignatureHelp,
    SignatureHelpParams, SignatureInformation, TextEdit,
};
use rtsl_ide::{SemanticKind, Signature};

use super::names::markdown;
use super::{Refusal, offset_at};
use crate::place::Lines;
use crate::workspace::{Workspace, name_of};

/// Returns what could be typed at a position.
pub fn completion(
    workspace: &mut Workspace,
    asked: &CompletionParams,
) -> Result<Option<CompletionResponse>, Refusal> {
    let at = &asked.text_document_position;
    let uri = &at.text_document.uri;
    let (Some(offset), Some(text)) = (offset_at(workspace, at), workspace.text(uri)) else {
        return Ok(None);
    };
    let found = rtsl_ide::complete(&name_of(uri), text, offset, &mut workspace.loader(uri));
    let range = Lines::new(text, workspace.encoding).range(found.range.start, found.range.end);
    let items = found.items.into_iter().map(|item| {
        let new_text = item.insert.clone().unwrap_or_else(|| item.label.clone());
        let is_snippet = item.insert.is_some();
        CompletionItem {
            sort_text: Some(format!("{}{}", item.rank, item.label)),
            filter_text: Some(item.label.clone()),
            label: item.label,
            kind: Some(kind(item.kind)),
            detail: item.detail,
            documentation: item.documentation.map(|it| Documentation::MarkupContent(markdown(it))),
            insert_text_format: is_snippet.then_some(InsertTextFormat::SNIPPET),
            text_edit: Some(CompletionTextEdit::Edit(TextEdit { range, new_text })),
            ..CompletionItem::default()
        }
    });
    Ok(Some(CompletionResponse::Array(items.collect())))
}

fn kind(kind: SemanticKind) -> CompletionItemKind {
    match kind {
        SemanticKind::Keyword => CompletionItemKind::KEYWORD,
        SemanticKind::Type | SemanticKind::Struct => CompletionItemKind::STRUCT,
        SemanticKind::Class => CompletionItemKind::CLASS,
        SemanticKind::Enumeration => CompletionItemKind::ENUM,
        SemanticKind::Choice => CompletionItemKind::ENUM_MEMBER,
        SemanticKind::Function => CompletionItemKind::FUNCTION,
        SemanticKind::Method => CompletionItemKind::METHOD,
        SemanticKind::Variable | SemanticKind::Parameter => CompletionItemKind::VARIABLE,
        SemanticKind::Property => CompletionItemKind::FIELD,
        SemanticKind::Module => CompletionItemKind::MODULE,
        SemanticKind::Macro => CompletionItemKind::CONSTANT,
        SemanticKind::Number | SemanticKind::Text | SemanticKind::Comment => {
            CompletionItemKind::TEXT
        }
    }
}

/// Returns the functions that the call at a position could mean.
pub fn signature_help(
    workspace: &mut Workspace,
    asked: &SignatureHelpParams,
) -> Result<Option<SignatureHelp>, Refusal> {
    let at = &asked.text_document_position_params;
    let uri = &at.text_document.uri;
    let (Some(offset), Some(text)) = (offset_at(workspace, at), workspace.text(uri)) else {
        return Ok(None);
    };
    let found = rtsl_ide::signature_help(&name_of(uri), text, offset, &mut workspace.loader(uri));
    Ok(found.map(|help| SignatureHelp {
        signatures: help.signatures.into_iter().map(information).collect(),
        active_signature: Some(help.active as u32),
        active_parameter: Some(help.argument as u32),
    }))
}

fn information(signature: Signature) -> SignatureInformation {
    // Signatures are ASCII, so offsets are the same in each encoding.
    let parameter = |range: &std::ops::Range<usize>| ParameterInformation {
        label: ParameterLabel::LabelOffsets([range.start as u32, range.end as u32]),
        documentation: None,
    };
    SignatureInformation {
        parameters: Some(signature.parameters.iter().map(parameter).collect()),
        label: signature.text,
        documentation: signature.documentation.map(|it| Documentation::MarkupContent(markdown(it))),
        active_parameter: None,
    }
}
