//! Source files, spans and diagnostics, shared by every stage that reads text.
//!
//! This crate does not depend on the language: it has no tokens and no types. It does no input or
//! output; callers pass in the text of files. [`render`] formats diagnostics for a terminal.

mod article;
mod codes;
pub mod deep_stack;
mod diagnostic;
mod excerpt;
mod lines;
mod map;
mod messages;
pub mod render;
mod similar;

pub use article::with_article;
pub use codes::{Code, CodeInfo, code_info, codes};
pub use diagnostic::{Diagnostic, Diagnostics, Label, Severity, Suggestion};
pub use map::{FileId, Position, SourceFile, SourceMap, Span};
pub use messages::Messages;
pub use similar::most_similar;

/// The constants that name every diagnostic: `diagnostic_codes::UNKNOWN_NAME` and so on.
pub mod diagnostic_codes {
    pub use crate::codes::names::*;
}
