//! Spectra, as scenes give them, and their colours: linear red, green and blue of sRGB's primaries.
//!
//! No function of the platform takes part, so colours have the same bits everywhere.

mod blackbody;
mod matching;
mod named;
mod sampled;

pub use blackbody::blackbody;
pub use named::{named, names};
pub use sampled::Sampled;
