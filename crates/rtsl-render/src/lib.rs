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
pub(crate) mod film;
pub mod integrate;
pub(crate) mod lights;
pub mod measure;
pub mod pixel;
pub mod progress;
pub mod request;
pub mod schedule;
pub mod session;
pub mod statistics;
pub(crate) mod surfaces;

pub use crate::execution::{Execution, Optimise, Rendered};
pub use crate::pixel::{PixelRequest, TracedPixel, TracedSample, render_pixel, render_pixel_of};
pub use crate::progress::{Progress, TilesDone};
pub use crate::request::{CheckpointRequest, RenderRequest, RenderResult, render_scene};
pub use crate::statistics::Statistics;
pub use rtsl::Messages;
pub use rtsl_scene::LoadOptions;
