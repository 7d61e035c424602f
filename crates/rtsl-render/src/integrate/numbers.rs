//! The random numbers of a path.

use fearless_simd::{Level, Simd, dispatch};
use rtsl::SEQUENCES_OF_SEARCH;
use rtsl::host::{LaneWords, MAX_LANES};
use rtsl_math::sampling::{
    ANY_COUNT, INDEPENDENT, NUMBERS_OF_LIGHT_SAMPLES, NUMBERS_OF_MATERIAL_CALLS, NUMBERS_OF_PAIRS,
    NUMBERS_OF_RAND, NUMBERS_OF_SHADE, NUMBERS_OF_SINGLES, POWER_OF_TWO, SOBOL, Sampler, child_key,
    hash,
};

/// Selects the sequences of its searches.
const NUMBERS_OF_SEARCHES: u32 = 0x209;

/// The purpose of a sequence that a path begins.
#[derive(Clone, Copy, Debug)]
pub enum Purpose {
    /// A light sample.
    LightSample,
    /// A call of a method of a material that draws random numbers.
    MaterialCall,
    /// A call of `shade`.
    Shade,
    /// A question about an environment light.
    Sky,
    /// A ray towards a light, or one that asks whether something is on it.
    ShadowRay,
}

impl Purpose {
    /// Returns what selects the sequences among those of a path.
    fn selector(self) -> u32 {
        match self {
            Purpose::LightSample => NUMBERS_OF_LIGHT_SAMPLES,
            Purpose::MaterialCall => NUMBERS_OF_MATERIAL_CALLS,
            Purpose::Shade => NUMBERS_OF_SHADE,
            Purpose::Sky => 0x207,
            Purpose::ShadowRay => 0x208,
        }
    }
}

/// Returns the count of sequences that a path begins with after so many searches.
pub fn count_after(searches: u32) -> u32 {
    searches.wrapping_mul(SEQUENCES_OF_SEARCH)
}

/// Returns the key of a path's sequence of a purpose with this count, given the key of the path.
pub fn sequence_key(key: u32, purpose: Purpose, count: u32) -> u32 {
    hash(hash(key, purpose.selector()), count)
}

/// The random numbers of a path.
#[derive(Clone, Copy, Debug)]
pub struct PathNumbers {
    key: u32,
    /// The index of the sample.
    pub sample: u32,
    /// The number of searches.
    searches: u32,
    /// By purposes, the counts of sequences.
    counts: [u32; 5],
    /// The count of numbers drawn by `rand()`.
    drawn: u32,
    /// The number of rays traced by `trace()`.
    children: u32,
}

impl PathNumbers {
    /// Creates the numbers of the path with this key.
    pub fn new(key: u32, sample: u32) -> PathNumbers {
        PathNumbers { key, sample, searches: 0, counts: [0; 5], drawn: 0, children: 0 }
    }

    /// Returns the key from which those of all sequences are derived.
    pub fn key(&self) -> u32 {
        self.key
    }

    /// Draws the next number of `rand()`.
    pub fn draw(&mut self, sampler: &Sampler) -> f32 {
        let dimension = self.drawn;
        self.drawn = dimension.wrapping_add(1);
        sampler.single_number(hash(self.key, NUMBERS_OF_RAND), dimension, self.sample)
    }

    /// Begins the sequences of the queries that follow a search.
    pub fn begin_search(&mut self) {
        self.searches = self.searches.wrapping_add(1);
        self.counts = [count_after(self.searches); 5];
    }

    /// Returns the key of the next search's own sequence.
    pub fn key_of_search(&self) -> u32 {
        hash(hash(self.key, NUMBERS_OF_SEARCHES), self.searches)
    }

    /// Returns the key of the next sequence of a purpose.
    pub fn begin(&mut self, purpose: Purpose) -> u32 {
        let count = &mut self.counts[purpose as usize];
        *count = count.wrapping_add(1);
        sequence_key(self.key, purpose, *count)
    }

    /// Returns the key of the path of the next ray that `trace()` traces.
    pub fn begin_child(&mut self) -> u32 {
        self.children = self.children.wrapping_add(1);
        child_key(self.key, self.children)
    }
}

/// Returns one dimension of each path, as bits. The keys are those of the paths.
pub fn singles(
    sampler: &Sampler,
    keys: &LaneWords,
    dimensions: &LaneWords,
    samples: &LaneWords,
) -> LaneWords {
    let mut numbers = [0; MAX_LANES];
    dispatch!(Level::new(), simd => match sampler.spread() {
        INDEPENDENT => singles_in_vectors::<_, INDEPENDENT>(simd, sampler, [keys, dimensions, samples], &mut numbers),
        POWER_OF_TWO => singles_in_vectors::<_, POWER_OF_TWO>(simd, sampler, [keys, dimensions, samples], &mut numbers),
        SOBOL => singles_in_vectors::<_, SOBOL>(simd, sampler, [keys, dimensions, samples], &mut numbers),
        _ => singles_in_vectors::<_, ANY_COUNT>(simd, sampler, [keys, dimensions, samples], &mut numbers),
    });
    numbers
}

#[inline(always)]
fn singles_in_vectors<S: Simd, const SPREAD: u8>(
    _: S,
    sampler: &Sampler,
    [keys, dimensions, samples]: [&LaneWords; 3],
    numbers: &mut LaneWords,
) {
    for lane in 0..MAX_LANES {
        let key = hash(keys[lane], NUMBERS_OF_SINGLES);
        let number = sampler.number_of_stream::<SPREAD>(key, dimensions[lane], samples[lane]);
        numbers[lane] = number.to_bits();
    }
}

/// Returns two dimensions of each path that are stratified together, as bits.
pub fn pairs(
    sampler: &Sampler,
    keys: &LaneWords,
    dimensions: &LaneWords,
    samples: &LaneWords,
) -> [LaneWords; 2] {
    let mut numbers = [[0; MAX_LANES]; 2];
    dispatch!(Level::new(), simd => match sampler.spread() {
        INDEPENDENT => pairs_in_vectors::<_, INDEPENDENT>(simd, sampler, [keys, dimensions, samples], &mut numbers),
        POWER_OF_TWO => pairs_in_vectors::<_, POWER_OF_TWO>(simd, sampler, [keys, dimensions, samples], &mut numbers),
        SOBOL => pairs_in_vectors::<_, SOBOL>(simd, sampler, [keys, dimensions, samples], &mut numbers),
        _ => pairs_in_vectors::<_, ANY_COUNT>(simd, sampler, [keys, dimensions, samples], &mut numbers),
    });
    numbers
}

#[inline(always)]
fn pairs_in_vectors<S: Simd, const SPREAD: u8>(
    _: S,
    sampler: &Sampler,
    [keys, dimensions, samples]: [&LaneWords; 3],
    [first, second]: &mut [LaneWords; 2],
) {
    for lane in 0..MAX_LANES {
        let key = hash(keys[lane], NUMBERS_OF_PAIRS);
        let pair = sampler.pair_of_stream::<SPREAD>(key, dimensions[lane], samples[lane]);
        (first[lane], second[lane]) = (pair[0].to_bits(), pair[1].to_bits());
    }
}
