//! The status of a session.

use std::time::Duration;

/// Figures for display.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// Columns and rows.
    pub size: (usize, usize),
    /// The class of the integrator, or the name of the interactive renderer.
    pub integrator: String,
    /// The average number of samples per pixel: noisy regions have more.
    pub samples: u32,
    /// The number of samples that every pixel will have.
    pub samples_wanted: u32,
    /// The reduction of the last whole frame's resolution.
    pub reduction: usize,
    /// The time for the last whole frame.
    pub frame_time: Duration,
    /// The recent number of rays per second.
    pub rays_per_second: f64,
    /// SIMD lanes.
    pub width: u32,
    /// The target processor of the code, or the interpreter.
    pub target: String,
    /// The number of threads.
    pub threads: usize,
    /// The fraction of SIMD lanes that were active in calls of `intersect` and `shade` since the first sample, measured
    /// for some of the tiles; `None` before the first count.
    pub lane_utilisation: Option<f32>,
    /// The error that stopped the render, if any.
    pub problem: Option<String>,
}
