//! Random numbers of the paths of a batch.

use rtsl::host::{Host, LaneFloats, LaneSet};
use rtsl_math::sampling::{Sampler, hash, unit_float};

use super::rows::BATCH_LANES;

/// Sequences of random numbers, one for each lane of a batch. It is the host of methods that call no host function but
/// `rand()`.
pub struct RandomNumbers {
    sampler: Sampler,
    keys: [u32; BATCH_LANES],
    /// The counts of numbers drawn.
    dimensions: [u32; BATCH_LANES],
    /// The sample indices of the lanes.
    samples: [u32; BATCH_LANES],
}

impl RandomNumbers {
    /// Creates the host without sequences.
    pub fn new(sampler: Sampler) -> Self {
        const NONE: [u32; BATCH_LANES] = [0; BATCH_LANES];
        RandomNumbers { sampler, keys: NONE, dimensions: NONE, samples: NONE }
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
        for lane in lanes.iter() {
            let at = lanes.base as usize + lane;
            let dimension = &mut self.dimensions[at];
            values[lane] = self.sampler.number(self.keys[at], *dimension, self.samples[at]);
            *dimension = dimension.wrapping_add(1);
        }
    }
}

#[cfg(test)]
mod tests {
    use rtsl::host::MAX_LANES;
    use rtsl_math::sampling::SamplerKind;

    use super::*;

    /// Each lane has the numbers of its own sequence, whoever asks along.
    #[test]
    fn lanes_draw_their_own_numbers() {
        let sampler = Sampler { kind: SamplerKind::Sobol, columns: 4, rows: 4, seed: 1 };
        let (keys, samples) = (std::array::from_fn(|lane| lane as u32 / 2), [7; BATCH_LANES]);
        let mut numbers = RandomNumbers::new(sampler);
        numbers.start(&keys, &samples, 5, 43);
        let mut draw = |active: u32| {
            let mut values = [0.0; MAX_LANES];
            numbers.rand(LaneSet { base: 16, active }, &mut values);
            values
        };
        let expected = |lane: usize, count: u32| sampler.number(hash(keys[lane], 5), count, 7);
        let (first, second) = (draw(0b11), draw(0b10));
        assert_eq!(
            [first[0], first[1], second[0], second[1]],
            [expected(16, 0), expected(17, 0), 0.0, expected(17, 1)]
        );
        assert_eq!(draw(0b1)[0], expected(16, 1));
    }
}
