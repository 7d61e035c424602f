//! Random numbers of the paths of a chunk.

use fearless_simd::{Level, Simd, dispatch};
use rtsl::host::{Host, LaneFloats, LaneSet};

use crate::sampling::{ANY_COUNT, INDEPENDENT, POWER_OF_TWO, SOBOL, Sampler, hash, unit_float};

use super::chunk::CHUNK;

/// Lanes whose numbers are made at a time.
const STEP: usize = 8;

/// Sequences of numbers, one for each lane of a chunk. It is the host of methods that can ask for nothing but
/// `rand()`.
pub struct Numbers {
    sampler: Sampler,
    /// Which sequences they are.
    pub keys: [u32; CHUNK],
    /// Which samples of their pixels the lanes belong to.
    pub samples: [u32; CHUNK],
    /// How many numbers each lane has had.
    dimensions: [u32; CHUNK],
}

impl Numbers {
    /// Sequences of this sampler.
    pub fn new(sampler: Sampler) -> Self {
        Numbers { sampler, keys: [0; CHUNK], samples: [0; CHUNK], dimensions: [0; CHUNK] }
    }

    /// Starts the sequences anew: those that `purpose` chooses among the sequences of `keys`.
    pub fn start(&mut self, keys: &[u32; CHUNK], purpose: u32, count: usize) {
        derive_keys(keys, purpose, count, &mut self.keys);
        self.dimensions[..count.next_multiple_of(STEP)].fill(0);
    }

    /// Pairs `pair` of the sequences that `keys` name.
    pub fn pairs(&self, keys: &[u32; CHUNK], pair: u32, count: usize, to: [&mut [f32]; 2]) {
        dispatch!(Level::new(), simd => match self.sampler.spread() {
            INDEPENDENT => self.pairs_in_vectors::<_, INDEPENDENT>(simd, keys, pair, count, to),
            POWER_OF_TWO => self.pairs_in_vectors::<_, POWER_OF_TWO>(simd, keys, pair, count, to),
            SOBOL => self.pairs_in_vectors::<_, SOBOL>(simd, keys, pair, count, to),
            _ => self.pairs_in_vectors::<_, ANY_COUNT>(simd, keys, pair, count, to),
        });
    }

    #[inline(always)]
    fn pairs_in_vectors<S: Simd, const SPREAD: u8>(
        &self,
        _: S,
        keys: &[u32; CHUNK],
        pair: u32,
        count: usize,
        [first, second]: [&mut [f32]; 2],
    ) {
        let count = count.next_multiple_of(STEP);
        let (keys, samples) = (&keys[..count], &self.samples[..count]);
        let (first, second) = (&mut first[..count], &mut second[..count]);
        for lane in 0..count {
            [first[lane], second[lane]] =
                self.sampler.pair_of_stream::<SPREAD>(keys[lane], pair, samples[lane]);
        }
    }

    #[inline(always)]
    fn next_in_vectors<S: Simd, const SPREAD: u8>(
        &mut self,
        _: S,
        LaneSet { base, active }: LaneSet,
        values: &mut LaneFloats,
    ) {
        let base = base as usize;
        for start in (0..values.len()).step_by(STEP) {
            let lanes = base + start..base + start + STEP;
            let (Some(keys), Some(samples), Some(dimensions)) = (
                self.keys.get(lanes.clone()),
                self.samples.get(lanes.clone()),
                self.dimensions.get_mut(lanes),
            ) else {
                break;
            };
            if active >> start == 0 {
                break;
            }
            for lane in 0..STEP {
                values[start + lane] = self.sampler.number_of_stream::<SPREAD>(
                    keys[lane],
                    dimensions[lane],
                    samples[lane],
                );
                dimensions[lane] = dimensions[lane].wrapping_add(active >> (start + lane) & 1);
            }
        }
    }
}

/// The keys of the sequences that `purpose` chooses among those of `keys`.
pub fn derive_keys(keys: &[u32; CHUNK], purpose: u32, count: usize, to: &mut [u32; CHUNK]) {
    let count = count.next_multiple_of(STEP);
    dispatch!(Level::new(), simd => derive_in_vectors(simd, &keys[..count], purpose, &mut to[..count]));
}

#[inline(always)]
fn derive_in_vectors<S: Simd>(_: S, keys: &[u32], purpose: u32, to: &mut [u32]) {
    for (to, key) in to.iter_mut().zip(keys) {
        *to = hash(*key, purpose);
    }
}

/// A number in [0,1) that has nothing to do with any sequence: for decisions that no stratification helps.
#[inline(always)]
pub fn lone_number(key: u32, purpose: u32, sample: u32) -> f32 {
    unit_float(hash(hash(key, purpose), sample))
}

impl Host for Numbers {
    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        dispatch!(Level::new(), simd => match self.sampler.spread() {
            INDEPENDENT => self.next_in_vectors::<_, INDEPENDENT>(simd, lanes, values),
            POWER_OF_TWO => self.next_in_vectors::<_, POWER_OF_TWO>(simd, lanes, values),
            SOBOL => self.next_in_vectors::<_, SOBOL>(simd, lanes, values),
            _ => self.next_in_vectors::<_, ANY_COUNT>(simd, lanes, values),
        });
    }
}
