//! Answers about RTSL text for editors.
//!
//! A [`Document`] is a text with its analysis, which texts with errors have, too. The answers are functions of it:
//! [`hover`], [`definition`], [`occurrences`], [`outline`], [`semantic_tokens`], [`hints`], [`lenses`]. Answers that
//! depend on a word that is being typed analyse the text with a placeholder in its place: [`complete`] and
//! [`signature_help`].
//!
//! All places are spans of bytes. This crate knows no protocol and does no input or output: includes come from the
//! caller's loader.

mod advice;
mod completion;
mod cursor;
mod declaration;
mod document;
mod hint;
mod hover;
mod lens;
mod macros;
mod occurrence;
mod outline;
mod rate;
mod replacement;
mod semantic;
mod signature;
mod visit;

pub use advice::advice;
pub use completion::{CompletionItem, Completions, complete};
pub use declaration::{Declaration, DeclarationId, DeclarationKind, Declarations};
pub use document::{Document, Meaning, Word};
pub use hint::{Hint, hints};
pub use hover::{Hover, hover};
pub use lens::{Lens, lenses};
pub use macros::Macros;
pub use occurrence::{
    Key, Occurrence, definition, key_at, name_refusal, occurrences, rename_refusal, use_of_file,
};
pub use outline::{Fold, OutlineEntry, folds, outline};
pub use semantic::{SemanticKind, SemanticToken, semantic_tokens};
pub use signature::{SignatureHelp, signature_help};

pub use rtsl_sema::index::Signature;
