//! Images: linear colours in memory, PNG (as displayed) or EXR (linear) on disk.
//!
//! [`write_image`] and related functions write files completely or not at all ([`atomic_write`]); [`Picture`] reads
//! these and other formats within a memory budget, and [`Mipmap`] stores them as shaders read them.
//! [`ViewTransform`] maps linear colours to a display. [`Denoiser`] calls Open Image Denoise if it is installed. This
//! crate does not depend on scenes or shaders.

mod aov;
mod aov_image;
pub mod atomic_write;
mod bmp_picture;
mod colormap;
mod denoise;
#[allow(unsafe_code, reason = "calls a C library")]
mod denoiser;
mod encoding;
mod exr_file;
mod exr_picture;
mod file;
mod guarded;
mod hdr_picture;
mod image;
mod jpeg_picture;
mod ktx2_picture;
mod limits;
mod metadata;
mod mipmap;
mod opacity;
mod pfm_picture;
mod picture;
mod picture_file;
mod png_file;
mod png_picture;
mod qoi_picture;
mod srgb;
mod texel_format;
mod tga_picture;
mod view_transform;
mod webp_picture;

pub use aov::{Aov, AovType};
pub use aov_image::AovImage;
pub use colormap::{HeatScale, logarithm};
pub use denoise::{DENOISER_AOVS, denoised, denoiser_diagnostic};
pub use denoiser::{Denoiser, DenoiserError, DenoiserInput};
pub use encoding::{ByteCode, Encoding};
pub use exr_file::{ExrOptions, ExrPrecision};
pub use file::{
    ImageError, ImageFormat, ImageOptions, check_writable, write_image, write_image_with,
    write_pixels,
};
pub use image::Image;
pub use limits::NoLight;
pub use metadata::ImageMetadata;
pub use mipmap::Mipmap;
pub use opacity::has_opacity;
pub use picture::{Picture, PictureError, Samples};
pub use png_file::encode_png;
pub use srgb::{SrgbEncoder, decode as srgb_decode};
pub use texel_format::{Depth, TexelFormat};
pub use view_transform::{ViewEncoder, ViewTransform, exposure_scale};
