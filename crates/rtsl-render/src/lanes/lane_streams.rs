//! The positions of a packet's rays in their random sequences.

use rtsl::host::{LaneFloats, LaneSet};
use rtsl_bvh::{LANES, LaneMask};
use rtsl_math::sampling::{Sampler, child_key};

use super::sequences::{Samples, Sequences};

/// A position in a sequence for each lane.
#[derive(Clone, Debug)]
pub struct LaneStreams {
    sequences: Sequences<LANES>,
    /// The sample index of all rays.
    sample: u32,
    children: [u32; LANES],
}

impl LaneStreams {
    /// Creates the starts of sequences.
    pub fn new(keys: [u32; LANES], sample: u32) -> Self {
        LaneStreams { sequences: Sequences::new(keys), sample, children: [0; LANES] }
    }

    /// Sets the streams of rays that those of `lanes` spawn: each depends on its ray, and on the number of rays that it
    /// spawned before.
    // In place, and inlined into code with vectors of eight: passed by value, and with the baseline vector width, this
    // was a large part of the 2700 instructions of a host's answer to `trace`, which now takes 1100.
    #[inline(always)]
    pub fn spawn(&mut self, lanes: LaneMask, spawned: &mut LaneStreams) {
        let LaneStreams { sequences, sample, children } = self;
        for (lane, child) in children.iter_mut().enumerate() {
            *child = child.wrapping_add((lanes >> lane) as u32 & 1);
        }
        let parents = sequences.keys();
        spawned.sequences.restart(LANES, |keys| {
            for ((key, parent), child) in keys.iter_mut().zip(parents).zip(&*children) {
                *key = child_key(*parent, *child);
            }
        });
        (spawned.sample, spawned.children) = (*sample, [0; LANES]);
    }

    /// Returns the next numbers of a request's lanes. Others are undefined.
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

    fn spawn(parents: &mut LaneStreams, lanes: LaneMask) -> LaneStreams {
        // The previous content is overwritten.
        let mut spawned = LaneStreams::new([7; LANES], 9);
        parents.spawn(lanes, &mut spawned);
        assert_eq!((spawned.sample, spawned.children), (3, [0; LANES]));
        spawned
    }

    #[test]
    fn rays_of_one_parent_differ() {
        let mut parents = streams();
        let (first, second) = (spawn(&mut parents, 0b11), spawn(&mut parents, 0b10));
        assert_ne!(first.sequences.keys()[1], second.sequences.keys()[1]);
        // Lane 0 spawned no ray the second time.
        assert_eq!(spawn(&mut parents, 0b01).sequences.keys()[0], {
            let mut other = streams();
            spawn(&mut other, 0b01);
            spawn(&mut other, 0b01).sequences.keys()[0]
        });
    }
}
