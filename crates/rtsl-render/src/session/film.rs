//! The film of a session: sums of samples, tile by tile, and the displayed pixels.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rtsl_bvh::{LANES, lanes_of};
use rtsl_image::Image;
use rtsl_memory::{Amount, OutOfMemory, reserved};

use super::enlargement::{Enlargement, Preview, PreviewPixel};
use super::scatter::Scatter;
use super::tile_sample::{TileSample, TileSums, mean};
use super::view_mode::{Display, PixelFacts};
use crate::schedule::tile::{TILE, Tile, tiles_of};
use crate::statistics::LaneUse;

/// A film. Each tile has a separate lock, so that threads do not wait for one another.
pub struct Film {
    width: usize,
    height: usize,
    tiles: Vec<Tile>,
    records: Vec<Mutex<Record>>,
}

/// The cost of samples of a tile.
#[derive(Clone, Copy, Debug)]
pub struct SampleWork {
    /// The time.
    pub time: Duration,
    /// The use of lanes in calls, if it was counted.
    pub lane_use: LaneUse,
    /// The number of nodes and leaves that the camera ray of each pixel visited, if it was counted.
    pub visited: [u32; LANES],
}

impl SampleWork {
    /// No cost.
    pub const NONE: SampleWork =
        SampleWork { time: Duration::ZERO, lane_use: LaneUse::NONE, visited: [0; LANES] };

    fn add(&mut self, other: &SampleWork) {
        self.time += other.time;
        self.lane_use += other.lane_use;
        for (sum, visited) in self.visited.iter_mut().zip(other.visited) {
            *sum = sum.saturating_add(visited);
        }
    }
}

/// The samples of a pixel that are not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct DroppedSamples {
    first: u32,
    count: u32,
}

/// The samples of a film that are not finite, which count as black.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// The number of the samples.
    pub samples: u64,
    /// The number of pixels that have any.
    pub pixels: usize,
    /// The first of these pixels.
    pub listed: Vec<DroppedPixel>,
}

/// A pixel with samples that are not finite, which count as black.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DroppedPixel {
    /// The column, from the left.
    pub x: usize,
    /// The row, from the top.
    pub y: usize,
    /// The first of the samples.
    pub first: u32,
    /// The number of the samples.
    pub count: u32,
}

/// The state of a tile.
struct Record {
    sums: TileSums,
    /// The variation of the samples of a pixel.
    scatter: Scatter,
    /// The number of samples of each pixel.
    taken: u32,
    /// Their cost.
    work: SampleWork,
    /// The samples that are not finite, by the pixels that have any.
    dropped: BTreeMap<u8, DroppedSamples>,
    /// The displayed pixels, `0x00RRGGBB`. They are kept when samples are cleared, until new ones replace them.
    shown: [u32; LANES],
    /// The object that each pixel shows, as far as it is known; -1 for none.
    objects: [i32; LANES],
}

impl Record {
    const EMPTY: Record = Record {
        sums: [[0.0; 3]; LANES],
        scatter: Scatter::NONE,
        taken: 0,
        work: SampleWork::NONE,
        dropped: BTreeMap::new(),
        shown: [0; LANES],
        objects: [-1; LANES],
    };

    fn average(&self, lane: usize) -> [f32; 3] {
        mean(self.sums[lane], self.taken)
    }

    fn show(&mut self, display: &Display) {
        if self.taken == 0 {
            return;
        }
        // The time of a tile is divided among its pixels.
        let time = self.work.time / (self.taken * LANES as u32);
        let lanes = self.work.lane_use.part().unwrap_or(0.0);
        for lane in 0..LANES {
            let visited = self.work.visited[lane] as f32 / self.taken as f32;
            let dropped = self.dropped.contains_key(&(lane as u8));
            let color = self.average(lane);
            let facts = PixelFacts { color, time, visited, lanes, dropped };
            self.shown[lane] = display.pixel(&facts);
        }
    }
}

impl Film {
    /// Returns the memory of a film.
    pub fn memory(width: usize, height: usize) -> Amount {
        let tiles = width.div_ceil(TILE).saturating_mul(height.div_ceil(TILE));
        Amount::of::<Tile>(tiles) + Amount::of::<Mutex<Record>>(tiles)
    }

    /// Creates a black film.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn new(width: usize, height: usize) -> Result<Self, OutOfMemory> {
        let tiles = tiles_of(width, height);
        let mut records = reserved(tiles.len())?;
        records.extend(tiles.iter().map(|_| Mutex::new(Record::EMPTY)));
        Ok(Film { width, height, tiles, records })
    }

    /// Returns columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Returns the tiles.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Removes all samples. The displayed pixels stay.
    pub fn clear(&mut self) {
        for record in &mut self.records {
            let record = record.get_mut().unwrap_or_else(PoisonError::into_inner);
            // While frames have a lower resolution, no tile of the picture has samples.
            if record.taken > 0 {
                *record = Record { shown: record.shown, ..Record::EMPTY };
            }
        }
    }

    /// Adds samples of the tile `index` and their cost.
    pub fn add(&self, index: usize, samples: &[TileSample], work: &SampleWork, display: &Display) {
        let mut record = self.record(index);
        for sample in samples {
            let dropped = sample.add_to(&mut record.sums);
            let first = record.taken;
            for lane in lanes_of(dropped) {
                let none = DroppedSamples { first, count: 0 };
                record.dropped.entry(lane as u8).or_insert(none).count += 1;
            }
            record.scatter.add(sample, display.scale());
            record.taken += 1;
        }
        record.work.add(work);
        record.show(display);
    }

    /// Returns the number of samples of the tile `index`.
    pub fn taken(&self, index: usize) -> u32 {
        self.record(index).taken
    }

    /// Returns the perceived error of the tile `index`.
    pub fn error(&self, index: usize) -> f32 {
        let record = self.record(index);
        record.scatter.error(record.taken)
    }

    /// Returns the average number of samples per pixel.
    pub fn mean_samples(&self) -> u32 {
        let taken = (0..self.tiles.len()).map(|index| u64::from(self.taken(index)));
        (taken.sum::<u64>() / self.tiles.len().max(1) as u64) as u32
    }

    /// Returns the tiles whose next sample improves the picture most, until all have `wanted` samples: first those with
    /// too few samples to estimate their error, then the quarter of the unfinished tiles with the greatest errors.
    pub fn most_in_need(&self, wanted: u32) -> Vec<usize> {
        const FIRST_SAMPLES: u32 = 4;
        const PART: usize = 4;
        let taken: Vec<u32> = (0..self.tiles.len()).map(|index| self.taken(index)).collect();
        let least = taken.iter().copied().min().unwrap_or(wanted);
        let tiles = 0..self.tiles.len();
        if least < FIRST_SAMPLES.min(wanted) {
            return tiles.filter(|index| taken[*index] == least).collect();
        }
        let unfinished = tiles.filter(|index| taken[*index] < wanted);
        let mut errors: Vec<(f32, usize)> =
            unfinished.map(|index| (self.error(index), index)).collect();
        errors.sort_by(|one, other| other.0.total_cmp(&one.0).then(one.1.cmp(&other.1)));
        errors.truncate(errors.len().div_ceil(PART));
        errors.into_iter().map(|(_, index)| index).collect()
    }

    /// Updates the displayed pixels for another view mode.
    pub fn show(&self, display: &Display) {
        (0..self.tiles.len()).for_each(|index| self.record(index).show(display));
    }

    /// Notes which object each pixel of the tile `index` shows.
    pub fn set_objects(&self, index: usize, objects: [i32; LANES]) {
        self.record(index).objects = objects;
    }

    /// Returns the displayed pixels with their objects.
    pub fn preview(&self) -> Preview {
        let mut pixels = vec![PreviewPixel::default(); self.width * self.height];
        for (index, tile) in self.tiles.iter().enumerate() {
            let record = self.record(index);
            for lane in lanes_of(tile.lanes(self.width, self.height)) {
                let (x, y) = tile.pixel(lane);
                let (color, object) = (record.shown[lane], record.objects[lane]);
                pixels[y * self.width + x] = PreviewPixel { color, object };
            }
        }
        Preview { size: self.size(), pixels }
    }

    /// Displays another film, scaled to the size of this one.
    pub fn show_scaled(&self, other: &Film) {
        let enlargement = Enlargement::new(other.preview(), self.size());
        (0..self.tiles.len()).for_each(|index| self.show_enlarged(index, &enlargement));
    }

    /// Displays pixels of another film, scaled to the size of this one, in the tile `index`.
    pub fn show_enlarged(&self, index: usize, enlargement: &Enlargement) {
        let tile = self.tiles[index];
        let mut record = self.record(index);
        for lane in lanes_of(tile.lanes(self.width, self.height)) {
            let (x, y) = tile.pixel(lane);
            record.shown[lane] = enlargement.pixel(x, y);
        }
    }

    /// Copies the displayed pixels to `pixels`, whose rows are `stride` pixels apart, as `0x00RRGGBB`.
    pub fn copy_to(&self, pixels: &mut [u32], stride: usize) {
        for (index, tile) in self.tiles.iter().enumerate() {
            let record = self.record(index);
            for lane in lanes_of(tile.lanes(self.width, self.height)) {
                let (x, y) = tile.pixel(lane);
                pixels[y * stride + x] = record.shown[lane];
            }
        }
    }

    /// Returns the samples that are not finite, with at most so many of their pixels, tile by tile.
    pub fn dropped(&self, limit: usize) -> Dropped {
        let mut dropped = Dropped::default();
        for (index, tile) in self.tiles.iter().enumerate() {
            let record = self.record(index);
            dropped.pixels += record.dropped.len();
            for (lane, samples) in &record.dropped {
                let DroppedSamples { first, count } = *samples;
                dropped.samples += u64::from(count);
                if dropped.listed.len() < limit {
                    let (x, y) = tile.pixel(usize::from(*lane));
                    dropped.listed.push(DroppedPixel { x, y, first, count });
                }
            }
        }
        dropped
    }

    /// Returns the averages of the samples; black without samples.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn image(&self) -> Result<Image, OutOfMemory> {
        let mut image = Image::new(self.width, self.height)?;
        for (index, tile) in self.tiles.iter().enumerate() {
            let record = self.record(index);
            for lane in lanes_of(tile.lanes(self.width, self.height)) {
                let (x, y) = tile.pixel(lane);
                if record.taken > 0 {
                    image.pixels[y * self.width + x] = record.average(lane);
                }
            }
        }
        Ok(image)
    }

    fn record(&self, index: usize) -> MutexGuard<'_, Record> {
        self.records[index].lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::ViewMode;

    fn sample(film: &Film, index: usize, value: f32) -> [TileSample; 1] {
        let lanes = film.tiles()[index].lanes(film.width, film.height);
        [TileSample { lanes, colors: [[value; LANES]; 3] }]
    }

    #[test]
    fn samples_are_averaged_and_shown() {
        let display = Display::new(ViewMode::Image, 1.0);
        let mut film = Film::new(10, 9).unwrap();
        assert_eq!(film.tiles().len(), 4);
        film.add(1, &sample(&film, 1, 0.0), &SampleWork::NONE, &display);
        film.add(1, &sample(&film, 1, 1.0), &SampleWork::NONE, &display);
        let image = film.image().unwrap();
        assert_eq!((image.pixels[8], image.pixels[7]), ([0.5; 3], [0.0; 3]));
        assert_eq!(film.dropped(9), Dropped::default());
        let mut pixels = vec![7; 12 * 9];
        film.copy_to(&mut pixels, 12);
        assert_eq!(pixels[7..12], [0, 0x00BC_BCBC, 0x00BC_BCBC, 7, 7]);
        film.clear();
        assert_eq!(film.image().unwrap().pixels[8], [0.0; 3]);
        film.copy_to(&mut pixels, 12);
        assert_eq!(pixels[8], 0x00BC_BCBC, "what is shown stays");
    }

    #[test]
    fn samples_that_are_not_finite_are_told_and_marked() {
        let display = Display::new(ViewMode::NotFinite, 1.0);
        let film = Film::new(10, 8).unwrap();
        for value in [1.0, f32::NAN, f32::INFINITY] {
            let mut samples = sample(&film, 1, 1.0);
            samples[0].colors[1][1] = value;
            film.add(1, &samples, &SampleWork::NONE, &display);
        }
        let pixel = DroppedPixel { x: 9, y: 0, first: 1, count: 2 };
        assert_eq!(film.dropped(9), Dropped { samples: 2, pixels: 1, listed: vec![pixel] });
        assert_eq!(film.dropped(0), Dropped { samples: 2, pixels: 1, listed: Vec::new() });
        let mut pixels = vec![0; 10 * 8];
        film.copy_to(&mut pixels, 10);
        assert_eq!(pixels[9], 0x00FF_00FF);
        assert!(pixels[8] != 0 && pixels[8] != pixels[9]);
    }

    #[test]
    fn a_smaller_film_is_enlarged() {
        let display = Display::new(ViewMode::Image, 1.0);
        let (small, film) = (Film::new(2, 1).unwrap(), Film::new(20, 10).unwrap());
        small.add(0, &sample(&small, 0, 1.0), &SampleWork::NONE, &display);
        film.show_scaled(&small);
        let mut pixels = vec![0; 200];
        film.copy_to(&mut pixels, 20);
        assert_eq!(pixels, [0x00FF_FFFF; 200]);
    }
}
