//! Samplers: the distribution of a pixel's sample points.

use super::hash::{hash, permute, unit_float};
use super::sobol::{sobol_bits, sobol_pair_bits};

/// The kinds of sampler.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplerKind {
    /// Every number is independent.
    Independent,
    /// Each dimension of a pixel's samples has one number in each of as many strata.
    Stratified {
        /// True if numbers are uniform within their strata, false if they are in the middle.
        jitter: bool,
    },
    /// Owen-scrambled points of Sobol's sequence: each dimension, and each pair (2k, 2k + 1) of them, has one
    /// number in each elementary interval of a pixel's first 2^m samples.
    Sobol,
}

/// The sampler of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampler {
    /// Its kind.
    pub kind: SamplerKind,
    /// Columns of strata in a pixel.
    pub columns: u32,
    /// Rows of strata in a pixel.
    pub rows: u32,
    /// Selects one of many sequences.
    pub seed: u64,
}

/// The keys of the numbers of a pixel's samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelKeys {
    /// That of positions in the pixel.
    pub position: u32,
    /// That of positions on the lens.
    pub lens: u32,
    /// That of times.
    pub time: u32,
    /// That of the sequences of camera rays.
    pub stream: u32,
}

impl Sampler {
    /// Returns the number of samples per pixel.
    pub fn samples_per_pixel(&self) -> u32 {
        self.columns * self.rows
    }

    /// The least result of [`Sampler::part_of_pixel`]. Narrower filters do not improve the picture.
    pub const LEAST_PART_OF_PIXEL: f32 = 0.125;

    /// The fraction of a pixel's side that represents a sample, over which textures are filtered. Stratified samplers
    /// use the final number of samples. Other samplers use the number of samples up to this one: a sample must not
    /// depend on the number of samples after it, so that samples can be added to a picture.
    pub fn part_of_pixel(&self, sample: u32) -> f32 {
        let among = match self.kind {
            SamplerKind::Stratified { .. } => self.samples_per_pixel(),
            SamplerKind::Independent | SamplerKind::Sobol => sample.saturating_add(1),
        };
        (1.0 / (among as f32).sqrt()).max(Self::LEAST_PART_OF_PIXEL)
    }

    /// Returns the keys of a pixel's numbers.
    #[inline(always)]
    pub fn pixel_keys(&self, pixel: u32) -> PixelKeys {
        let key = |purpose: u32| self.key(pixel, purpose);
        PixelKeys { position: key(1), lens: key(2), time: key(4), stream: key(5) }
    }

    /// Returns the position of a sample in its pixel, in [0,1)^2, from dimensions reserved for it; `key` is
    /// [`PixelKeys::position`].
    pub fn pixel_position(&self, key: u32, sample: u32) -> [f32; 2] {
        self.position(key, sample)
    }

    /// Returns the position of a sample on the lens, in [0,1)^2, in an order unrelated to that in the pixel; `key` is
    /// [`PixelKeys::lens`].
    pub fn lens_position(&self, key: u32, sample: u32) -> [f32; 2] {
        let sample = match self.kind {
            // For independent numbers any order is good; Sobol's points are shuffled by themselves.
            SamplerKind::Independent | SamplerKind::Sobol => sample,
            SamplerKind::Stratified { .. } => {
                permute(sample, self.samples_per_pixel(), hash(key, 3))
            }
        };
        self.position(key, sample)
    }

    /// Returns the time of a sample within the shutter interval, in [0,1); `key` is [`PixelKeys::time`].
    pub fn time(&self, key: u32, sample: u32) -> f32 {
        match self.kind {
            SamplerKind::Sobol => unit_float(sobol_bits(key, 0, sample)),
            _ => self.number_of_key(key, sample),
        }
    }

    /// Returns a number of a ray's sequence.
    pub fn number(&self, key: u32, dimension: u32, sample: u32) -> f32 {
        match self.kind {
            SamplerKind::Sobol => {
                unit_float(sobol_bits(hash(key, dimension >> 1), dimension & 1, sample))
            }
            _ => self.number_of_key(hash(key, dimension), sample),
        }
    }

    /// Returns the numbers 2 `pair` and 2 `pair` + 1 of a ray's sequence, faster than one by one.
    pub fn pair(&self, key: u32, pair: u32, sample: u32) -> [f32; 2] {
        if self.kind == SamplerKind::Sobol {
            return sobol_pair_bits(hash(key, pair), sample).map(unit_float);
        }
        let first = pair.wrapping_mul(2);
        [first, first.wrapping_add(1)].map(|dimension| self.number(key, dimension, sample))
    }

    #[inline(always)]
    fn key(&self, pixel: u32, purpose: u32) -> u32 {
        hash(hash(self.folded_seed(), pixel), purpose)
    }

    #[inline(always)]
    fn folded_seed(&self) -> u32 {
        hash((self.seed >> 32) as u32, self.seed as u32)
    }

    #[inline(always)]
    fn is_jittered(&self) -> bool {
        match self.kind {
            SamplerKind::Independent | SamplerKind::Sobol => true,
            SamplerKind::Stratified { jitter } => jitter,
        }
    }

    /// The number of a sample by the key of a dimension, unless the sampler is Sobol's.
    fn number_of_key(&self, key: u32, sample: u32) -> f32 {
        let random = unit_float(hash(key, sample));
        if self.kind == SamplerKind::Independent {
            return random;
        }
        let stratum = permute(sample, self.samples_per_pixel(), hash(key, u32::MAX));
        let within = if self.is_jittered() { random } else { 0.5 };
        below_one((stratum as i32 as f32 + within) / self.samples_per_pixel() as f32)
    }

    fn position(&self, key: u32, sample: u32) -> [f32; 2] {
        if self.kind == SamplerKind::Sobol {
            return sobol_pair_bits(key, sample).map(unit_float);
        }
        let random = [unit_float(hash(key, sample << 1)), unit_float(hash(key, sample << 1 | 1))];
        if self.kind == SamplerKind::Independent {
            return random;
        }
        let within = if self.is_jittered() { random } else { [0.5; 2] };
        let column = (sample % self.columns) as f32;
        let row = (sample / self.columns) as f32;
        [
            below_one((column + within[0]) / self.columns as f32),
            below_one((row + within[1]) / self.rows as f32),
        ]
    }
}

/// Rounding may give 1, which is outside the range.
#[inline(always)]
fn below_one(x: f32) -> f32 {
    if x < 1.0 { x } else { 1.0_f32.next_down() }
}

/// Returns the key of the sequence of the ray that another one spawned as its `child`th.
#[inline(always)]
pub fn child_key(key: u32, child: u32) -> u32 {
    hash(hash(key, u32::MAX), child)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STRATIFIED: Sampler =
        Sampler { kind: SamplerKind::Stratified { jitter: true }, columns: 4, rows: 4, seed: 0 };

    #[test]
    fn each_stratum_has_one_sample() {
        for dimension in 0..8 {
            let mut strata: Vec<usize> = (0..16)
                .map(|sample| {
                    let key = STRATIFIED.pixel_keys(11).stream;
                    let number = STRATIFIED.number(key, dimension, sample);
                    (number * 16.0) as usize
                })
                .collect();
            strata.sort_unstable();
            assert_eq!(strata, (0..16).collect::<Vec<_>>());
        }
    }

    #[test]
    fn what_samples_stand_for_depends_on_no_later_ones() {
        for kind in [SamplerKind::Independent, SamplerKind::Sobol] {
            let few = Sampler { kind, ..STRATIFIED };
            let many = Sampler { kind, columns: 16, rows: 9, seed: 0 };
            let parts = |sampler: &Sampler| [0, 3, 15].map(|sample| sampler.part_of_pixel(sample));
            assert_eq!(parts(&few), [1.0, 0.5, 0.25]);
            assert_eq!(parts(&few), parts(&many));
            assert_eq!(many.part_of_pixel(143), 0.125);
        }
        assert_eq!(STRATIFIED.part_of_pixel(0), 0.25);
    }

    #[test]
    fn positions_fill_the_grid() {
        let mut cells: Vec<usize> = (0..16)
            .map(|sample| {
                let [x, y] = STRATIFIED.lens_position(STRATIFIED.pixel_keys(3).lens, sample);
                (y * 4.0) as usize * 4 + (x * 4.0) as usize
            })
            .collect();
        cells.sort_unstable();
        assert_eq!(cells, (0..16).collect::<Vec<_>>());
    }
}
