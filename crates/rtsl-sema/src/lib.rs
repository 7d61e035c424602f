//! Name resolution, types, overloads and roles: turns the syntax tree into the typed tree of
//! [`hir`].
//!
//! All diagnostics about names, types, classes, roles and state come from [`check`]. Constant
//! expressions are folded with the operations of `rtsl_ir`. This crate never builds functions of
//! that IR; `rtsl-lower` does.
//!
//! This crate does not depend on masks, packets or targets, and does no input or output.

pub mod check;
pub mod hir;
pub mod index;
pub mod prelude;
pub mod print;
pub mod walk;
