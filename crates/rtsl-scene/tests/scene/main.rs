//! The integration tests of `rtsl-scene`, as one program: linking is most of the work of building tests.

mod cameras;
mod files;
mod format_page;
mod gltf;
mod inputs;
mod leniency;
mod motion;
mod pages;
mod reader;
mod source;
mod textured;
