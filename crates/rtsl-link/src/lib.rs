//! Linking: a method and the methods that it calls through references become one function, once the classes of the
//! instances are known.
//!
//! The body of the called method replaces each call. Its members, buffers and scratch get the path of the reference as
//! prefix (`kd.scale`), and it reads the caller's state as of the call. Comparisons select the element of an array of
//! references. A call through a reference that is not set gives the role's defaults.
//!
//! A [`Linker`] may answer further operations by code of its own: `rtsl-integrate` links the stages of integrators so.
//! This crate knows no camera, light or stage, and makes no code for machines.

pub mod attributes;
mod called_scratch;
pub mod class_tree;
pub mod draft;
pub mod errors;
pub mod hit;
pub mod linked_method;
pub mod linker;
mod loads;
pub mod outputs;
mod reference_calls;
pub mod reported_calls;
pub mod site;
#[cfg(test)]
mod tests;
mod zeroed_locals;

pub use attributes::AttributeTable;
pub use class_tree::ClassTree;
pub use draft::{Draft, Linking};
pub use linked_method::{HitPlacement, LinkedMethod};
pub use linker::{Linked, Linker, PlainLinker, link_function, link_method};
pub use loads::load_component;
pub use outputs::Outputs;
pub use reference_calls::default_of;
pub use site::{Site, find_override};
