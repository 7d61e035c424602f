//! Source files, spans and diagnostics: what every stage that reads text shares.
//!
//! This crate knows nothing of the language: no token, no type. It does no input or output;
//! the text of a file is handed to it. [`render`] turns diagnostics into text for a terminal.

mod codes;
pub mod deep_stack;
mod diagnostic;
mod excerpt;
mod map;
mod messages;
pub mod render;
mod similar;

pub use codes::{Code, CodeInfo, code_info, codes};
pub use diagnostic::{Diagnostic, Diagnostics, Label, Severity, Suggestion};
pub use map::{FileId, Position, SourceFile, SourceMap, Span};
pub use messages::Messages;
pub use similar::most_similar;

/// The constants that name every diagnostic: `diagnostic_codes::UNKNOWN_NAME` and so on.
pub mod diagnostic_codes {
    pub use crate::codes::names::*;
}
