//! The random numbers of a path.

use rtsl::SEQUENCES_OF_SEARCH;
use rtsl_math::sampling::{
    NUMBERS_OF_LIGHT_SAMPLES, NUMBERS_OF_MATERIAL_CALLS, NUMBERS_OF_PAIRS, NUMBERS_OF_RAND,
    NUMBERS_OF_SHADE, NUMBERS_OF_SINGLES, child_key, hash,
};

use super::drawn_numbers::Place;

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

    /// Returns the place of the next number of `rand()`.
    pub fn draw(&mut self) -> Place {
        let dimension = self.drawn;
        self.drawn = dimension.wrapping_add(1);
        self.place(NUMBERS_OF_RAND, dimension)
    }

    /// Returns the place of the number of a dimension.
    pub fn single(&self, dimension: u32) -> Place {
        self.place(NUMBERS_OF_SINGLES, dimension)
    }

    /// Returns the place of two numbers that are stratified together.
    pub fn pair(&self, pair: u32) -> Place {
        self.place(NUMBERS_OF_PAIRS, pair)
    }

    /// Returns a place in the sequence of the path that `selector` selects.
    fn place(&self, selector: u32, dimension: u32) -> Place {
        Place { key: hash(self.key, selector), dimension, sample: self.sample }
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
