//! Triangle meshes: the arrays that instances of RTSL's mesh classes share, and the readers that
//! make them of files.
//!
//! A reader puts numbers straight into the bits that kernels read ([`MeshBuilder`]); PLY files stream
//! by and are never whole in memory. What is read is checked once, in
//! [`MeshBuilder::finish`]: no index leads outside its array, no coordinate is infinite. Files are
//! not trusted: what a header claims reserves no memory, and no input makes a reader panic.
//!
//! This module knows neither scenes nor classes.

mod builder;
mod error;
mod gltf;
mod ply;

pub use builder::{Mesh, MeshBuilder};
pub use error::MeshError;
pub use gltf::{read_gltf, read_gltf_within};
pub use ply::{read_ply, read_ply_within};
