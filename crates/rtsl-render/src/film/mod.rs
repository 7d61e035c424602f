//! The image: linear colours while it is made, PNG (as a screen shows it) or EXR (linear) when it is kept.

mod aov;
mod denoise;
mod exr_file;
mod file;
mod heat;
mod metadata;
mod png_file;
mod srgb;
mod view_transform;

pub use aov::{Aov, AovImage};
pub use denoise::{DENOISER_AOVS, denoised, denoiser_diagnostic};
pub use exr_file::{ExrOptions, ExrPrecision};
pub use file::{
    ImageError, ImageFormat, ImageOptions, check_writable, write_image, write_image_with,
    write_pixels,
};
pub use heat::HeatScale;
pub(crate) use heat::logarithm;
pub use metadata::ImageMetadata;
pub use srgb::{SrgbEncoder, decode as srgb_decode};
pub use view_transform::{ViewEncoder, ViewTransform};

use crate::math::power_of_two;

/// An image of linear RGB colours, rows from top to bottom.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The colours, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// A black image.
    pub fn new(width: usize, height: usize) -> Self {
        Image { width, height, pixels: vec![[0.0; 3]; width * height] }
    }

    /// The image as bytes of sRGB after a multiplication by `2^exposure`.
    pub fn to_srgb(&self, exposure: f32) -> Vec<u8> {
        self.to_view(ViewTransform::Standard, exposure)
    }

    /// The image as bytes that a screen shows, after a multiplication by `2^exposure`.
    pub fn to_view(&self, view: ViewTransform, exposure: f32) -> Vec<u8> {
        let encoder = ViewEncoder::new(view, exposure);
        self.pixels.iter().flat_map(|color| encoder.encode(*color)).collect()
    }
}

/// What an exposure of so many stops multiplies colours with.
pub fn exposure_scale(stops: f32) -> f32 {
    if stops.is_nan() { 1.0 } else { power_of_two(f64::from(stops)) as f32 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_counts_stops() {
        assert_eq!(exposure_scale(0.0), 1.0);
        assert_eq!(exposure_scale(-3.0), 0.125);
        assert_eq!(exposure_scale(0.5), std::f32::consts::SQRT_2);
    }
}
