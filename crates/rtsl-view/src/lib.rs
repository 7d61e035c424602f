//! A window in which a scene is rendered while camera, parameters and shaders change: what `rtsl view`
//! opens.
//!
//! [`app`] is the viewer: [`input`] events in, pixels out. The window carries the one to it and the other
//! to the screen, and nothing else, so that the viewer is tested without a display.
//!
//! This crate must NOT know any stage of the compiler, nor what rays are: it knows
//! [`rtsl_render::session`].

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
