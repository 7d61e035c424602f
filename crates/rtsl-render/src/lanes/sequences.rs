//! Positions of lanes in their random sequences, and the numbers that requests of kernels get from them.
//!
//! Hosts answer `rand()` by [`Sequences::next`], so that one place handles requests, which are windows of
//! lanes of any width at any start.

use fearless_simd::{Level, Simd, dispatch};
use rtsl::host::{LaneFloats, LaneSet, MAX_LANES};
use rtsl_math::SIMD_LANES;
use rtsl_math::sampling::{ANY_COUNT, INDEPENDENT, POWER_OF_TWO, SOBOL, Sampler};

use super::request_lanes::{from_packet, to_packet};

/// A position in a sequence for each of some lanes.
#[derive(Clone, Debug)]
pub struct Sequences<const LANES: usize> {
    keys: [u32; LANES],
    /// The count of numbers that each lane has drawn.
    dimensions: [u32; LANES],
}

impl<const LANES: usize> Sequences<LANES> {
    /// Creates the starts of the sequences with these keys.
    pub fn new(keys: [u32; LANES]) -> Self {
        Sequences { keys, dimensions: [0; LANES] }
    }

    /// Starts other sequences: `derive` sets the keys of the first lanes in the slice that it gets.
    #[inline(always)]
    pub fn restart(&mut self, count: usize, derive: impl FnOnce(&mut [u32])) {
        derive(&mut self.keys[..count]);
        self.dimensions[..count].fill(0);
    }

    /// Draws the next numbers of a request's lanes, which have these sample indices. Other lanes are undefined.
    pub fn next(
        &mut self,
        sampler: &Sampler,
        samples: &[u32; LANES],
        lanes: LaneSet,
        values: &mut LaneFloats,
    ) {
        debug_assert!(end_of(lanes) <= LANES, "{lanes:?} of {LANES} lanes");
        dispatch!(Level::new(), simd => match sampler.spread() {
            INDEPENDENT => self.next_in_vectors::<_, INDEPENDENT>(simd, sampler, samples, lanes, values),
            POWER_OF_TWO => self.next_in_vectors::<_, POWER_OF_TWO>(simd, sampler, samples, lanes, values),
            SOBOL => self.next_in_vectors::<_, SOBOL>(simd, sampler, samples, lanes, values),
            _ => self.next_in_vectors::<_, ANY_COUNT>(simd, sampler, samples, lanes, values),
        });
    }

    #[inline(always)]
    fn next_in_vectors<S: Simd, const SPREAD: u8>(
        &mut self,
        _: S,
        sampler: &Sampler,
        samples: &[u32; LANES],
        lanes: LaneSet,
        values: &mut LaneFloats,
    ) {
        // Local copies, which cannot alias: otherwise the loop is not vectorised.
        let (mut keys, mut dimensions, mut numbers) =
            ([0; MAX_LANES], [0; MAX_LANES], [0.0; MAX_LANES]);
        from_packet(lanes, &self.keys, &mut keys);
        from_packet(lanes, &self.dimensions, &mut dimensions);
        let mut samples_of_lanes = [0; MAX_LANES];
        from_packet(lanes, samples, &mut samples_of_lanes);
        for start in (0..MAX_LANES).step_by(SIMD_LANES) {
            if lanes.active >> start == 0 {
                break;
            }
            for lane in start..start + SIMD_LANES {
                numbers[lane] = sampler.number_of_stream::<SPREAD>(
                    keys[lane],
                    dimensions[lane],
                    samples_of_lanes[lane],
                );
                dimensions[lane] = u32::wrapping_add(dimensions[lane], lanes.active >> lane & 1);
            }
        }
        *values = numbers;
        to_packet(lanes, &dimensions, &mut self.dimensions);
    }
}

/// Returns the index after the last requesting lane.
pub fn end_of(lanes: LaneSet) -> usize {
    lanes.base as usize + (u32::BITS - lanes.active.leading_zeros()) as usize
}

#[cfg(test)]
mod tests {
    use rtsl_math::sampling::SamplerKind;

    use super::*;

    /// Neither a multiple of sixteen nor of a request's width, so that windows extend past the last lane.
    const LANES: usize = 43;

    const SAMPLERS: [Sampler; 4] = [
        Sampler { kind: SamplerKind::Independent, columns: 4, rows: 4, seed: 1 },
        Sampler { kind: SamplerKind::Stratified { jitter: true }, columns: 4, rows: 4, seed: 1 },
        Sampler { kind: SamplerKind::Stratified { jitter: true }, columns: 5, rows: 3, seed: 1 },
        Sampler { kind: SamplerKind::Sobol, columns: 4, rows: 4, seed: 1 },
    ];

    fn sequences(sampler: &Sampler) -> Sequences<LANES> {
        Sequences::new(std::array::from_fn(|lane| sampler.pixel_keys(lane as u32).stream))
    }

    /// Draws three numbers for all lanes, one after another, but only two for lane 5, in requests of `width` lanes.
    fn numbers(sampler: &Sampler, samples: &[u32; LANES], width: usize) -> [[u32; LANES]; 3] {
        let mut sequences = sequences(sampler);
        [0, 1, 2].map(|time| {
            let mut numbers = [0; LANES];
            for base in (0..LANES).step_by(width) {
                let mut active = u32::MAX >> (32 - width.min(LANES - base));
                if time == 1 && (base..base + width).contains(&5) {
                    active &= !(1 << (5 - base));
                }
                let lanes = LaneSet { base: base as u32, active };
                let mut values = [0.0; MAX_LANES];
                sequences.next(sampler, samples, lanes, &mut values);
                for lane in lanes.iter() {
                    numbers[base + lane] = values[lane].to_bits();
                }
            }
            numbers
        })
    }

    /// The number of this dimension for a lane.
    fn number(sampler: &Sampler, samples: &[u32; LANES], lane: usize, dimension: u32) -> u32 {
        sampler
            .single_number(sampler.pixel_keys(lane as u32).stream, dimension, samples[lane])
            .to_bits()
    }

    #[test]
    fn every_lane_gets_its_numbers_whoever_asks_along() {
        let each = std::array::from_fn(|lane| lane as u32 % 15);
        for sampler in &SAMPLERS {
            for samples in [&[7; LANES], &each] {
                let number = |lane, dimension| number(sampler, samples, lane, dimension);
                let expected = [0, 1, 2].map(|time| {
                    std::array::from_fn(|lane| match (lane, time) {
                        // Lane 5 does not request it.
                        (5, 1) => 0,
                        (5, 2) => number(5, 1),
                        _ => number(lane, time),
                    })
                });
                for width in [1, 2, 3, 4, 8, 16] {
                    let numbers = numbers(sampler, samples, width);
                    assert_eq!(numbers, expected, "{sampler:?}, {width} lanes");
                }
            }
        }
    }
}
