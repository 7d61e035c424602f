//! The integration tests of `rtsl-scene`, as one program: linking is most of the work of building tests.

mod cameras;
mod draco;
mod export;
mod files;
mod format_page;
mod gltf;
mod gltf_attributes;
mod ies;
mod images;
mod inputs;
mod leniency;
mod materialx;
mod measured;
mod mesh_files;
mod motion;
mod names;
mod pages;
#[path = "../../../../fuzz/entries/paint.rs"]
mod paint;
mod reader;
mod source;
mod textured;
mod upgrade;
