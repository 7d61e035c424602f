//! Triangle meshes: the arrays that instances of RTSL's mesh classes share, and readers that create them from files.
//!
//! Readers append numbers directly to the arrays of bits that kernels read ([`MeshBuilder`]); PLY files are streamed
//! and are never complete in memory. [`MeshBuilder::finish`] checks the result once: every index is in bounds and every
//! coordinate is finite, but for vertices that no face uses, which are moved to one that is used. Files are untrusted:
//! the counts in a header reserve no memory, and no input makes a reader panic.
//!
//! This module does not depend on scenes or classes.

mod builder;
mod error;
pub mod gltf;
mod obj;
mod ply;
mod stl;
mod subdivision;

pub(crate) use builder::unused_bad_vertices;
pub use builder::{Mesh, MeshBuilder};
pub use error::{MeshError, MeshWarning};
pub use gltf::{read_gltf, read_gltf_within};
pub use obj::read_obj_within;
pub use ply::{read_ply, read_ply_within};
pub use stl::read_stl_within;
pub use subdivision::subdivide;
