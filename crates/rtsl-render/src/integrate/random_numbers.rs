//! Random numbers of the paths of a batch.

use std::sync::Arc;

use rtsl::SamplerNumbers;
use rtsl::host::{Host, LaneFloats, LaneSet};
use rtsl_math::sampling::{hash, unit_float};

use super::drawn_numbers::{DrawnNumbers, Place};
use super::rows::BATCH_LANES;

/// Sequences of random numbers, one for each lane of a batch. It is the host of methods that call no host function but
/// `rand()`.
pub struct RandomNumbers {
    drawn: DrawnNumbers,
    keys: [u32; BATCH_LANES],
    /// The counts of numbers drawn.
    dimensions: [u32; BATCH_LANES],
    /// The sample indices of the lanes.
    samples: [u32; BATCH_LANES],
}

impl RandomNumbers {
    /// Creates the host without sequences.
    pub fn new(numbers: &Arc<SamplerNumbers>) -> Self {
        const NONE: [u32; BATCH_LANES] = [0; BATCH_LANES];
        let drawn = DrawnNumbers::new(numbers);
        RandomNumbers { drawn, keys: NONE, dimensions: NONE, samples: NONE }
    }

    /// Starts sequences of the first `count` lanes, which `purpose` selects among those of `keys`. `samples` are the
    /// lanes' sample indices.
    pub fn start(
        &mut self,
        keys: &[u32; BATCH_LANES],
        samples: &[u32; BATCH_LANES],
        purpose: u32,
        count: usize,
    ) {
        let all = self.keys[..count].iter_mut().zip(keys);
        all.for_each(|(to, key)| *to = hash(*key, purpose));
        self.dimensions[..count].fill(0);
        self.samples[..count].copy_from_slice(&samples[..count]);
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
        let RandomNumbers { drawn, keys, dimensions, samples } = self;
        let place = |lane: usize| {
            let at = lanes.base as usize + lane;
            let dimension = dimensions[at];
            dimensions[at] = dimension.wrapping_add(1);
            Place { key: keys[at], dimension, sample: samples[at] }
        };
        drawn.singles(lanes, place).for_each(|(lane, number)| values[lane] = number);
    }
}

#[cfg(test)]
mod tests {
    use rtsl::host::MAX_LANES;
    use rtsl::{Engine, EngineOptions};
    use rtsl_math::sampling::{Sampler, SamplerKind};

    use super::*;

    /// Each lane has the numbers of its own sequence, whoever asks along.
    #[test]
    fn lanes_draw_their_own_numbers() {
        let sampler = Sampler { kind: SamplerKind::Sobol, columns: 4, rows: 4, seed: 1 };
        let (keys, samples) = (std::array::from_fn(|lane| lane as u32 / 2), [7; BATCH_LANES]);
        let engine = Engine::new(EngineOptions::default()).expect("an engine").0;
        let of_sampler = Arc::new(SamplerNumbers::new(&engine, sampler));
        let mut numbers = RandomNumbers::new(&of_sampler);
        numbers.start(&keys, &samples, 5, 43);
        let mut draw = |active: u32| {
            let mut values = [0.0; MAX_LANES];
            numbers.rand(LaneSet { base: 16, active }, &mut values);
            values
        };
        let mut alone = DrawnNumbers::new(&of_sampler);
        let mut expected = |lane: usize, dimension: u32| {
            let place = Place { key: hash(keys[lane], 5), dimension, sample: 7 };
            alone.singles(LaneSet { base: 0, active: 1 }, |_| place).next().expect("a lane").1
        };
        let (first, second) = (draw(0b11), draw(0b10));
        assert_eq!(
            [first[0], first[1], second[0], second[1]],
            [expected(16, 0), expected(17, 0), 0.0, expected(17, 1)]
        );
        assert_eq!(draw(0b1)[0], expected(16, 1));
    }
}
