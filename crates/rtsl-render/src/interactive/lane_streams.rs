//! Where the rays of a packet stand in their sequences of random numbers.

use fearless_simd::{Level, Simd, dispatch};

use crate::acceleration::{LANES, LaneMask};
use crate::sampling::{ANY_COUNT, INDEPENDENT, POWER_OF_TWO, Sampler, child_key};

/// Lanes whose numbers are made at a time.
const STEP: usize = 8;

/// A place in a sequence for each lane.
#[derive(Clone, Debug)]
pub struct LaneStreams {
    /// Which sequences they are.
    pub keys: [u32; LANES],
    /// Which sample of its pixel all rays belong to.
    sample: u32,
    dimensions: [u32; LANES],
    children: [u32; LANES],
}

impl LaneStreams {
    /// The beginnings of sequences.
    pub fn new(keys: [u32; LANES], sample: u32) -> Self {
        LaneStreams { keys, sample, dimensions: [0; LANES], children: [0; LANES] }
    }

    /// The streams of rays that those of `lanes` spawn: each depends on its ray, and on how many rays
    /// that spawned before, alone.
    pub fn spawn(&mut self, lanes: LaneMask) -> LaneStreams {
        let mut keys = [0; LANES];
        for (lane, key) in keys.iter_mut().enumerate() {
            self.children[lane] = self.children[lane].wrapping_add((lanes >> lane) as u32 & 1);
            *key = child_key(self.keys[lane], self.children[lane]);
        }
        LaneStreams::new(keys, self.sample)
    }

    /// The next numbers of up to as many lanes as `values` has, from `first` on: of those with a bit in
    /// `active`. What the others get means nothing.
    pub fn next(&mut self, sampler: &Sampler, first: usize, active: u32, values: &mut [f32]) {
        dispatch!(Level::new(), simd => match sampler.spread() {
            INDEPENDENT => self.next_in_vectors::<_, INDEPENDENT>(simd, sampler, first, active, values),
            POWER_OF_TWO => self.next_in_vectors::<_, POWER_OF_TWO>(simd, sampler, first, active, values),
            _ => self.next_in_vectors::<_, ANY_COUNT>(simd, sampler, first, active, values),
        });
    }

    #[inline(always)]
    fn next_in_vectors<S: Simd, const SPREAD: u8>(
        &mut self,
        _: S,
        sampler: &Sampler,
        first: usize,
        active: u32,
        values: &mut [f32],
    ) {
        for start in (0..values.len()).step_by(STEP) {
            let active = active.checked_shr(start as u32).unwrap_or(0);
            let Some(at) = first.checked_add(start).filter(|_| active != 0) else { break };
            let (Some(keys), Some(dimensions)) =
                (self.keys.get(at..), self.dimensions.get_mut(at..))
            else {
                break;
            };
            let values = &mut values[start..];
            let number = |key: u32, dimension: u32| {
                sampler.number_of_stream::<SPREAD>(key, dimension, self.sample)
            };
            let step = (keys.first_chunk(), dimensions.first_chunk_mut(), values.first_chunk_mut());
            // Arrays of known length are what becomes vectors.
            if let (
                Some::<&[u32; STEP]>(keys),
                Some::<&mut [u32; STEP]>(dimensions),
                Some::<&mut [f32; STEP]>(values),
            ) = step
            {
                for lane in 0..STEP {
                    values[lane] = number(keys[lane], dimensions[lane]);
                    dimensions[lane] = dimensions[lane].wrapping_add(active >> lane & 1);
                }
                continue;
            }
            for (lane, ((key, dimension), value)) in
                keys.iter().zip(dimensions).zip(values).enumerate()
            {
                *value = number(*key, *dimension);
                *dimension = dimension.wrapping_add(active >> lane & 1);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::sampling::SamplerKind;

    use super::*;

    const SAMPLER: Sampler =
        Sampler { kind: SamplerKind::Stratified { jitter: true }, columns: 4, rows: 4, seed: 0 };

    fn streams() -> LaneStreams {
        LaneStreams::new(std::array::from_fn(|lane| SAMPLER.stream_key(lane as u32)), 3)
    }

    #[test]
    fn numbers_do_not_depend_on_who_asks_along() {
        let (mut together, mut alone) = (streams(), streams());
        let mut of_all = [0.0; 16];
        // Lanes 20, 22 and 31 ask, lane 22 twice.
        for active in [0b1000_0000_0101, 0b100] {
            together.next(&SAMPLER, 20, active, &mut of_all);
        }
        let mut of_one = [0.0; 1];
        for _ in 0..2 {
            alone.next(&SAMPLER, 22, 1, &mut of_one);
        }
        assert_eq!(of_all[2].to_bits(), of_one[0].to_bits());
        assert_eq!(together.dimensions[20..32], [1, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 1]);
    }

    #[test]
    fn rays_of_one_parent_differ() {
        let mut parents = streams();
        let (first, second) = (parents.spawn(0b11), parents.spawn(0b10));
        assert_ne!(first.keys[1], second.keys[1]);
        // Lane 0 spawned none the second time.
        assert_eq!(parents.spawn(0b01).keys[0], {
            let mut other = streams();
            other.spawn(0b01);
            other.spawn(0b01).keys[0]
        });
    }
}
