//! The numbers of a scene's sampler for the lanes of a call.

use std::sync::Arc;

use rtsl::host::{LaneSet, MAX_LANES};
use rtsl::{LaneBlock, SamplerNumbers};

/// The place of a number among all those of a sampler.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The key of its sequence.
    pub key: u32,
    /// The index of the dimension, or of the pair of dimensions.
    pub dimension: u32,
    /// The index of the sample.
    pub sample: u32,
}

/// The numbers of a scene's sampler, with the arrays for calls of one thread.
pub struct DrawnNumbers {
    numbers: Arc<SamplerNumbers>,
    arrays: LaneBlock,
}

impl DrawnNumbers {
    /// Allocates the arrays.
    pub fn new(numbers: &Arc<SamplerNumbers>) -> Self {
        let arrays = LaneBlock::new(SamplerNumbers::ARRAYS, MAX_LANES);
        DrawnNumbers { numbers: numbers.clone(), arrays }
    }

    /// Returns each of some lanes with the number at its place.
    pub fn singles(
        &mut self,
        lanes: LaneSet,
        place: impl FnMut(usize) -> Place,
    ) -> impl Iterator<Item = (usize, f32)> {
        let count = self.set_places(lanes, place);
        self.numbers.numbers(&mut self.arrays, count);
        lanes.iter().zip(self.arrays.floats(3).iter().copied())
    }

    /// Returns each of some lanes with the two numbers at its place.
    pub fn pairs(
        &mut self,
        lanes: LaneSet,
        place: impl FnMut(usize) -> Place,
    ) -> impl Iterator<Item = (usize, [f32; 2])> {
        let count = self.set_places(lanes, place);
        self.numbers.pairs(&mut self.arrays, count);
        let [first, second] = [3, 4].map(|array| self.arrays.floats(array));
        lanes.iter().enumerate().map(|(index, lane)| (lane, [first[index], second[index]]))
    }

    /// Loads the places of lanes without gaps, and returns their number.
    fn set_places(&mut self, lanes: LaneSet, mut place: impl FnMut(usize) -> Place) -> usize {
        for (index, lane) in lanes.iter().enumerate() {
            let Place { key, dimension, sample } = place(lane);
            for (array, word) in [key, dimension, sample].into_iter().enumerate() {
                self.arrays.words_mut(array)[index] = word;
            }
        }
        lanes.active.count_ones() as usize
    }
}
