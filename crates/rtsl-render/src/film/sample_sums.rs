//! Sums of the samples of a tile's pixels, sixteen pixels at a time.
//!
//! The samples of a pixel are added in ascending order, each to the sum of those before, so that sums have the same
//! bits however many samples come together. The pixels of a vector add theirs side by side. One pixel after another,
//! sums and the radiance before them took 5 % of the time of a simple scene (Zen 5). They are sums of 64 bits, which
//! the language does not have, so no stage computes them.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, f64x8};
use rtsl_bvh::LANES;

/// The number of pixels in a vector of samples, and of samples that are loaded together.
const VECTOR: usize = 16;

/// The sums of the pixels of a tile.
#[derive(Clone, Debug)]
pub struct SampleSums {
    /// For each channel and pixel the sum of the samples.
    channels: [[f64; LANES]; 3],
    /// For each pixel the sum of the squared luminances of its samples.
    pub squares: [f64; LANES],
}

/// The sums of sixteen pixels: the channels, then the squared luminances; each in two vectors.
type VectorSums<S> = [[f64x8<S>; 2]; 4];

impl SampleSums {
    /// No samples.
    pub const NONE: SampleSums = SampleSums { channels: [[0.0; LANES]; 3], squares: [0.0; LANES] };

    /// Returns the sum of a pixel's samples.
    pub fn color(&self, pixel: usize) -> [f64; 3] {
        self.channels.map(|channel| channel[pixel])
    }

    /// Sets the sum of a pixel's samples.
    pub fn set_color(&mut self, pixel: usize, color: [f64; 3]) {
        for (sums, sum) in self.channels.iter_mut().zip(color) {
            sums[pixel] = sum;
        }
    }

    /// Adds a sample of a pixel.
    pub fn add(&mut self, pixel: usize, color: [f32; 3]) {
        let color = color.map(f64::from);
        for (sums, channel) in self.channels.iter_mut().zip(color) {
            sums[pixel] += channel;
        }
        let luminance = luminance(color);
        self.squares[pixel] += luminance * luminance;
    }

    /// Adds `count` samples of each pixel, channel by channel, whose samples are adjacent.
    pub fn add_all(&mut self, channels: [&[f32]; 3], count: usize) {
        dispatch!(Level::new(), simd => self.add_vectors(simd, channels, count));
    }

    #[inline(always)]
    fn add_vectors<S: Simd>(&mut self, simd: S, channels: [&[f32]; 3], count: usize) {
        match count {
            1 => self.add_adjacent::<S, 1>(simd, channels, count),
            2 => self.add_adjacent::<S, 2>(simd, channels, count),
            4 => self.add_adjacent::<S, 4>(simd, channels, count),
            8 => self.add_adjacent::<S, 8>(simd, channels, count),
            _ if count.is_multiple_of(16) => self.add_adjacent::<S, 16>(simd, channels, count),
            _ => self.add_apart(simd, channels, count),
        }
    }

    /// Adds samples of which so many of a pixel are loaded together.
    // Loops, because calls of closures by iterators leave the code for vectors.
    #[inline(always)]
    fn add_adjacent<S: Simd, const TOGETHER: usize>(
        &mut self,
        simd: S,
        channels: [&[f32]; 3],
        count: usize,
    ) {
        for first in (0..LANES).step_by(VECTOR) {
            let mut sums = self.load(simd, first);
            for start in (0..count).step_by(TOGETHER) {
                let mut samples = [[f32x16::splat(simd, 0.0); TOGETHER]; 3];
                for (samples, channel) in samples.iter_mut().zip(channels) {
                    let of_pixels = &channel[first * count..][..VECTOR * count];
                    load_together(simd, of_pixels, start, count, samples);
                }
                let [red, green, blue] = &samples;
                for sample in 0..TOGETHER {
                    add(simd, &mut sums, [red[sample], green[sample], blue[sample]]);
                }
            }
            self.store(first, &sums);
        }
    }

    /// Adds any number of samples, loaded one by one.
    #[inline(always)]
    fn add_apart<S: Simd>(&mut self, simd: S, channels: [&[f32]; 3], count: usize) {
        for first in (0..LANES).step_by(VECTOR) {
            let mut sums = self.load(simd, first);
            for sample in 0..count {
                let mut samples = [f32x16::splat(simd, 0.0); 3];
                for (samples, channel) in samples.iter_mut().zip(channels) {
                    let of_pixels = &channel[first * count..][..VECTOR * count];
                    *samples = f32x16::from_fn(simd, |pixel| of_pixels[pixel * count + sample]);
                }
                add(simd, &mut sums, samples);
            }
            self.store(first, &sums);
        }
    }

    #[inline(always)]
    fn load<S: Simd>(&self, simd: S, first: usize) -> VectorSums<S> {
        let [red, green, blue] = &self.channels;
        let mut sums = [[f64x8::splat(simd, 0.0); 2]; 4];
        for (halves, numbers) in sums.iter_mut().zip([red, green, blue, &self.squares]) {
            let numbers = numbers[first..][..VECTOR].chunks_exact(VECTOR / 2);
            for (half, numbers) in halves.iter_mut().zip(numbers) {
                *half = f64x8::from_slice(simd, numbers);
            }
        }
        sums
    }

    #[inline(always)]
    fn store<S: Simd>(&mut self, first: usize, sums: &VectorSums<S>) {
        let [red, green, blue] = &mut self.channels;
        for (numbers, halves) in [red, green, blue, &mut self.squares].into_iter().zip(sums) {
            let numbers = numbers[first..][..VECTOR].chunks_exact_mut(VECTOR / 2);
            for (numbers, half) in numbers.zip(halves) {
                half.store_slice(numbers);
            }
        }
    }
}

/// Adds a sample of each of sixteen pixels.
#[inline(always)]
fn add<S: Simd>(simd: S, sums: &mut VectorSums<S>, [red, green, blue]: [f32x16<S>; 3]) {
    let (red, green, blue) = (red.widen(), green.widen(), blue.widen());
    let halves = [[red.0, green.0, blue.0], [red.1, green.1, blue.1]];
    for (half, [red, green, blue]) in halves.into_iter().enumerate() {
        sums[0][half] += red;
        sums[1][half] += green;
        sums[2][half] += blue;
        let factor = |channel: usize| f64x8::splat(simd, LUMINANCE[channel]);
        let luminance = factor(0) * red + factor(1) * green + factor(2) * blue;
        sums[3][half] += luminance * luminance;
    }
}

/// Loads the samples from `start` on, of `count` of each of sixteen pixels, as those of all pixels, sample by sample.
/// The number of samples is a power of two, and either `count` or 16.
#[inline(always)]
fn load_together<S: Simd, const TOGETHER: usize>(
    simd: S,
    channel: &[f32],
    start: usize,
    count: usize,
    rows: &mut [f32x16<S>; TOGETHER],
) {
    // A row of fewer than 16 samples of a pixel has samples of several pixels.
    let stride = if TOGETHER == VECTOR { count } else { VECTOR };
    for (row, samples) in rows.iter_mut().enumerate() {
        *samples = f32x16::from_slice(simd, &channel[row * stride + start..][..VECTOR]);
    }
    // A sample's place has the bits of its pixel, then those of its number. Each step moves the first of them to the
    // end, until those of the pixel are there.
    for _ in 0..if TOGETHER > 1 { VECTOR.ilog2() } else { 0 } {
        let last = *rows;
        for pair in 0..TOGETHER / 2 {
            let (even, odd) = last[pair].interleave(last[pair + TOGETHER / 2]);
            (rows[2 * pair], rows[2 * pair + 1]) = (even, odd);
        }
    }
}

/// The factors of Rec. 709 luminance.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Returns the Rec. 709 luminance.
pub fn luminance([red, green, blue]: [f64; 3]) -> f64 {
    LUMINANCE[0] * red + LUMINANCE[1] * green + LUMINANCE[2] * blue
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_of_pixels_have_the_sums_of_single_ones() {
        for count in [1, 2, 3, 4, 8, 16, 32, 37] {
            let number = |index: usize| {
                let bits = (index as u32).wrapping_mul(0x9E37_79B9) >> 9;
                f32::from_bits(0x3F80_0000 | bits) * [1e-3, 1.0, 1e4][index % 3]
            };
            let channels: [Vec<f32>; 3] = std::array::from_fn(|channel| {
                (0..LANES * count).map(|sample| number(3 * sample + channel)).collect()
            });
            let (mut together, mut singly) = (SampleSums::NONE, SampleSums::NONE);
            for _ in 0..2 {
                together.add_all(channels.each_ref().map(|it| &it[..]), count);
                for (sample, red) in channels[0].iter().enumerate() {
                    let color = [*red, channels[1][sample], channels[2][sample]];
                    singly.add(sample / count, color);
                }
            }
            assert_eq!(together.channels, singly.channels, "{count}");
            assert_eq!(together.squares, singly.squares, "{count}");
        }
    }
}
