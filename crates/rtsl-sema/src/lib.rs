//! Names, types, overloads and roles: turns the syntax tree into the typed tree of [`hir`].
//!
//! All diagnostics about names, types, classes, roles and state come from [`check`]. Constant expressions are folded
//! with the operations of `rtsl_ir`, whose functions this crate never makes: `rtsl-lower` does.
//!
//! This crate knows no masks, no packets, no target, and does no input or output.

pub mod check;
pub mod hir;
pub mod print;
