//! Random numbers of the paths of a batch.

use fearless_simd::{Level, Simd, dispatch};
use rtsl::host::{Host, LaneFloats, LaneSet};
use rtsl_math::SIMD_LANES;
use rtsl_math::sampling::{ANY_COUNT, INDEPENDENT, POWER_OF_TWO, SOBOL, Sampler, hash, unit_float};

use super::rows::BATCH_LANES;
use crate::lanes::sequences::{Samples, Sequences, end_of};

/// Sequences of random numbers, one for each lane of a batch. It is the host of methods that call no host function but
/// `rand()`.
pub struct RandomNumbers {
    sampler: Sampler,
    sequences: Sequences<BATCH_LANES>,
    /// The sample indices of the lanes.
    samples: [u32; BATCH_LANES],
    /// The number of lanes that have sequences.
    count: usize,
}

impl RandomNumbers {
    /// Creates the host without sequences.
    pub fn new(sampler: Sampler) -> Self {
        let (sequences, samples) = (Sequences::new([0; BATCH_LANES]), [0; BATCH_LANES]);
        RandomNumbers { sampler, sequences, samples, count: 0 }
    }

    /// Starts sequences of the first `count` lanes, which `purpose` selects among those of `keys`. `samples` are the
    /// lanes' sample indices.
    pub fn start(
        &mut self,
        (keys, samples): (&[u32; BATCH_LANES], &[u32; BATCH_LANES]),
        purpose: u32,
        count: usize,
    ) {
        let padded = count.next_multiple_of(SIMD_LANES);
        self.sequences.restart(padded, |to| derive_keys(keys, purpose, count, to));
        self.samples[..padded].copy_from_slice(&samples[..padded]);
        self.count = count;
    }

    /// Computes pair `pair` of the sequences with these `keys`.
    pub fn pairs(&self, keys: &[u32; BATCH_LANES], pair: u32, count: usize, to: [&mut [f32]; 2]) {
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
        keys: &[u32; BATCH_LANES],
        pair: u32,
        count: usize,
        [first, second]: [&mut [f32]; 2],
    ) {
        let count = count.next_multiple_of(SIMD_LANES);
        let (keys, samples) = (&keys[..count], &self.samples[..count]);
        let (first, second) = (&mut first[..count], &mut second[..count]);
        for lane in 0..count {
            [first[lane], second[lane]] =
                self.sampler.pair_of_stream::<SPREAD>(keys[lane], pair, samples[lane]);
        }
    }
}

/// Derives the keys of the sequences that `purpose` selects among those of `keys`.
pub fn derive_keys(keys: &[u32; BATCH_LANES], purpose: u32, count: usize, to: &mut [u32]) {
    let count = count.next_multiple_of(SIMD_LANES);
    dispatch!(Level::new(), simd => derive_in_vectors(simd, &keys[..count], purpose, &mut to[..count]));
}

#[inline(always)]
fn derive_in_vectors<S: Simd>(_: S, keys: &[u32], purpose: u32, to: &mut [u32]) {
    for (to, key) in to.iter_mut().zip(keys) {
        *to = hash(*key, purpose);
    }
}

/// Returns a number in [0,1) that is independent of any sequence, for decisions that do not benefit from
/// stratification.
#[inline(always)]
pub fn lone_random_number(key: u32, purpose: u32, sample: u32) -> f32 {
    unit_float(hash(hash(key, purpose), sample))
}

impl Host for RandomNumbers {
    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        debug_assert!(end_of(lanes) <= self.count, "{lanes:?} of {} lanes", self.count);
        self.sequences.next(&self.sampler, Samples::Each(&self.samples), lanes, values);
    }
}
