//! The film of the path renderer: sums over samples, tile by tile.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rtsl_bvh::{LANES, lanes_of};
use rtsl_image::{Aov, AovImage, AovType, Image};
use rtsl_memory::{Amount, OutOfMemory, reserved};
use rtsl_scene::Imaging;

use super::features::{Features, FirstHitSums};
use super::sample_sums::{SampleSums, luminance};
use super::samples::{Samples, TileResults};
use crate::integrate::rows::{all_finite, are_finite};
use crate::integrate::wavefront::SAMPLES_IN_WAVEFRONT;
use crate::schedule::tile::{TILE, Tile, tiles_of};
use crate::statistics::LaneUse;

/// A film. Each tile has a separate lock.
pub struct SampleFilm {
    width: usize,
    height: usize,
    tiles: Vec<Tile>,
    records: Vec<Mutex<TileRecord>>,
    features: Features,
    /// The noise at which a tile needs no more samples.
    noise_target: Option<f32>,
    imaging: Imaging,
    /// The index of the first sample of each pixel.
    first: u32,
}

/// The state of a tile.
#[derive(Clone, Debug)]
pub struct TileRecord {
    /// The sums of the pixels' samples.
    pub sums: SampleSums,
    /// The sums of first hits, if these are kept.
    pub first_hits: Option<Box<FirstHitSums>>,
    /// The sums of the components of outputs, pixel by pixel.
    pub outputs: Vec<f64>,
    /// The index of the first sample of each pixel; that of the picture's unless the film has a part of them.
    first: u32,
    /// The index after the last sample of each pixel.
    pub taken: u32,
    /// The number of samples that were not finite and count as black.
    pub dropped: u64,
    /// The time for its samples.
    pub time: Duration,
    /// The work for its samples, if it is counted.
    pub work: Option<Box<TileWork>>,
    /// True if it needs no more samples.
    pub is_done: bool,
    /// Samples that arrived before earlier ones, by the index of the first.
    early: BTreeMap<u32, (Samples, Duration)>,
}

/// The counted work for samples of a tile.
#[derive(Clone, Debug)]
pub struct TileWork {
    /// For each pixel the number of nodes and leaves that its camera rays visited.
    pub visits: [u32; LANES],
    /// The number of samples of each pixel for which they were counted.
    pub samples: u32,
    /// The use of lanes, also for rays that camera rays spawn.
    pub lane_use: LaneUse,
}

impl TileWork {
    /// No work.
    pub const NONE: TileWork = TileWork { visits: [0; LANES], samples: 0, lane_use: LaneUse::NONE };
}

/// The number of samples after which a tile's noise is first estimated. Fewer samples might all miss a rarely hit
/// light.
const MIN_SAMPLES: u32 = 32;

impl TileRecord {
    fn new(features: &Features, first: u32) -> Self {
        TileRecord {
            sums: SampleSums::NONE,
            first_hits: features.first_hits.then(|| Box::new(FirstHitSums::NONE)),
            outputs: vec![0.0; LANES * features.components()],
            first,
            taken: first,
            dropped: 0,
            time: Duration::ZERO,
            work: None,
            is_done: false,
            early: BTreeMap::new(),
        }
    }

    /// Adds samples that took this time.
    fn take(
        &mut self,
        samples: TileResults<'_>,
        time: Duration,
        imaging: &Imaging,
        features: &Features,
    ) {
        let channels = samples.radiance;
        let count = channels[0].len() / LANES;
        if imaging.is_plain() && channels.iter().all(|channel| all_finite(channel)) {
            self.sums.add_all(channels, count);
        } else {
            for sample in 0..LANES * count {
                let color = imaging.develop(channels.map(|channel| channel[sample]));
                match are_finite(&color) {
                    true => self.sums.add(sample / count, color),
                    false => self.dropped += 1,
                }
            }
        }
        self.take_features(samples, count, features);
        self.taken += count as u32;
        self.time += time;
    }

    /// Adds the features of samples, of which there are `count` for each pixel.
    fn take_features(&mut self, samples: TileResults<'_>, count: usize, features: &Features) {
        let are_first = self.taken == self.first;
        if let Some(sums) = &mut self.first_hits {
            for (lane, samples) in samples.first_hits.chunks_exact(count.max(1)).enumerate() {
                sums.add(lane, samples, are_first);
            }
        }
        let components = features.components();
        if count > 0 && components > 0 {
            let samples = samples.outputs.chunks_exact(count * components);
            for (sums, samples) in self.outputs.chunks_exact_mut(components).zip(samples) {
                features.add_outputs(sums, samples, are_first);
            }
        }
    }

    /// Adds the sums of the samples that follow.
    fn append(&mut self, later: &TileRecord, features: &Features) {
        let are_first = self.count() == 0;
        for pixel in 0..LANES {
            let (sum, added) = (self.sums.color(pixel), later.sums.color(pixel));
            self.sums
                .set_color(pixel, std::array::from_fn(|channel| sum[channel] + added[channel]));
            self.sums.squares[pixel] += later.sums.squares[pixel];
        }
        if let (Some(sums), Some(added)) = (&mut self.first_hits, &later.first_hits) {
            sums.append(added, are_first);
        }
        features.append_outputs(&mut self.outputs, &later.outputs, are_first);
        self.dropped += later.dropped;
        self.time += later.time;
        self.taken = later.taken;
        self.is_done = later.is_done;
    }

    /// Returns the mean of a pixel.
    pub fn mean(&self, lane: usize) -> [f64; 3] {
        self.sums.color(lane).map(|channel| channel / f64::from(self.count().max(1)))
    }

    /// Returns the number of samples of each pixel.
    pub fn count(&self) -> u32 {
        self.taken - self.first
    }

    /// Returns the variance of a pixel's mean luminance.
    pub fn variance(&self, lane: usize) -> f64 {
        let count = f64::from(self.count());
        let mean = luminance(self.sums.color(lane)) / count;
        let spread = (self.sums.squares[lane] / count - mean * mean).max(0.0);
        if self.count() > 1 { spread / (count - 1.0) } else { 0.0 }
    }

    /// The noise of a tile relative to visibility: the root mean square of its pixels' standard errors, divided by the
    /// tile's mean luminance plus a constant, so that black tiles need no samples.
    fn noise(&self, lanes: u64) -> f64 {
        const BLACK: f64 = 0.01;
        let count = f64::from(lanes.count_ones().max(1));
        let sum = |value: &dyn Fn(usize) -> f64| lanes_of(lanes).map(value).sum::<f64>() / count;
        let variance = sum(&|lane| self.variance(lane));
        let mean = sum(&|lane| luminance(self.mean(lane)));
        variance.sqrt() / (mean + BLACK)
    }
}

impl SampleFilm {
    /// Returns the memory of a film.
    pub fn memory((width, height): (usize, usize), features: &Features) -> Amount {
        let tiles = width.div_ceil(TILE).saturating_mul(height.div_ceil(TILE));
        Amount::of::<Tile>(tiles) + Amount::of::<Mutex<TileRecord>>(tiles) + features.memory(tiles)
    }

    /// Creates a black film that keeps these features.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn new(
        (width, height): (usize, usize),
        features: Features,
        noise_target: Option<f32>,
    ) -> Result<Self, OutOfMemory> {
        let tiles = tiles_of(width, height);
        let record = |_: &Tile| Mutex::new(TileRecord::new(&features, 0));
        let mut records = reserved(tiles.len())?;
        features.check_room(tiles.len())?;
        records.extend(tiles.iter().map(record));
        let imaging = Imaging::default();
        let first = 0;
        Ok(SampleFilm { width, height, tiles, records, features, noise_target, imaging, first })
    }

    /// Makes the sample of this index the first of each pixel, for a film with a part of a picture's samples.
    #[must_use]
    pub fn beginning_with(mut self, first: u32) -> Self {
        self.first = first;
        for record in &mut self.records {
            let record = record.get_mut().unwrap_or_else(PoisonError::into_inner);
            (record.first, record.taken) = (first, first);
        }
        self
    }

    /// Sets the response to radiance.
    #[must_use]
    pub fn with_imaging(self, imaging: Imaging) -> Self {
        SampleFilm { imaging, ..self }
    }

    /// Returns the index of the first sample of each pixel.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// Returns the noise at which a tile needs no more samples.
    pub fn noise_target(&self) -> Option<f32> {
        self.noise_target
    }

    /// Forgets the samples of a tile.
    pub fn clear(&self, tile: usize) {
        *self.record(tile) = TileRecord::new(&self.features, self.first);
    }

    /// Adds the sums of a tile in a film of the samples that follow those of this one; returns false if they do not.
    pub fn append(&self, tile: usize, later: &SampleFilm) -> bool {
        let (record, later) = (&mut *self.record(tile), &*later.record(tile));
        let follows = record.taken == later.first;
        if follows && !record.is_done {
            record.append(later, &self.features);
        }
        follows
    }

    /// Returns the tiles.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Returns the features that it keeps.
    pub fn features(&self) -> &Features {
        &self.features
    }

    /// Returns the number of samples of a tile; `None` if it needs no more.
    pub fn taken(&self, tile: usize) -> Option<u32> {
        let record = self.record(tile);
        (!record.is_done).then_some(record.taken)
    }

    /// Adds the samples from `first` on of a tile's pixels, which took this time. They are summed in ascending order,
    /// independent of their arrival; a tile that needs no more samples ignores them.
    pub fn add(&self, tile: usize, first: u32, samples: TileResults<'_>, time: Duration) {
        let record = &mut *self.record(tile);
        if first != record.taken {
            record.early.insert(first, (samples.to_samples(), time));
            return;
        }
        self.take(record, tile, samples, time);
        while let Some((samples, time)) = record.early.remove(&record.taken) {
            self.take(record, tile, (&samples).into(), time);
        }
    }

    /// Adds the next samples of a tile, unless it needs no more.
    fn take(&self, record: &mut TileRecord, tile: usize, samples: TileResults<'_>, time: Duration) {
        if !record.is_done {
            record.take(samples, time, &self.imaging, &self.features);
            // The noise is estimated only at fixed sample counts, so that the end of a render has no influence.
            if let Some(target) = self.noise_target
                && record.count() >= MIN_SAMPLES
                && record.taken.is_multiple_of(SAMPLES_IN_WAVEFRONT)
            {
                let lanes = self.tiles[tile].lanes(self.width, self.height);
                record.is_done = record.noise(lanes) <= f64::from(target);
            }
        }
    }

    /// Adds the work for samples of a tile.
    pub fn add_work(&self, tile: usize, work: &TileWork) {
        let record = &mut *self.record(tile);
        let sum = record.work.get_or_insert_with(|| Box::new(TileWork::NONE));
        for (sum, visits) in sum.visits.iter_mut().zip(work.visits) {
            *sum = sum.saturating_add(visits);
        }
        sum.samples += work.samples;
        sum.lane_use += work.lane_use;
    }

    /// Returns the means of the samples; black without samples.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn image(&self) -> Result<Image, OutOfMemory> {
        let mut image = Image::new(self.width, self.height)?;
        self.for_each_pixel(|record, lane, index| {
            image.pixels[index] = record.mean(lane).map(|channel| channel as f32);
        });
        Ok(image)
    }

    /// Returns an AOV, whose values are of this type; `classes` are the indices of the objects' classes. An output that
    /// is not kept is black.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn aov(&self, aov: &Aov, ty: AovType, classes: &[f32]) -> Result<AovImage, OutOfMemory> {
        let mut image = AovImage::new(aov.clone(), ty, self.width, self.height)?;
        if aov.renderer_type().is_some() {
            self.for_each_pixel(|record, lane, index| {
                image.values[index] = value(aov, record, lane, classes);
            });
        } else if let Some(output) = self.features.output(aov.name()) {
            let (components, count) = (output.components(), self.features.components());
            self.for_each_pixel(|record, lane, index| {
                let sums = &record.outputs[lane * count..][components.clone()];
                let divisor = if ty.is_mean() { f64::from(record.count().max(1)) } else { 1.0 };
                let values = image.pixel_mut(index).iter_mut().zip(sums);
                values.for_each(|(value, sum)| *value = (sum / divisor) as f32);
            });
        }
        Ok(image)
    }

    fn for_each_pixel(&self, mut visit: impl FnMut(&TileRecord, usize, usize)) {
        for (index, tile) in self.tiles.iter().enumerate() {
            let record = self.record(index);
            for lane in lanes_of(tile.lanes(self.width, self.height)) {
                let (x, y) = tile.pixel(lane);
                visit(&record, lane, y * self.width + x);
            }
        }
    }

    /// Returns the number of samples that were not finite.
    pub fn dropped(&self) -> u64 {
        (0..self.records.len()).map(|tile| self.record(tile).dropped).sum()
    }

    /// Returns the average number of samples per pixel.
    pub fn mean_samples(&self) -> f64 {
        let count = |tile| u64::from(self.record(tile).count());
        let sum: u64 = (0..self.records.len()).map(count).sum();
        sum as f64 / self.records.len().max(1) as f64
    }

    /// Locks the state of a tile.
    pub fn record(&self, tile: usize) -> MutexGuard<'_, TileRecord> {
        self.records[tile].lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The value of an image of the renderer for a pixel.
fn value(aov: &Aov, record: &TileRecord, lane: usize, classes: &[f32]) -> f32 {
    let hits = record.first_hits.as_deref().unwrap_or(&FirstHitSums::NONE);
    match aov {
        Aov::Distance if hits.hits[lane] == 0 => f32::INFINITY,
        Aov::Distance => (hits.distance[lane] / f64::from(hits.hits[lane])) as f32,
        Aov::Object => hits.object[lane],
        // Without a hit the object is -1, which no class has.
        Aov::Class if hits.object[lane] < 0.0 => -1.0,
        Aov::Class => classes.get(hits.object[lane] as usize).copied().unwrap_or(-1.0),
        Aov::Samples => record.count() as f32,
        Aov::Variance => record.variance(lane) as f32,
        Aov::Time => {
            let samples = f64::from(record.count().max(1)) * LANES as f64;
            (record.time.as_nanos() as f64 / samples) as f32
        }
        Aov::Nodes => {
            let visits = |work: &TileWork| work.visits[lane] as f32 / work.samples.max(1) as f32;
            record.work.as_deref().map_or(0.0, visits)
        }
        Aov::Lanes => record.work.as_deref().and_then(|work| work.lane_use.part()).unwrap_or(0.0),
        Aov::Albedo | Aov::Normal | Aov::Output(_) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::features::FeatureValues;

    /// Two samples of each pixel, of these radiances.
    fn samples(radiance: [f32; 2]) -> Samples {
        let channel = [radiance; LANES].as_flattened().to_vec();
        Samples {
            radiance: [channel.clone(), channel.clone(), channel],
            features: FeatureValues::default(),
        }
    }

    #[test]
    fn samples_are_summed_in_their_order() {
        let film = SampleFilm::new((8, 8), Features::default(), None).unwrap();
        film.add(0, 2, (&samples([1.0, 1.0])).into(), Duration::ZERO);
        assert_eq!((film.taken(0), film.image().unwrap().pixels[0]), (Some(0), [0.0; 3]));
        film.add(0, 0, (&samples([0.5, 0.5])).into(), Duration::ZERO);
        assert_eq!((film.taken(0), film.image().unwrap().pixels[0]), (Some(4), [0.75; 3]));
        let image = |aov: &Aov| film.aov(aov, AovType::Float, &[]).unwrap();
        assert_eq!(image(&Aov::Samples).values[3], 4.0);
        // Four samples with a variance of 1/16, so 1/48 of their mean.
        let variance = image(&Aov::Variance).values[3];
        assert!((variance - 1.0 / 48.0).abs() < 1e-7, "{variance}");
    }

    #[test]
    fn a_film_takes_what_it_says() {
        let output = || [("thickness".into(), AovType::Float)];
        let both = [("albedo".into(), AovType::Color), ("normal".into(), AovType::Vector(3))];
        let kept = [
            Features::default(),
            Features::new(true, []),
            Features::new(false, output()),
            Features::new(true, both),
        ];
        let size = |features: &Features| SampleFilm::memory((17, 8), features).0 / 3 / 64;
        let sizes = kept.each_ref().map(size);
        assert_eq!(sizes, [34, 50, 42, 98], "bytes for each of the 64 pixels of 3 tiles");
        assert!(SampleFilm::memory((usize::MAX, usize::MAX), &kept[3]) == Amount(u64::MAX));
    }

    #[test]
    fn what_is_not_finite_is_dropped() {
        let film = SampleFilm::new((8, 8), Features::default(), None).unwrap();
        film.add(0, 0, (&samples([f32::NAN, 1.0])).into(), Duration::ZERO);
        assert_eq!((film.dropped(), film.image().unwrap().pixels[0]), (64, [0.5; 3]));
    }

    #[test]
    fn tiles_that_are_exact_take_no_more() {
        let film = SampleFilm::new((8, 8), Features::default(), Some(0.1)).unwrap();
        let mut first = 0;
        while film.taken(0).is_some() {
            film.add(0, first, (&samples([0.9, 1.1])).into(), Duration::ZERO);
            first += 2;
        }
        assert_eq!(film.record(0).taken, MIN_SAMPLES);
        film.add(0, first, (&samples([9.0, 9.0])).into(), Duration::ZERO);
        assert_eq!(film.record(0).taken, MIN_SAMPLES);
        let noisy = SampleFilm::new((8, 8), Features::default(), Some(0.1)).unwrap();
        (0..32)
            .for_each(|pass| noisy.add(0, 2 * pass, (&samples([0.0, 2.0])).into(), Duration::ZERO));
        assert_eq!(noisy.taken(0), Some(64), "the standard error is an eighth");
    }

    /// A render that ends early and is resumed stops where it would have stopped without the interruption.
    #[test]
    fn noise_is_estimated_between_wavefronts_only() {
        let film = SampleFilm::new((8, 8), Features::default(), Some(0.17)).unwrap();
        // The standard error falls below the target at 36 samples, where no wavefront ends.
        (0..23)
            .for_each(|pass| film.add(0, 2 * pass, (&samples([0.0, 2.0])).into(), Duration::ZERO));
        assert_eq!(film.taken(0), Some(46));
        film.add(0, 46, (&samples([0.0, 2.0])).into(), Duration::ZERO);
        assert_eq!((film.taken(0), film.record(0).taken), (None, 48));
    }
}
