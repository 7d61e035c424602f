//! Renderers that speak RTSL: the reader of scenes, acceleration, film, and the first renderer.
//!
//! This crate must NOT know any stage of the compiler: of the language it knows what the crate
//! `rtsl` offers to every host.

pub mod acceleration;
pub mod film;
pub mod math;
pub mod reader;
pub mod sampling;
pub mod scene;
