//! The capabilities of the server, as it tells editors.

use lsp_types::{
    CodeActionKind, CodeActionOptions, CodeActionProviderCapability, CodeLensOptions,
    CompletionOptions, ExecuteCommandOptions, FoldingRangeProviderCapability,
    HoverProviderCapability, OneOf, PositionEncodingKind, RenameOptions, SemanticTokenModifier,
    SemanticTokenType, SemanticTokensFullOptions, SemanticTokensLegend, SemanticTokensOptions,
    ServerCapabilities, SignatureHelpOptions, TextDocumentSyncCapability, TextDocumentSyncKind,
    TextDocumentSyncOptions, TextDocumentSyncSaveOptions, WorkDoneProgressOptions,
};
use rtsl_ide::SemanticKind;

use crate::answer::COMMANDS;

/// The modifiers of words, in the order of their bits.
pub const MODIFIERS: [SemanticTokenModifier; 3] = [
    SemanticTokenModifier::DECLARATION,
    SemanticTokenModifier::READONLY,
    SemanticTokenModifier::DEFAULT_LIBRARY,
];

/// Returns the capabilities with this encoding of positions.
pub fn capabilities(encoding: PositionEncodingKind) -> ServerCapabilities {
    let on = |on: &[&str]| Some(on.iter().map(|it| (*it).to_owned()).collect::<Vec<String>>());
    ServerCapabilities {
        position_encoding: Some(encoding),
        text_document_sync: Some(TextDocumentSyncCapability::Options(TextDocumentSyncOptions {
            open_close: Some(true),
            change: Some(TextDocumentSyncKind::INCREMENTAL),
            save: Some(TextDocumentSyncSaveOptions::Supported(true)),
            ..TextDocumentSyncOptions::default()
        })),
        hover_provider: Some(HoverProviderCapability::Simple(true)),
        completion_provider: Some(CompletionOptions {
            trigger_characters: on(&[".", "#", "[", ":"]),
            ..CompletionOptions::default()
        }),
        signature_help_provider: Some(SignatureHelpOptions {
            trigger_characters: on(&["(", ","]),
            ..SignatureHelpOptions::default()
        }),
        definition_provider: Some(OneOf::Left(true)),
        references_provider: Some(OneOf::Left(true)),
        document_highlight_provider: Some(OneOf::Left(true)),
        document_symbol_provider: Some(OneOf::Left(true)),
        workspace_symbol_provider: Some(OneOf::Left(true)),
        folding_range_provider: Some(FoldingRangeProviderCapability::Simple(true)),
        document_formatting_provider: Some(OneOf::Left(true)),
        code_action_provider: Some(CodeActionProviderCapability::Options(CodeActionOptions {
            code_action_kinds: Some(vec![CodeActionKind::QUICKFIX]),
            ..CodeActionOptions::default()
        })),
        code_lens_provider: Some(CodeLensOptions { resolve_provider: Some(false) }),
        rename_provider: Some(OneOf::Right(RenameOptions {
            prepare_provider: Some(true),
            work_done_progress_options: WorkDoneProgressOptions::default(),
        })),
        execute_command_provider: Some(ExecuteCommandOptions {
            commands: COMMANDS.map(str::to_owned).to_vec(),
            work_done_progress_options: WorkDoneProgressOptions { work_done_progress: Some(true) },
        }),
        inlay_hint_provider: Some(OneOf::Left(true)),
        semantic_tokens_provider: Some(
            SemanticTokensOptions {
                legend: SemanticTokensLegend {
                    token_types: SemanticKind::ALL.map(token_type).to_vec(),
                    token_modifiers: MODIFIERS.to_vec(),
                },
                full: Some(SemanticTokensFullOptions::Bool(true)),
                ..SemanticTokensOptions::default()
            }
            .into(),
        ),
        ..ServerCapabilities::default()
    }
}

fn token_type(kind: SemanticKind) -> SemanticTokenType {
    match kind {
        SemanticKind::Keyword => SemanticTokenType::KEYWORD,
        SemanticKind::Type => SemanticTokenType::TYPE,
        SemanticKind::Class => SemanticTokenType::CLASS,
        SemanticKind::Struct => SemanticTokenType::STRUCT,
        SemanticKind::Enumeration => SemanticTokenType::ENUM,
        SemanticKind::Choice => SemanticTokenType::ENUM_MEMBER,
        SemanticKind::Function => SemanticTokenType::FUNCTION,
        SemanticKind::Method => SemanticTokenType::METHOD,
        SemanticKind::Variable => SemanticTokenType::VARIABLE,
        SemanticKind::Parameter => SemanticTokenType::PARAMETER,
        SemanticKind::Property => SemanticTokenType::PROPERTY,
        SemanticKind::Module => SemanticTokenType::NAMESPACE,
        SemanticKind::Macro => SemanticTokenType::MACRO,
        SemanticKind::Number => SemanticTokenType::NUMBER,
        SemanticKind::Text => SemanticTokenType::STRING,
        SemanticKind::Comment => SemanticTokenType::COMMENT,
    }
}
