//! The results of samples.

use std::ops::Range;

use super::features::{FeatureValues, Features, FirstHit};

/// The results of successive samples of some tiles, tile by tile and pixel by pixel, in the order of
/// [`TileSamples`](crate::schedule::tile_samples::TileSamples).
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// The radiance of each, channel by channel; black outside the image.
    pub radiance: [Vec<f32>; 3],
    /// The features of each, as far as they are kept.
    pub features: FeatureValues,
}

/// The results of a tile's samples among them.
#[derive(Clone, Copy, Debug)]
pub struct TileResults<'a> {
    /// The radiance of each, channel by channel; black outside the image.
    pub radiance: [&'a [f32]; 3],
    /// The first hit of each, if these are kept; else empty.
    pub first_hits: &'a [FirstHit],
    /// The components of the outputs, sample by sample.
    pub outputs: &'a [f32],
}

impl Samples {
    /// Returns the results of the samples of a tile, which have these places.
    pub fn of_tile(&self, places: Range<usize>) -> TileResults<'_> {
        let FeatureValues { first_hits, outputs } = &self.features;
        let components = outputs.len() / self.radiance[0].len().max(1);
        TileResults {
            first_hits: first_hits.get(places.clone()).unwrap_or_default(),
            outputs: &outputs[places.start * components..places.end * components],
            radiance: self.radiance.each_ref().map(|channel| &channel[places.clone()]),
        }
    }

    /// Makes room for this number of samples, without results.
    pub fn reset(&mut self, count: usize, features: Option<&Features>) {
        for channel in &mut self.radiance {
            channel.clear();
            channel.resize(count, 0.0);
        }
        self.features.reset(count, features);
    }
}

impl TileResults<'_> {
    /// Returns a copy.
    pub fn to_samples(self) -> Samples {
        let (first_hits, outputs) = (self.first_hits.to_vec(), self.outputs.to_vec());
        let features = FeatureValues { first_hits, outputs };
        Samples { radiance: self.radiance.map(<[f32]>::to_vec), features }
    }
}

impl<'a> From<&'a Samples> for TileResults<'a> {
    fn from(Samples { radiance, features }: &'a Samples) -> Self {
        let FeatureValues { first_hits, outputs } = features;
        let radiance = radiance.each_ref().map(|channel| &channel[..]);
        TileResults { radiance, first_hits, outputs }
    }
}
