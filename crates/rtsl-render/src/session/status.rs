//! How a session fares.

use std::time::Duration;

/// Figures for people who watch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// Columns and rows.
    pub size: (usize, usize),
    /// Samples that a pixel has, on average: where the picture is rough there are more.
    pub samples: u32,
    /// Samples that every pixel will have.
    pub samples_wanted: u32,
    /// How much smaller the sides of the last whole frame were than those of the film.
    pub reduction: usize,
    /// What the last whole frame took.
    pub frame_time: Duration,
    /// Rays a second, of late.
    pub rays_per_second: f64,
    /// SIMD lanes.
    pub width: u32,
    /// What runs: the processor that code was made for, or the interpreter.
    pub target: String,
    /// Threads that render.
    pub threads: usize,
    /// The part of SIMD lanes that took part in calls of `intersect` and `shade` since the first sample,
    /// by some of the tiles; `None` where nobody counted yet.
    pub lane_utilisation: Option<f32>,
    /// What stopped the render, if something did.
    pub problem: Option<String>,
}
