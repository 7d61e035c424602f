//! The image: linear colours while it is made, PNG (sRGB) or EXR (linear) when it is kept.

mod aov;
mod file;
mod heat;
mod srgb;

pub use aov::{Aov, AovImage};
pub use file::{ImageError, ImageFormat, write_image, write_image_with, write_pixels};
pub use heat::HeatScale;
pub(crate) use heat::logarithm;
pub use srgb::SrgbEncoder;

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
        let encoder = SrgbEncoder::new();
        let scale = exposure_scale(exposure);
        self.pixels.iter().flatten().map(|value| encoder.encode(value * scale)).collect()
    }
}

/// What an exposure of so many stops multiplies colours with.
pub fn exposure_scale(stops: f32) -> f32 {
    power_of_two(stops)
}

/// Two to the power of `exponent`, clamped to sensible exposures: the whole part exactly, the
/// rest by a series.
fn power_of_two(exponent: f32) -> f32 {
    if exponent.is_nan() {
        return 1.0;
    }
    let exponent = f64::from(exponent).clamp(-64.0, 64.0);
    let whole = exponent.floor();
    let x = (exponent - whole) * std::f64::consts::LN_2;
    let mut term = 1.0;
    let mut sum = 1.0;
    for n in 1..18 {
        term *= x / f64::from(n);
        sum += term;
    }
    let doublings = whole.abs() as u32;
    let power = (0..doublings).fold(1.0, |power: f64, _| power * 2.0);
    (if whole < 0.0 { sum / power } else { sum * power }) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_counts_stops() {
        assert_eq!(power_of_two(0.0), 1.0);
        assert_eq!(power_of_two(-3.0), 0.125);
        assert_eq!(power_of_two(0.5), std::f32::consts::SQRT_2);
    }
}
