//! A window in which a scene is rendered while camera, parameters and shaders change: the implementation of `rtsl
//! view`.
//!
//! [`app`] is the viewer: input of egui in, pixels out. The window only passes input to the viewer and pixels to the
//! screen, so that the viewer can be tested without a display. `raster` draws the controls without a GPU.
//!
//! The picture comes from [`rtsl_render::session`]; this crate traces no rays.

pub mod app;
pub mod camera_control;
mod clipboard;
mod costs;
mod editor;
mod inspector;
mod layout;
mod libraries;
mod navigation;
mod not_finite;
mod parameters;
mod raster;
mod status;
#[cfg(test)]
mod testing;
mod theme;
mod toolbar;
mod watch;
mod window;

pub use app::Start;
pub use layout::Side;
pub use window::{ViewError, ViewOptions, view};
