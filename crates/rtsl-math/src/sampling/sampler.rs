//! Samplers: the distribution of a pixel's sample points.

use super::hash::hash;

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

impl Sampler {
    /// Returns the number of samples per pixel.
    pub fn samples_per_pixel(&self) -> u32 {
        self.columns * self.rows
    }
}

/// Returns the key of the sequence of the ray that another one spawned as its `child`th.
#[inline(always)]
pub fn child_key(key: u32, child: u32) -> u32 {
    hash(hash(key, u32::MAX), child)
}
