//! Pixel features: the first hits of paths, and outputs of the integrator.

use std::ops::Range;
use std::sync::Arc;

use rtsl_bvh::LANES;
use rtsl_image::AovType;
use rtsl_memory::{Amount, OutOfMemory, reserved};

/// The features that a film keeps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// True if it keeps distances and objects of first hits.
    pub first_hits: bool,
    /// The outputs, sorted by name.
    outputs: Vec<KeptOutput>,
}

/// An output that is kept.
#[derive(Clone, Debug, PartialEq)]
pub struct KeptOutput {
    /// The name.
    pub name: Arc<str>,
    /// The type.
    pub ty: AovType,
    /// The index of its first component among those of all outputs.
    first: usize,
}

impl KeptOutput {
    /// The places of its components among those of all outputs.
    pub fn components(&self) -> Range<usize> {
        self.first..self.first + self.ty.channels()
    }
}

impl Features {
    /// Features with these outputs.
    pub fn new(first_hits: bool, outputs: impl IntoIterator<Item = (Arc<str>, AovType)>) -> Self {
        let mut outputs: Vec<KeptOutput> =
            outputs.into_iter().map(|(name, ty)| KeptOutput { name, ty, first: 0 }).collect();
        outputs.sort_by(|one, other| one.name.cmp(&other.name));
        outputs.dedup_by(|one, other| one.name == other.name);
        let mut first = 0;
        for output in &mut outputs {
            output.first = first;
            first += output.ty.channels();
        }
        Features { first_hits, outputs }
    }

    /// The outputs, sorted by name.
    pub fn outputs(&self) -> &[KeptOutput] {
        &self.outputs
    }

    /// Returns the output of this name.
    pub fn output(&self, name: &str) -> Option<&KeptOutput> {
        self.outputs.iter().find(|output| *output.name == *name)
    }

    /// The number of components of all outputs.
    pub fn components(&self) -> usize {
        self.outputs.last().map_or(0, |last| last.components().end)
    }

    /// True if nothing is kept.
    pub fn is_empty(&self) -> bool {
        !self.first_hits && self.outputs.is_empty()
    }

    /// The memory of the sums of so many tiles.
    pub fn memory(&self, tiles: usize) -> Amount {
        let hits = if self.first_hits { tiles } else { 0 };
        Amount::of::<FirstHitSums>(hits) + Amount::of::<f64>(LANES * self.components()).times(tiles)
    }

    /// Tests that there is room for the sums of so many tiles, each of which is allocated separately.
    ///
    /// # Errors
    /// If there is not.
    pub fn check_room(&self, tiles: usize) -> Result<(), OutOfMemory> {
        let hits = reserved::<FirstHitSums>(if self.first_hits { tiles } else { 0 })?;
        let outputs = reserved::<f64>(tiles.saturating_mul(LANES * self.components()))?;
        drop((hits, outputs));
        Ok(())
    }

    /// Adds the outputs of successive samples of a pixel to the pixel's sums, component by component. Values that are
    /// not means are those of the first sample.
    pub fn add_outputs(&self, sums: &mut [f64], samples: &[f32], are_first: bool) {
        for output in &self.outputs {
            for component in output.components() {
                if output.ty.is_mean() {
                    let values = samples.iter().skip(component).step_by(self.components());
                    let finite = values.filter(|value| value.is_finite());
                    finite.for_each(|value| sums[component] += f64::from(*value));
                } else if are_first && let Some(first) = samples.get(component) {
                    sums[component] = f64::from(*first);
                }
            }
        }
    }

    /// Adds sums of outputs, pixel by pixel, to those of the samples before. Values that are not means are those of the
    /// first sample.
    pub fn append_outputs(&self, sums: &mut [f64], later: &[f64], are_first: bool) {
        let Some(components) = Some(self.components()).filter(|count| *count > 0) else { return };
        for (sums, later) in sums.chunks_exact_mut(components).zip(later.chunks_exact(components)) {
            for output in &self.outputs {
                for component in output.components() {
                    if output.ty.is_mean() {
                        sums[component] += later[component];
                    } else if are_first {
                        sums[component] = later[component];
                    }
                }
            }
        }
    }
}

/// The first surface of a path.
#[derive(Clone, Copy, Debug)]
pub struct FirstHit {
    /// The distance; infinite without a hit.
    pub distance: f32,
    /// The index of the object; -1 without a hit.
    pub object: f32,
}

impl FirstHit {
    /// Without a hit.
    pub const NONE: FirstHit = FirstHit { distance: f32::INFINITY, object: -1.0 };
}

impl From<Option<(f32, f32)>> for FirstHit {
    fn from(hit: Option<(f32, f32)>) -> Self {
        hit.map_or(FirstHit::NONE, |(distance, object)| FirstHit { distance, object })
    }
}

/// The features of successive samples.
#[derive(Clone, Debug, Default)]
pub struct FeatureValues {
    /// The first hit of each, if these are kept; else empty.
    pub first_hits: Vec<FirstHit>,
    /// The components of the outputs, sample by sample.
    pub outputs: Vec<f32>,
}

impl FeatureValues {
    /// Makes room for the features of so many samples, without hits and with outputs of 0. Without features nothing is
    /// kept.
    pub fn reset(&mut self, count: usize, features: Option<&Features>) {
        self.first_hits.clear();
        self.outputs.clear();
        let Some(features) = features else { return };
        self.first_hits.resize(if features.first_hits { count } else { 0 }, FirstHit::NONE);
        self.outputs.resize(count * features.components(), 0.0);
    }
}

/// Sums of the first hits of a tile's samples.
#[derive(Clone, Debug)]
pub struct FirstHitSums {
    /// The sums of distances over samples with a hit.
    pub distance: [f64; LANES],
    /// The number of samples with a hit.
    pub hits: [u32; LANES],
    /// The object of the first sample.
    pub object: [f32; LANES],
}

impl FirstHitSums {
    /// Without samples.
    pub const NONE: FirstHitSums =
        FirstHitSums { distance: [0.0; LANES], hits: [0; LANES], object: [-1.0; LANES] };

    /// Adds the sums of the samples that follow.
    pub fn append(&mut self, later: &FirstHitSums, are_first: bool) {
        for pixel in 0..LANES {
            self.distance[pixel] += later.distance[pixel];
            self.hits[pixel] += later.hits[pixel];
            if are_first {
                self.object[pixel] = later.object[pixel];
            }
        }
    }

    /// Adds the first hits of successive samples of the pixel of a lane.
    pub fn add(&mut self, lane: usize, samples: &[FirstHit], are_first: bool) {
        for FirstHit { distance, .. } in samples.iter().filter(|hit| hit.distance.is_finite()) {
            self.distance[lane] += f64::from(*distance);
            self.hits[lane] += 1;
        }
        if let (true, Some(first)) = (are_first, samples.first()) {
            self.object[lane] = first.object;
        }
    }
}
