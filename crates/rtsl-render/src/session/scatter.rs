//! The variation of samples within pixels, from which the tiles that need more samples are selected.

use rtsl_bvh::{LANES, Lanes, lanes_of};

use super::tile_sample::TileSample;

/// Sums over the samples of a tile.
#[derive(Clone, Copy, Debug)]
pub struct Scatter {
    /// The sum of each pixel's brightness.
    brightness: Lanes,
    /// The sum of its squares.
    squares: Lanes,
}

impl Scatter {
    /// Without samples.
    pub const NONE: Scatter = Scatter { brightness: [0.0; LANES], squares: [0.0; LANES] };

    /// Adds a sample, displayed with its colours multiplied by `scale`.
    pub fn add(&mut self, sample: &TileSample, scale: f32) {
        // Brighter values are displayed alike, and are clamped so that a few of them do not dominate.
        const BRIGHTEST: f32 = 2.0;
        for lane in lanes_of(sample.lanes) {
            let [r, g, b] = [0, 1, 2].map(|channel: usize| sample.colors[channel][lane]);
            let brightness = (r + g + b) / 3.0 * scale;
            // NaN counts as black.
            let brightness = if brightness > 0.0 { brightness.min(BRIGHTEST) } else { 0.0 };
            self.brightness[lane] += brightness;
            self.squares[lane] += brightness * brightness;
        }
    }

    /// Returns the variance of the mean of `taken` samples, averaged over all pixels and divided by the mean, because
    /// perception is relative. 0 while it is unknown.
    pub fn error(&self, taken: u32) -> f32 {
        const BLACK: f32 = 0.02;
        let count = taken as f32;
        let of_lane = |(sum, squares): (&f32, &f32)| {
            let mean = sum / count;
            let variance = (squares / count - mean * mean).max(0.0) / (count - 1.0);
            variance / (mean + BLACK)
        };
        match taken {
            0 | 1 => 0.0,
            _ => self.brightness.iter().zip(&self.squares).map(of_lane).sum(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scatter(samples: &[f32]) -> f32 {
        let mut scatter = Scatter::NONE;
        for value in samples {
            scatter.add(&TileSample { lanes: 0xFF, colors: [[*value; LANES]; 3] }, 1.0);
        }
        scatter.error(samples.len() as u32)
    }

    #[test]
    fn errors_are_larger_where_samples_differ_and_there_are_few() {
        assert_eq!(scatter(&[0.5]), 0.0);
        assert_eq!(scatter(&[0.5; 4]), 0.0);
        assert!(scatter(&[0.4, 0.6]) > 0.0);
        assert!(scatter(&[0.2, 0.8]) > scatter(&[0.4, 0.6]));
        assert!(scatter(&[0.4, 0.6]) > scatter(&[0.4, 0.6, 0.4, 0.6]));
        assert!(scatter(&[0.01, 0.21]) > scatter(&[0.8, 1.0]), "the same step in the dark");
        assert_eq!(scatter(&[9.0, 12.0]), 0.0, "both are white");
        assert_eq!(scatter(&[f32::NAN, 0.0]), 0.0);
    }
}
