//! Random numbers of the paths of a batch.

use fearless_simd::{Level, Simd, dispatch};
use rtsl::host::{Host, LaneFloats, LaneSet};
use rtsl_math::SIMD_LANES;
use rtsl_math::sampling::{Sampler, hash, unit_float};

use super::rows::BATCH_LANES;
use crate::lanes::sequences::{Sequences, end_of};

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
}

/// Derives the keys of the sequences that `purpose` selects among those of `keys`.
fn derive_keys(keys: &[u32; BATCH_LANES], purpose: u32, count: usize, to: &mut [u32]) {
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
        self.sequences.next(&self.sampler, &self.samples, lanes, values);
    }
}
