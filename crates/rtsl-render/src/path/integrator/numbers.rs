//! The random numbers of a path.

use rtsl_math::sampling::{Sampler, child_key, hash};

/// Selects the numbers of a path by their use: independent sequences.
const NUMBERS_OF_SINGLES: u32 = 0x201;
const NUMBERS_OF_PAIRS: u32 = 0x202;
const NUMBERS_OF_RAND: u32 = 0x203;
const NUMBERS_OF_CALLS: u32 = 0x204;

/// The sequences of the queries between two searches.
const CALLS_OF_SEARCH: u32 = 1 << 10;

/// The random numbers of a path.
#[derive(Clone, Copy, Debug)]
pub struct PathNumbers {
    key: u32,
    /// The index of the sample.
    pub sample: u32,
    /// The number of queries that had sequences, counted anew after each search.
    calls: u32,
    /// The count of numbers drawn by `rand()`.
    drawn: u32,
    /// The number of rays traced by `trace()`.
    children: u32,
}

impl PathNumbers {
    /// Creates the numbers of the path with this key.
    pub fn new(key: u32, sample: u32) -> PathNumbers {
        PathNumbers { key, sample, calls: 0, drawn: 0, children: 0 }
    }

    /// Returns one dimension.
    pub fn single(&self, sampler: &Sampler, dimension: u32) -> f32 {
        sampler.single_number(hash(self.key, NUMBERS_OF_SINGLES), dimension, self.sample)
    }

    /// Returns two dimensions that are stratified together.
    pub fn pair(&self, sampler: &Sampler, dimension: u32) -> [f32; 2] {
        sampler.single_pair(hash(self.key, NUMBERS_OF_PAIRS), dimension, self.sample)
    }

    /// Draws the next number of `rand()`.
    pub fn draw(&mut self, sampler: &Sampler) -> f32 {
        let dimension = self.drawn;
        self.drawn = dimension.wrapping_add(1);
        sampler.single_number(hash(self.key, NUMBERS_OF_RAND), dimension, self.sample)
    }

    /// Begins the sequences of a search, and returns the key of its own.
    pub fn begin_search(&mut self) -> u32 {
        self.calls = (self.calls / CALLS_OF_SEARCH + 1).wrapping_mul(CALLS_OF_SEARCH);
        self.key_of_call()
    }

    /// Returns the key of the next query's sequence.
    pub fn begin_call(&mut self) -> u32 {
        self.calls = self.calls.wrapping_add(1);
        self.key_of_call()
    }

    /// Returns the key of the path of the next ray that `trace()` traces.
    pub fn begin_child(&mut self) -> u32 {
        self.children = self.children.wrapping_add(1);
        child_key(self.key, self.children)
    }

    fn key_of_call(&self) -> u32 {
        hash(hash(self.key, NUMBERS_OF_CALLS), self.calls)
    }
}
