//! Names, types, overloads and roles; then the lowering to the single-ray representation.
//!
//! Two steps with a typed tree between them:
//!
//! - `check` turns the syntax tree into the typed tree of [`hir`], or says what is wrong.
//!   All diagnostics about names, types, classes, roles and state come from it.
//! - `lower` turns the typed tree into functions of `rtsl_ir`. It trusts the tree, and fails only
//!   where a limit is passed.
//!
//! This crate knows no masks, no packets, no target, and does no input or output.

pub mod check;
pub mod hir;
pub mod lower;
pub mod print;
