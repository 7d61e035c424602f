//! Images of AOVs, and their display.

use rtsl_memory::{OutOfMemory, collected, filled};

use super::{Aov, AovType, HeatScale, SrgbEncoder, logarithm};

/// An image of an AOV.
#[derive(Clone, Debug, PartialEq)]
pub struct AovImage {
    /// The AOV.
    pub aov: Aov,
    /// The type of its values.
    pub ty: AovType,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The channels of each pixel, row by row from the top.
    pub values: Vec<f32>,
}

impl AovImage {
    /// Creates an image of zeros.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn new(aov: Aov, ty: AovType, width: usize, height: usize) -> Result<Self, OutOfMemory> {
        let values = filled(width.saturating_mul(height).saturating_mul(ty.channels()), 0.0)?;
        Ok(AovImage { aov, ty, width, height, values })
    }

    /// Returns the channels of each pixel, row by row from the top.
    pub fn pixels(&self) -> std::slice::ChunksExact<'_, f32> {
        self.values.chunks_exact(self.ty.channels())
    }

    /// Returns the channels of the pixel with this index.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn pixel(&self, index: usize) -> &[f32] {
        let channels = self.ty.channels();
        &self.values[index * channels..][..channels]
    }

    /// Returns the channels of the pixel with this index, to change them.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn pixel_mut(&mut self, index: usize) -> &mut [f32] {
        let channels = self.ty.channels();
        &mut self.values[index * channels..][..channels]
    }

    /// Returns the pixels if they have three channels of real numbers each, as albedo and normals have for a denoiser.
    pub fn triples(&self) -> Option<&[[f32; 3]]> {
        let has_three = matches!(self.ty, AovType::Color | AovType::Vector(3));
        has_three.then(|| self.values.as_chunks().0)
    }

    /// Converts the image to displayable sRGB bytes.
    ///
    /// The renderer's quantities of any magnitude are shown by their logarithms on the heat scale, and fractions of
    /// lanes on the heat scale. All others are shown by their type: colours directly; numbers on the heat scale; vectors
    /// of three as colours of their components, from -1 to 1; other vectors by their length on the heat scale; truth
    /// values as black and white; whole numbers in distinct colours.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn to_srgb(&self) -> Result<Vec<u8>, OutOfMemory> {
        match self.aov {
            Aov::Distance | Aov::Samples | Aov::Variance | Aov::Time | Aov::Nodes => {
                self.heat(|pixel| pixel[0], logarithm)
            }
            Aov::Lanes => {
                let scale = HeatScale::new();
                self.shown(|pixel| scale.color(pixel[0]))
            }
            Aov::Albedo | Aov::Normal | Aov::Object | Aov::Class | Aov::Output(_) => {
                self.shown_by_type()
            }
        }
    }

    fn shown_by_type(&self) -> Result<Vec<u8>, OutOfMemory> {
        let encoder = SrgbEncoder::new();
        match self.ty {
            AovType::Color => {
                collected(self.values.len(), self.values.iter().map(|x| encoder.encode(*x)))
            }
            AovType::Vector(3) => {
                let shown = self.values.iter().map(|x| encoder.encode(0.5 * x + 0.5));
                collected(self.values.len(), shown)
            }
            AovType::Float => self.heat(|pixel| pixel[0], |value| value),
            AovType::Vector(_) => self.heat(length, |value| value),
            AovType::Bool => self.shown(|pixel| [if pixel[0] > 0.0 { 255 } else { 0 }; 3]),
            AovType::Integer | AovType::IntegerVector(_) => self.shown(color_of),
        }
    }

    /// Maps each pixel to a colour.
    fn shown(&self, color: impl Fn(&[f32]) -> [u8; 3]) -> Result<Vec<u8>, OutOfMemory> {
        let pixels = self.pixels();
        collected(3 * pixels.len(), pixels.flat_map(color))
    }

    /// Maps the numbers of pixels to the heat scale, after they are `transformed`. The ends of the scale are the first
    /// and the last percentile, because outliers may be extreme.
    fn heat(
        &self,
        number: impl Fn(&[f32]) -> f32,
        transformed: impl Fn(f32) -> f32,
    ) -> Result<Vec<u8>, OutOfMemory> {
        let count = self.pixels().len();
        let finite = self.pixels().map(&number).filter(|value| value.is_finite());
        let mut sorted: Vec<f32> = collected(count, finite.map(&transformed))?;
        // Unstable sorting is deterministic here, because equal numbers are identical.
        sorted.sort_unstable_by(f32::total_cmp);
        let spare = sorted.len() / 100;
        let (Some(least), Some(greatest)) = (sorted.get(spare), sorted.iter().nth_back(spare))
        else {
            return filled(3 * count, 0);
        };
        let scale = HeatScale::new();
        let width = (greatest - least).max(f32::MIN_POSITIVE);
        self.shown(|pixel| scale.color((transformed(number(pixel)) - least) / width))
    }
}

fn length(vector: &[f32]) -> f32 {
    vector.iter().map(|component| component * component).sum::<f32>().sqrt()
}

/// A colour for whole numbers; black if all are negative.
fn color_of(numbers: &[f32]) -> [u8; 3] {
    if numbers.iter().all(|number| *number < 0.0) {
        return [0; 3];
    }
    let mix = |seed, number: &f32| rtsl_math::sampling::hash(*number as i64 as u32, seed);
    let bits = numbers.iter().fold(0, mix);
    // Bright enough to be distinct from black.
    [0, 8, 16].map(|shift| 64 + (bits >> shift) as u8 % 192)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(aov: Aov, ty: AovType, values: &[f32]) -> Vec<u8> {
        let (width, values) = (values.len() / ty.channels(), values.to_vec());
        AovImage { aov, ty, width, height: 1, values }.to_srgb().unwrap()
    }

    fn output(ty: AovType, values: &[f32]) -> Vec<u8> {
        image(Aov::from_name("output"), ty, values)
    }

    #[test]
    fn the_heat_scale_spans_what_is_finite() {
        let scale = HeatScale::new();
        let shown = image(Aov::Distance, AovType::Float, &[0.5, f32::INFINITY, 8.0, 2.0]);
        assert_eq!(shown[0..3], scale.color(0.0));
        assert_eq!(shown[3..6], scale.color(1.0));
        assert_eq!(shown[6..9], scale.color(1.0));
        assert_eq!(shown[9..12], scale.color(0.5));
        // A quarter of the way from 2^4 to 2^8.
        let time = image(Aov::Time, AovType::Float, &[16.0, 256.0, 32.0]);
        assert_eq!(time[6..9], scale.color(0.25));
        assert_eq!(image(Aov::Distance, AovType::Float, &[f32::INFINITY]), [0; 3]);
    }

    #[test]
    fn what_lies_far_out_does_not_spread_the_scale() {
        let mut values = vec![1.0; 150];
        values.extend([4.0; 149]);
        values.push(1e30);
        let shown = image(Aov::Distance, AovType::Float, &values);
        assert_eq!(shown[3 * 200..3 * 201], HeatScale::new().color(1.0));
    }

    #[test]
    fn outputs_are_shown_by_their_type() {
        let scale = HeatScale::new();
        // Numbers may be zero or negative, so their scale is linear.
        let shown = output(AovType::Float, &[-2.0, 2.0, 1.0]);
        assert_eq!(shown[0..3], scale.color(0.0));
        assert_eq!(shown[3..6], scale.color(1.0));
        assert_eq!(shown[6..9], scale.color(0.75));
        let lengths = output(AovType::Vector(2), &[0.0, 0.0, 3.0, 4.0]);
        assert_eq!(lengths, [scale.color(0.0), scale.color(1.0)].concat());
        assert_eq!(output(AovType::Vector(3), &[-1.0, 1.0, -3.0]), [0, 255, 0]);
        assert_eq!(output(AovType::Color, &[0.0, 1.0, 7.0]), [0, 255, 255]);
        assert_eq!(output(AovType::Bool, &[0.0, 1.0]), [0, 0, 0, 255, 255, 255]);
        let cells = output(AovType::IntegerVector(2), &[0.0, 1.0, 1.0, 0.0]);
        assert_ne!(cells[..3], cells[3..]);
    }

    #[test]
    fn numbers_have_colors_of_their_own() {
        assert_eq!(color_of(&[-1.0]), [0; 3]);
        assert_ne!(color_of(&[0.0]), color_of(&[1.0]));
    }
}
