//! The results of samples.

use std::ops::Range;

use super::features::PathFeatures;

/// The results of successive samples of some tiles, tile by tile and pixel by pixel, in the order of
/// [`TileSamples`](crate::tiles::TileSamples).
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// The radiance of each; black outside the image.
    pub radiance: Vec<[f32; 3]>,
    /// The features of each, if they are needed; else empty.
    pub features: Vec<PathFeatures>,
}

/// The results of a tile's samples among them.
#[derive(Clone, Copy, Debug)]
pub struct TileResults<'a> {
    /// The radiance of each; black outside the image.
    pub radiance: &'a [[f32; 3]],
    /// The features of each, if they are needed; else empty.
    pub features: &'a [PathFeatures],
}

impl Samples {
    /// Returns the results of the samples of a tile, which have these places.
    pub fn of_tile(&self, places: Range<usize>) -> TileResults<'_> {
        let features = self.features.get(places.clone()).unwrap_or_default();
        TileResults { radiance: &self.radiance[places], features }
    }

    /// Makes room for this number of samples, without results.
    pub fn reset(&mut self, count: usize, with_features: bool) {
        self.radiance.clear();
        self.radiance.resize(count, [0.0; 3]);
        self.features.clear();
        self.features.resize(if with_features { count } else { 0 }, PathFeatures::NONE);
    }
}

impl TileResults<'_> {
    /// Returns a copy.
    pub fn to_samples(self) -> Samples {
        Samples { radiance: self.radiance.to_vec(), features: self.features.to_vec() }
    }
}

impl<'a> From<&'a Samples> for TileResults<'a> {
    fn from(Samples { radiance, features }: &'a Samples) -> Self {
        TileResults { radiance, features }
    }
}
