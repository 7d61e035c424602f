//! The film of a batch render: sums over samples, tile by tile.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::acceleration::{LANES, lanes_of};
use crate::film::Image;
use crate::tiles::{Tile, tiles_of};

use super::wave::Path;

/// A film. Each tile has a lock of its own.
pub struct BatchFilm {
    width: usize,
    height: usize,
    tiles: Vec<Tile>,
    records: Vec<Mutex<TileRecord>>,
}

/// What is known of a tile.
#[derive(Clone, Debug)]
pub struct TileRecord {
    /// For each pixel the sum of its samples, in their order.
    pub sums: [[f64; 3]; LANES],
    /// The samples of each pixel.
    pub taken: u32,
    /// Samples that were not finite and count as black.
    pub dropped: u64,
    /// Samples that came before those in front of them, by the first.
    early: BTreeMap<u32, Vec<[f32; 3]>>,
}

impl BatchFilm {
    /// A black film.
    pub fn new(width: usize, height: usize) -> Self {
        let tiles = tiles_of(width, height);
        let empty =
            TileRecord { sums: [[0.0; 3]; LANES], taken: 0, dropped: 0, early: BTreeMap::new() };
        let records = tiles.iter().map(|_| Mutex::new(empty.clone())).collect();
        BatchFilm { width, height, tiles, records }
    }

    /// Its tiles.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Adds the paths of samples from `first` on of a tile's pixels, sample by sample. Sums take them in
    /// the order of their numbers, whenever they come.
    pub fn add(&self, tile: usize, first: u32, paths: &[Path]) {
        let mut record = self.record(tile);
        record.early.insert(first, paths.iter().map(|path| path.radiance).collect());
        while let Some(next) = {
            let taken = record.taken;
            record.early.remove(&taken)
        } {
            record.take(&next);
        }
    }

    /// The means of the samples; black where there is none.
    pub fn image(&self) -> Image {
        let mut image = Image::new(self.width, self.height);
        for (index, tile) in self.tiles.iter().enumerate() {
            let record = self.record(index);
            let count = f64::from(record.taken.max(1));
            for lane in lanes_of(tile.lanes(self.width, self.height)) {
                let (x, y) = tile.pixel(lane);
                image.pixels[y * self.width + x] =
                    record.sums[lane].map(|channel| (channel / count) as f32);
            }
        }
        image
    }

    /// Samples that were not finite.
    pub fn dropped(&self) -> u64 {
        (0..self.records.len()).map(|tile| self.record(tile).dropped).sum()
    }

    fn record(&self, tile: usize) -> MutexGuard<'_, TileRecord> {
        self.records[tile].lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl TileRecord {
    fn take(&mut self, samples: &[[f32; 3]]) {
        for sample in samples.chunks_exact(LANES) {
            for (sum, color) in self.sums.iter_mut().zip(sample) {
                if color.iter().all(|channel| channel.is_finite()) {
                    (0..3).for_each(|channel| sum[channel] += f64::from(color[channel]));
                } else {
                    self.dropped += 1;
                }
            }
            self.taken += 1;
        }
    }
}
