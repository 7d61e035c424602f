//! The results of a tile's samples.

use super::features::PathFeatures;

/// The results of successive samples of a tile's pixels, pixel by pixel, in the order of
/// [`TileSamples`](crate::tiles::TileSamples).
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// The radiance of each; black outside the image.
    pub radiance: Vec<[f32; 3]>,
    /// The features of each, if they are needed; else empty.
    pub features: Vec<PathFeatures>,
}

impl Samples {
    /// Makes room for this number of samples, without results.
    pub fn reset(&mut self, count: usize, with_features: bool) {
        self.radiance.clear();
        self.radiance.resize(count, [0.0; 3]);
        self.features.clear();
        self.features.resize(if with_features { count } else { 0 }, PathFeatures::NONE);
    }
}
