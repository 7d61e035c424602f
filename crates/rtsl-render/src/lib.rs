//! The renderers: kernels for a scene's classes, hierarchies over its objects, and the loops that trace rays.
//!
//! [`render_scene`] does all of it: load, compile, build, render.
//!
//! This crate does not depend on the stages of the compiler; it uses the language through the public interface of the
//! crate `rtsl`, like any other host.

pub mod checkpoint;
pub mod compiled;
mod darkness;
pub mod execution;
pub mod extent;
pub(crate) mod lanes;
pub mod measure;
pub mod path;
pub mod pixel;
pub mod progress;
pub mod request;
pub mod session;
pub mod statistics;
pub(crate) mod surfaces;
pub(crate) mod tiles;

pub use execution::{Execution, Optimise, Rendered};
pub use pixel::{PixelRequest, TracedPixel, TracedSample, render_pixel, render_pixel_of};
pub use progress::{Progress, TilesDone};
pub use request::{CheckpointRequest, RenderRequest, RenderResult, render_scene};
pub use rtsl::Messages;
pub use rtsl_scene::LoadOptions;
pub use statistics::Statistics;
