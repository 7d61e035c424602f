//! Materials of [MaterialX](https://materialx.org) documents as classes of RTSL.
//!
//! [`Document::read`] reads the text of a document and of those that it includes, and [`translate`] writes a class for
//! each of its surface materials. The class derives from the material of the standard library whose surface the
//! document names, such as `StandardSurface`; each connected input is a function that computes the parameter. A graph
//! becomes one statement for each node, by the [`table`](nodes) of MaterialX's standard nodes.
//!
//! The crate does no input or output: its callers hand it the texts, and bind the images that a class refers to.

mod class;
mod closure;
mod color_space;
mod color_surfaces;
mod document;
mod graph;
mod hair;
mod limits;
mod literal;
mod mixture;
mod old_versions;
mod pictures;
mod places;
mod shader;
mod special;
mod statements;
mod surface;
mod table;
mod translation;
mod types;

pub use document::{Document, Loaded};
pub use table::nodes;
pub use translation::{
    ImageUse, Material, Part, TileNumbers, Translation, has_materials, translate, translate_outputs,
};
