//! Spectra in scenes and their conversion to linear sRGB.
//!
//! No function of the platform is used, so colours have the same bits everywhere.

mod blackbody;
mod color_space;
mod daylight;
mod matching;
mod named;
mod sampled;
mod smooth;
mod white_balance;

pub use blackbody::blackbody;
pub use color_space::ColorSpace;
pub use daylight::daylight_weights;
pub use matching::luminance;
pub use named::{named, names};
pub use sampled::Sampled;
pub use smooth::Wavelengths;
pub use white_balance::white_balance;
