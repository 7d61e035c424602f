//! Images: linear colours in memory, PNG (as displayed) or EXR (linear) on disk.
//!
//! [`write_image`] and related functions write files completely or not at all ([`atomic_write`]); [`Picture`] reads
//! them within a memory budget. [`ViewTransform`] maps linear colours to a display. [`Denoiser`] calls Open Image
//! Denoise if it is installed. This crate does not depend on scenes or shaders.

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
mod picture_file;
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
pub use image::Image;
pub use metadata::ImageMetadata;
pub use picture::{Picture, PictureError};
pub use picture_file::Encoding;
pub use srgb::{SrgbEncoder, decode as srgb_decode};
pub use view_transform::{ViewEncoder, ViewTransform, exposure_scale};
