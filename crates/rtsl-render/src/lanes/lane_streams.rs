//! Where the rays of a packet stand in their sequences of random numbers.

use rtsl::host::{LaneFloats, LaneSet};

use rtsl_bvh::{LANES, LaneMask};
use rtsl_math::sampling::{Sampler, child_key};

use super::sequences::{Samples, Sequences};

/// A place in a sequence for each lane.
#[derive(Clone, Debug)]
pub struct LaneStreams {
    sequences: Sequences<LANES>,
    /// Which sample of its pixel all rays belong to.
    sample: u32,
    children: [u32; LANES],
}

impl LaneStreams {
    /// The beginnings of sequences.
    pub fn new(keys: [u32; LANES], sample: u32) -> Self {
        LaneStreams { sequences: Sequences::new(keys), sample, children: [0; LANES] }
    }

    /// Which sequences they are.
    pub fn keys(&self) -> &[u32; LANES] {
        self.sequences.keys()
    }

    /// The streams of rays that those of `lanes` spawn: each depends on its ray, and on how many rays
    /// that spawned before, alone.
    pub fn spawn(&mut self, lanes: LaneMask) -> LaneStreams {
        let mut keys = [0; LANES];
        for (lane, key) in keys.iter_mut().enumerate() {
            self.children[lane] = self.children[lane].wrapping_add((lanes >> lane) as u32 & 1);
            *key = child_key(self.keys()[lane], self.children[lane]);
        }
        LaneStreams::new(keys, self.sample)
    }

    /// The next numbers of a request's lanes. What others get means nothing.
    pub fn next(&mut self, sampler: &Sampler, lanes: LaneSet, values: &mut LaneFloats) {
        self.sequences.next(sampler, Samples::Same(self.sample), lanes, values);
    }
}

#[cfg(test)]
mod tests {
    use rtsl_math::sampling::SamplerKind;

    use super::*;

    const SAMPLER: Sampler =
        Sampler { kind: SamplerKind::Stratified { jitter: true }, columns: 4, rows: 4, seed: 0 };

    fn streams() -> LaneStreams {
        LaneStreams::new(std::array::from_fn(|lane| SAMPLER.stream_key(lane as u32)), 3)
    }

    #[test]
    fn rays_of_one_parent_differ() {
        let mut parents = streams();
        let (first, second) = (parents.spawn(0b11), parents.spawn(0b10));
        assert_ne!(first.keys()[1], second.keys()[1]);
        // Lane 0 spawned none the second time.
        assert_eq!(parents.spawn(0b01).keys()[0], {
            let mut other = streams();
            other.spawn(0b01);
            other.spawn(0b01).keys()[0]
        });
    }
}
