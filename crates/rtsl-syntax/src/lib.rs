//! RTSL text to tree: preprocessor, lexer and error-recovering parser.
//!
//! Parsing always gives a tree, with whatever diagnostics the text deserves. This crate knows the
//! grammar and nothing else: no types, no built-in names, no roles.

pub mod ast;
