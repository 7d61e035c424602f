//! Images that scenes refer to: texels as in their files, cumulative sums for environment lights.

use exr::prelude::f16;
use rtsl_memory::{Amount, OutOfMemory, OverBudget};

use super::encoding::{ByteCode, Encoding};
use super::mipmap::level_sizes;
use super::texel_format::{Depth, TexelFormat};

/// The greatest number of texels, independent of the available memory.
const MAX_TEXELS: usize = 1 << 26;

/// An image in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Channels of a texel: 1 (grey), 3 (red, green, blue) or 4 (with opacity).
    pub channels: usize,
    /// The numbers of the texels, channel beside channel, rows from the top.
    pub samples: Samples,
    /// The encoding of bytes; halves and floats are linear.
    pub encoding: Encoding,
}

/// The numbers of a picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Encoded bytes.
    Bytes(Vec<u8>),
    /// Linear binary16 numbers.
    Halves(Vec<f16>),
    /// Linear binary32 numbers.
    Floats(Vec<f32>),
}

/// An error of reading an image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PictureError {
    /// The file is not an image, or is damaged. The text is a clause, to be preceded by the name of the file.
    Malformed(String),
    /// The image would take too much memory.
    OverBudget(OverBudget),
}

impl From<String> for PictureError {
    fn from(problem: String) -> Self {
        PictureError::Malformed(problem)
    }
}

impl From<&str> for PictureError {
    fn from(problem: &str) -> Self {
        PictureError::Malformed(problem.to_owned())
    }
}

impl From<OverBudget> for PictureError {
    fn from(error: OverBudget) -> Self {
        PictureError::OverBudget(error)
    }
}

impl From<OutOfMemory> for PictureError {
    fn from(error: OutOfMemory) -> Self {
        PictureError::Malformed(error.to_string())
    }
}

impl From<exr::error::Error> for PictureError {
    fn from(error: exr::error::Error) -> Self {
        PictureError::Malformed(error.to_string())
    }
}

impl From<png::DecodingError> for PictureError {
    fn from(error: png::DecodingError) -> Self {
        PictureError::Malformed(error.to_string())
    }
}

impl Picture {
    /// Returns the greatest memory of a picture until it is converted to the arguments of a class.
    pub fn memory(width: usize, height: usize, format: TexelFormat) -> Amount {
        let area = |(width, height): (usize, usize)| width.saturating_mul(height);
        let texels = area((width, height));
        let levels = level_sizes(width, height).map(area).fold(0, usize::saturating_add);
        // A coarse level is computed from the one before, both as floats.
        let computed = Amount::of::<[f32; 4]>(levels - texels);
        let texture = Amount::of::<u32>(format.words(levels)) + computed;
        // Sums of rows and columns exist twice while they are copied.
        let sums = Amount::of::<f32>(2 * texels.saturating_add(width + height + 1));
        let sky = Amount::of::<u32>(format.words(texels)) + sums;
        format.decoded(texels) + texture.max(sky)
    }

    /// Returns the storage of its texels.
    pub fn format(&self) -> TexelFormat {
        let depth = match self.samples {
            Samples::Bytes(_) => Depth::Byte,
            Samples::Halves(_) => Depth::Half,
            Samples::Floats(_) => Depth::Float,
        };
        TexelFormat { channels: self.channels, depth }
    }

    /// Returns the numbers if they are bytes.
    pub fn bytes(&self) -> Option<&[u8]> {
        match &self.samples {
            Samples::Bytes(bytes) => Some(bytes),
            Samples::Halves(_) | Samples::Floats(_) => None,
        }
    }

    /// Returns the linear components of a texel: red, green, blue and opacity, which is 1 where the picture has none.
    /// `code` is that of the picture's encoding.
    pub fn components(&self, code: &ByteCode, index: usize) -> [f32; 4] {
        let places = index * self.channels..(index + 1) * self.channels;
        let mut numbers = [1.0; 4];
        let targets = numbers.iter_mut();
        match &self.samples {
            Samples::Bytes(bytes) => {
                targets.zip(&bytes[places]).for_each(|(to, it)| *to = code.decode(*it));
            }
            Samples::Halves(halves) => {
                targets.zip(&halves[places]).for_each(|(to, it)| *to = it.to_f32());
            }
            Samples::Floats(floats) => {
                targets.zip(&floats[places]).for_each(|(to, it)| *to = *it);
            }
        }
        if self.channels == 1 { [numbers[0], numbers[0], numbers[0], 1.0] } else { numbers }
    }

    /// Returns all texels as linear red, green and blue.
    pub fn colors(&self) -> impl Iterator<Item = [f32; 3]> {
        let code = ByteCode::new(self.encoding);
        (0..self.width * self.height).map(move |index| {
            let [red, green, blue, _] = self.components(&code, index);
            [red, green, blue]
        })
    }

    /// Drops the opacity if it is 1 everywhere.
    #[must_use]
    pub fn without_full_opacity(mut self) -> Self {
        if self.channels == 4 {
            let opaque = match &self.samples {
                Samples::Bytes(bytes) => bytes.chunks_exact(4).all(|texel| texel[3] == 255),
                Samples::Halves(halves) => halves.chunks_exact(4).all(|it| it[3] == f16::ONE),
                Samples::Floats(floats) => floats.chunks_exact(4).all(|texel| texel[3] == 1.0),
            };
            if opaque {
                self.keep_channels(3);
            }
        }
        self
    }

    /// Drops all but the first channels.
    pub fn keep_channels(&mut self, kept: usize) {
        let channels = self.channels;
        match &mut self.samples {
            Samples::Bytes(bytes) => keep(bytes, channels, kept),
            Samples::Halves(halves) => keep(halves, channels, kept),
            Samples::Floats(floats) => keep(floats, channels, kept),
        }
        self.channels = kept;
    }

    /// Returns cumulative distributions of an environment map's light: one over the rows, and one over the columns of
    /// each row, each ending with 1. `row_weight` is the solid angle of a row's texels, to any scale.
    pub fn sums(&self, row_weight: impl Fn(usize) -> f64) -> (Vec<f32>, Vec<f32>) {
        let luminance = |texel: [f32; 3]| {
            let [red, green, blue] = texel.map(f64::from);
            (0.2126 * red + 0.7152 * green + 0.0722 * blue).max(0.0)
        };
        let mut columns = Vec::with_capacity((self.width + 1) * self.height);
        let mut totals = Vec::with_capacity(self.height);
        let mut brightness = self.colors().map(luminance);
        for row in 0..self.height {
            let line: Vec<f64> = brightness.by_ref().take(self.width).collect();
            columns.extend(running(&line));
            totals.push(line.iter().sum::<f64>() * row_weight(row));
        }
        (running(&totals), columns)
    }
}

/// Keeps the first numbers of each group of `channels`.
fn keep<T: Copy>(numbers: &mut Vec<T>, channels: usize, kept: usize) {
    let texels = numbers.len() / channels;
    for texel in 0..texels {
        numbers.copy_within(texel * channels..texel * channels + kept, texel * kept);
    }
    numbers.truncate(texels * kept);
    numbers.shrink_to_fit();
}

/// The fractions of the sum before each number, and 1. If all are 0 they are weighted equally.
fn running(numbers: &[f64]) -> Vec<f32> {
    let total: f64 = numbers.iter().sum();
    let mut sum = 0.0;
    let mut parts = vec![0.0];
    for (index, number) in numbers.iter().enumerate() {
        sum += number;
        let part =
            if total > 0.0 { sum / total } else { (index + 1) as f64 / numbers.len() as f64 };
        parts.push(part.min(1.0) as f32);
    }
    if let Some(last) = parts.last_mut() {
        *last = 1.0;
    }
    parts
}

/// Checks that a picture has texels, and not too many.
pub fn check_size(width: usize, height: usize) -> Result<(), String> {
    match width.checked_mul(height) {
        Some(1..=MAX_TEXELS) => Ok(()),
        Some(_) | None => Err(format!("it has {width} x {height} texels, at most 2^26 are read")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn floats(width: usize, height: usize, channels: usize, samples: Vec<f32>) -> Picture {
        let samples = Samples::Floats(samples);
        Picture { width, height, channels, samples, encoding: Encoding::Srgb }
    }

    #[test]
    fn sums_rise_to_one() {
        let samples = (0..6).flat_map(|index| [index as f32, 1.0, 2.0]).collect();
        let (rows, columns) = floats(3, 2, 3, samples).sums(|_| 1.0);
        assert_eq!((rows.len(), columns.len()), (3, 8));
        assert!(
            rows.is_sorted() && columns[..4].is_sorted() && rows[2] == 1.0 && columns[3] == 1.0
        );
        let dark = floats(2, 2, 1, vec![0.0; 4]);
        assert_eq!(dark.sums(|_| 1.0).0, [0.0, 0.5, 1.0]);
    }

    #[test]
    fn full_opacity_is_dropped_and_other_opacity_stays() {
        let opaque = floats(2, 1, 4, vec![1.0, 2.0, 3.0, 1.0, 4.0, 5.0, 6.0, 1.0]);
        let expected = floats(2, 1, 3, vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(opaque.without_full_opacity(), expected);
        let partial = floats(1, 1, 4, vec![1.0, 2.0, 3.0, 0.5]);
        assert_eq!(partial.clone().without_full_opacity(), partial);
        assert_eq!(partial.components(&ByteCode::new(Encoding::Srgb), 0), [1.0, 2.0, 3.0, 0.5]);
        let grey = floats(1, 1, 1, vec![0.25]);
        assert_eq!(grey.colors().next(), Some([0.25; 3]));
    }
}
