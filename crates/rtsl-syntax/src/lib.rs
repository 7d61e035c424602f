//! The front end's first half, from RTSL text to a syntax tree: preprocessor, lexer and
//! error-recovering parser.
//!
//! Parsing always returns a tree, along with any diagnostics. This crate implements the grammar
//! only: it knows no types, no built-in names and no roles. It does no input or output: included
//! files come from the caller's [`IncludeLoader`].

pub mod ast;
mod comments;
mod include;
mod lexer;
mod message;
mod number;
mod parser;
mod preprocessor;
pub mod print;
pub mod raw;
mod symbol;
mod token;
mod word;

pub use comments::Comments;
pub use include::{IncludeError, IncludeLoader, IncludedFile, MemoryLoader, NoIncludes, join_path};
pub use parser::qualifiers;
pub use preprocessor::directive::DIRECTIVES;
pub use word::{keywords, reserved_name, type_names};

use rtsl_source::{Diagnostics, FileId, SourceMap, deep_stack};

/// Parses the translation unit that starts with `file`. Included files are added to `source_map`.
pub fn parse(
    source_map: &mut SourceMap,
    file: FileId,
    loader: &mut dyn IncludeLoader,
    diagnostics: &mut Diagnostics,
) -> ast::TranslationUnit {
    let _span = tracing::debug_span!("parse", file = source_map.file(file).name).entered();
    let mut symbols = symbol::Interner::default();
    let (tokens, comments) =
        preprocessor::preprocess(source_map, file, loader, &mut symbols, diagnostics);
    deep_stack::run(|| parser::parse_tokens(tokens, &comments, source_map, &symbols, diagnostics))
}
