//! A window in which a scene is rendered while camera, parameters and shaders change: the implementation of `rtsl
//! view`.
//!
//! [`app`] is the viewer: [`input`] events in, pixels out. The window only passes events to the viewer and pixels to
//! the screen, so that the viewer can be tested without a display.
//!
//! This crate depends on [`rtsl_render::session`] only: not on the stages of the compiler, nor on the tracing of rays.

pub mod app;
pub mod camera_control;
mod canvas;
pub mod input;
mod libraries;
mod overlay;
mod panel;
mod watch;
mod window;

pub use window::{ViewError, ViewOptions, view};
