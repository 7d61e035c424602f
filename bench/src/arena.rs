//! The memory of a race: packets that all contenders read and write.

use rtsl::{LaneBlock, LaneMask, lookup_state, state_component_count};

use crate::packet::RAYS;
use crate::race::Race;
use crate::random::Random;

/// The value of outputs before they are written.
pub const UNSET: f32 = -12345.0;

/// The packets of a race.
pub struct Arena {
    /// The packets.
    pub packets: Vec<Memory>,
    /// The array that is changed in place, if there is one.
    in_place: Option<usize>,
    /// The number of arrays that are inputs only, or unused.
    inputs: usize,
    /// The number of arrays that the race names.
    arrays: usize,
}

/// The arrays of one packet.
pub struct Memory {
    /// The arrays that hand-written code shares, in the order of the race, followed by those that only RTSL uses.
    pub state: LaneBlock,
    /// The scratch arrays of the class.
    pub scratch: LaneBlock,
    /// The rays for which RTSL's `intersect` accepted a hit.
    pub accepted: LaneMask,
    /// The initial content of the array that is changed in place.
    restored: Vec<u32>,
}

impl Arena {
    /// Allocates memory for `packets` packets and fills their inputs.
    pub fn new(race: &Race, packets: usize, scratch_arrays: usize) -> Arena {
        let mut random = Random::new(1000);
        let mut components: Vec<u32> = race.state.iter().flat_map(|it| components_of(it)).collect();
        let arrays = components.len();
        components.extend(race.others.iter().flat_map(|(name, _)| components_of(name)));
        let in_place = race.in_place.then(|| race.inputs - 1);
        let packets = (0..packets).map(|_| {
            let mut state = LaneBlock::sparse(state_component_count() as usize, &components, RAYS);
            for (name, value) in race.others {
                for component in components_of(name) {
                    state.floats_mut(component as usize).fill(*value);
                }
            }
            for (lane, ray) in (race.rays)(&mut random).iter().enumerate() {
                assert_eq!(ray.len(), race.inputs, "an input for each array");
                for (array, input) in ray.iter().enumerate() {
                    state.memory_mut()[array * RAYS + lane] = input.to_bits();
                }
            }
            let restored = in_place.map(|it| array(&state, it).to_vec()).unwrap_or_default();
            let scratch = LaneBlock::new(scratch_arrays, RAYS);
            Memory { state, scratch, accepted: LaneMask::new(RAYS), restored }
        });
        Arena { packets: packets.collect(), in_place, inputs: race.inputs, arrays }
    }

    /// Fills all outputs with [`UNSET`], and restores the array that is changed in place.
    pub fn clear(&mut self) {
        for packet in &mut self.packets {
            let unset = UNSET.to_bits();
            packet.state.memory_mut()[self.inputs * RAYS..self.arrays * RAYS].fill(unset);
            packet.scratch.memory_mut().fill(unset);
            packet.restore(self.in_place);
        }
    }

    /// Returns the outputs of all packets, array by array: those of the state, the array changed in place first, then
    /// scratch. `None` marks elements that the call did not change.
    pub fn outputs(&self) -> Vec<Vec<Option<f32>>> {
        let state = self.in_place.into_iter().chain(self.inputs..self.arrays);
        let state = state.map(|index| {
            let packets = self.packets.iter().flat_map(|packet| {
                let restored = packet.restored.iter().filter(|_| Some(index) == self.in_place);
                let before = restored.copied().chain(std::iter::repeat(UNSET.to_bits()));
                changed(array(&packet.state, index), before)
            });
            packets.collect()
        });
        let scratch_arrays = self.packets.first().map_or(0, |packet| packet.scratch.components());
        let scratch = (0..scratch_arrays).map(|index| {
            let packets = self.packets.iter().flat_map(|packet| {
                changed(packet.scratch.words(index), std::iter::repeat(UNSET.to_bits()))
            });
            packets.collect()
        });
        state.chain(scratch).collect()
    }

    /// Calls `work` for each packet, after restoring the array that is changed in place.
    #[inline]
    pub fn for_each(&mut self, mut work: impl FnMut(&mut Memory)) {
        for packet in &mut self.packets {
            packet.restore(self.in_place);
            work(packet);
        }
    }
}

impl Memory {
    #[inline]
    fn restore(&mut self, in_place: Option<usize>) {
        if let Some(index) = in_place {
            let start = index * RAYS;
            self.state.memory_mut()[start..start + RAYS].copy_from_slice(&self.restored);
        }
    }
}

fn array(state: &LaneBlock, index: usize) -> &[u32] {
    &state.memory()[index * RAYS..(index + 1) * RAYS]
}

/// The floats that differ from their previous values.
fn changed(words: &[u32], before: impl Iterator<Item = u32>) -> impl Iterator<Item = Option<f32>> {
    let pairs = words.iter().zip(before);
    pairs.map(|(word, before)| (*word != before).then(|| f32::from_bits(*word)))
}

/// The components of a state variable.
fn components_of(name: &str) -> std::ops::Range<u32> {
    let variable = lookup_state(name).expect("races name variables of the language");
    variable.first_component..variable.first_component + variable.ty.components()
}
