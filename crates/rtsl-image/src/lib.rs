//! Images: linear colours in memory, PNG (as a screen shows it) or EXR (linear) on disk.
//!
//! [`write_image`] and its relatives write files whole or not at all ([`atomic_write`]); [`Picture`] reads them within a
//! budget of memory. [`ViewTransform`] maps linear colours to a screen. [`Denoiser`] calls Open Image Denoise where it is
//! installed. This crate knows neither scenes nor shaders.

mod aov;
pub mod atomic_write;
mod colormap;
mod denoise;
#[allow(unsafe_code, reason = "calls a C library")]
mod denoiser;
mod exr_file;
mod exr_picture;
mod file;
mod image;
mod metadata;
mod picture;
mod png_file;
mod srgb;
mod view_transform;

pub use aov::{Aov, AovImage};
pub use colormap::{HeatScale, logarithm};
pub use denoise::{DENOISER_AOVS, denoised, denoiser_diagnostic};
pub use denoiser::{Denoiser, DenoiserError, DenoiserInput};
pub use exr_file::{ExrOptions, ExrPrecision};
pub use file::{
    ImageError, ImageFormat, ImageOptions, check_writable, write_image, write_image_with,
    write_pixels,
};
pub use image::{Image, exposure_scale};
pub use metadata::ImageMetadata;
pub use picture::{Encoding, Picture, PictureError};
pub use srgb::{SrgbEncoder, decode as srgb_decode};
pub use view_transform::{ViewEncoder, ViewTransform};
