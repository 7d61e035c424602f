//! Renderers that speak RTSL: the reader of scenes, acceleration, film, and the first renderer.
//!
//! [`render_scene`] does all of it: load, compile, build, render.
//!
//! This crate must NOT know any stage of the compiler: of the language it knows what the crate
//! `rtsl` offers to every host.

pub mod acceleration;
pub mod batch;
pub mod checkpoint;
pub mod compiled;
pub mod film;
pub mod interactive;
pub(crate) mod lanes;
pub mod math;
pub mod measure;
pub mod memory;
pub mod mesh;
pub mod messages;
pub mod progress;
pub mod reader;
pub mod replacement;
pub mod request;
pub mod sampling;
pub mod scene;
pub mod session;
pub mod spectrum;
pub mod statistics;
pub(crate) mod tiles;

pub use messages::Messages;
pub use progress::{Progress, TilesDone};
pub use request::{CheckpointRequest, RenderRequest, RenderResult, Renderer, render_scene};
pub use statistics::Statistics;
