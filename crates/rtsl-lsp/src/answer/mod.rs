//! The answers to requests: those of `rtsl_ide`, as messages.

mod commands;
mod looks;
mod names;
mod overview;
mod problems;
mod typing;

pub use commands::{COMMANDS, LINE_COSTS, Order, Ordered, ordered};
pub use looks::faults;
pub use names::{definition, highlights, hover, prepare_rename, references, rename};
pub use overview::{folds, hints, lenses, semantic_tokens, symbols, workspace_symbols};
pub use problems::{actions, diagnostics, formatting};
pub use typing::{completion, signature_help};

use std::path::Path;

use lsp_server::{ErrorCode, RequestId, Response};
use lsp_types::{Location, Position, Range, TextDocumentPositionParams, Uri};
use rtsl::Span;
use rtsl_ide::Document;
use serde_json::Value;

use crate::place::{Lines, uri_of};
use crate::workspace::Workspace;

/// The result of a request.
pub type Answer = Result<Value, Refusal>;

/// The reason why a request has no result.
#[derive(Debug)]
pub struct Refusal {
    /// The code of the protocol.
    pub code: ErrorCode,
    /// The reason.
    pub message: String,
}

impl Refusal {
    /// A refusal with this reason.
    pub fn new(code: ErrorCode, message: impl Into<String>) -> Refusal {
        Refusal { code, message: message.into() }
    }

    /// The response to a request.
    pub fn response(self, id: RequestId) -> Response {
        Response::new_err(id, self.code as i32, self.message)
    }
}

/// Reads the parameters of a request and writes its result.
pub fn with<P: serde::de::DeserializeOwned, R: serde::Serialize>(
    parameters: Value,
    answer: impl FnOnce(P) -> Result<R, Refusal>,
) -> Answer {
    let invalid =
        |error: serde_json::Error| Refusal::new(ErrorCode::InvalidParams, error.to_string());
    let result = answer(serde_json::from_value(parameters).map_err(invalid)?)?;
    serde_json::to_value(result).map_err(invalid)
}

/// The offset of a position in an open text.
fn offset_at(workspace: &Workspace, at: &TextDocumentPositionParams) -> Option<usize> {
    let text = workspace.text(&at.text_document.uri)?;
    Some(Lines::new(text, workspace.encoding).offset(at.position))
}

/// The analysis of an open text, and the offset of a position in it.
fn document_at(
    workspace: &mut Workspace,
    at: &TextDocumentPositionParams,
) -> Option<(std::rc::Rc<Document>, u32)> {
    let offset = offset_at(workspace, at)? as u32;
    Some((workspace.document(&at.text_document.uri)?, offset))
}

/// The range of a place in the text of an analysis.
fn range_of(workspace: &Workspace, document: &Document, span: Span) -> Range {
    let lines = Lines::of(&document.analysis.sources, span.file, workspace.encoding);
    lines.range(span.start as usize, span.end as usize)
}

/// The location of a place: in a file, which is written to the disk if it is of the library.
fn location_of(
    workspace: &Workspace,
    document: &Document,
    own: &Uri,
    span: Span,
) -> Option<Location> {
    let range = range_of(workspace, document, span);
    if span.file == document.file() {
        return Some(Location { uri: own.clone(), range });
    }
    let file = document.analysis.sources.file(span.file);
    let is_of_library =
        document.analysis.is_of_prelude(span.file) || rtsl::library::file(&file.name).is_some();
    let uri = match is_of_library {
        true => uri_of(&workspace.library.path_of(&file.name, &file.text)?)?,
        false => uri_of(Path::new(&file.name))?,
    };
    Some(Location { uri, range })
}

/// The beginning of a text.
fn beginning() -> Range {
    Range { start: Position::default(), end: Position::default() }
}
