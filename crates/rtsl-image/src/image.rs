//! Images of linear colours in memory.

use rtsl_memory::{OutOfMemory, collected, filled};

use crate::view_transform::{ViewEncoder, ViewTransform};

/// An image of linear RGB colours, rows from top to bottom.
///
/// ```
/// let mut image = rtsl_image::Image::new(2, 1)?;
/// image.pixels[1] = [1.0, 0.5, 0.25];
/// assert_eq!(image.to_srgb(0.0)?, [0, 0, 0, 255, 188, 137]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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
    /// Creates a black image.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn new(width: usize, height: usize) -> Result<Self, OutOfMemory> {
        Ok(Image { width, height, pixels: filled(width.saturating_mul(height), [0.0; 3])? })
    }

    /// Converts the image, multiplied by `2^exposure`, to sRGB bytes.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn to_srgb(&self, exposure: f32) -> Result<Vec<u8>, OutOfMemory> {
        self.to_view(ViewTransform::Standard, exposure)
    }

    /// Converts the image, multiplied by `2^exposure`, to displayable bytes.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn to_view(&self, view: ViewTransform, exposure: f32) -> Result<Vec<u8>, OutOfMemory> {
        let encoder = ViewEncoder::new(view, exposure);
        let bytes = self.pixels.iter().flat_map(|color| encoder.encode(*color));
        collected(3 * self.pixels.len(), bytes)
    }
}
