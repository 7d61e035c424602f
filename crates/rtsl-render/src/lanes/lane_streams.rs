//! Where the rays of a packet stand in their sequences of random numbers.

use fearless_simd::{Level, Simd, dispatch};
use rtsl::host::{LaneFloats, LaneSet, MAX_LANES};

use crate::acceleration::{LANES, LaneMask};
use crate::sampling::{ANY_COUNT, INDEPENDENT, POWER_OF_TWO, SOBOL, Sampler, child_key};

use super::request_lanes::{from_packet, to_packet};

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

    /// The next numbers of a request's lanes. What others get means nothing.
    pub fn next(&mut self, sampler: &Sampler, lanes: LaneSet, values: &mut LaneFloats) {
        dispatch!(Level::new(), simd => match sampler.spread() {
            INDEPENDENT => self.next_in_vectors::<_, INDEPENDENT>(simd, sampler, lanes, values),
            POWER_OF_TWO => self.next_in_vectors::<_, POWER_OF_TWO>(simd, sampler, lanes, values),
            SOBOL => self.next_in_vectors::<_, SOBOL>(simd, sampler, lanes, values),
            _ => self.next_in_vectors::<_, ANY_COUNT>(simd, sampler, lanes, values),
        });
    }

    #[inline(always)]
    fn next_in_vectors<S: Simd, const SPREAD: u8>(
        &mut self,
        _: S,
        sampler: &Sampler,
        lanes: LaneSet,
        values: &mut LaneFloats,
    ) {
        let sample = self.sample;
        // Copies, which nothing else can change meanwhile: else the loop does not become vectors.
        let (mut keys, mut dimensions, mut numbers) =
            ([0; MAX_LANES], [0; MAX_LANES], [0.0; MAX_LANES]);
        from_packet(lanes, &self.keys, &mut keys);
        from_packet(lanes, &self.dimensions, &mut dimensions);
        for start in (0..MAX_LANES).step_by(STEP) {
            if lanes.active >> start == 0 {
                break;
            }
            for lane in start..start + STEP {
                numbers[lane] =
                    sampler.number_of_stream::<SPREAD>(keys[lane], dimensions[lane], sample);
                dimensions[lane] = u32::wrapping_add(dimensions[lane], lanes.active >> lane & 1);
            }
        }
        *values = numbers;
        to_packet(lanes, &dimensions, &mut self.dimensions);
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
        let (mut of_all, mut of_one) = ([0.0; MAX_LANES], [0.0; MAX_LANES]);
        // Lanes 48, 50 and 59 ask, lane 50 twice.
        for active in [0b1000_0000_0101, 0b100] {
            together.next(&SAMPLER, LaneSet { base: 48, active }, &mut of_all);
        }
        for _ in 0..2 {
            alone.next(&SAMPLER, LaneSet { base: 50, active: 1 }, &mut of_one);
        }
        assert_eq!(of_all[2].to_bits(), of_one[0].to_bits());
        assert_eq!(together.dimensions[48..60], [1, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 1]);
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
