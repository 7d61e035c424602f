//! The tree-sitter grammar of RTSL, for programs that use the crate `tree-sitter`.
#![allow(unsafe_code, reason = "the parser is C")]

use tree_sitter_language::LanguageFn;

unsafe extern "C" {
    fn tree_sitter_rtsl() -> *const ();
}

/// The grammar.
// SAFETY: the function is that of the generated parser, which returns a language.
pub const LANGUAGE: LanguageFn = unsafe { LanguageFn::from_raw(tree_sitter_rtsl) };

/// The description of the nodes, as JSON.
pub const NODE_TYPES: &str = include_str!("../../src/node-types.json");
/// The query for syntax highlighting.
pub const HIGHLIGHTS_QUERY: &str = include_str!("../../queries/highlights.scm");
/// The query for texts of other languages: those of macros.
pub const INJECTIONS_QUERY: &str = include_str!("../../queries/injections.scm");
/// The query for scopes, definitions and references.
pub const LOCALS_QUERY: &str = include_str!("../../queries/locals.scm");
/// The query for lists of symbols.
pub const TAGS_QUERY: &str = include_str!("../../queries/tags.scm");
