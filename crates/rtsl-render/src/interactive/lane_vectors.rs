//! Vectors of all lanes of a packet: loops that compilers turn into SIMD code, with the operations of
//! the functions for one vector in their order, so that the bits are the same.
//!
//! Lanes are done eight at a time, and eights of which none takes part are left out.

use rtsl::LaneBlock;

use crate::acceleration::{LANES, LaneMask, Lanes};
use crate::math::Affine;

/// A vector for each lane, component by component.
pub type LaneVectors = [Lanes; 3];

/// Lanes of one step.
const STEP: usize = 8;

/// Whether some of the eight lanes from `start` on take part.
#[inline(always)]
const fn has_any(lanes: LaneMask, start: usize) -> bool {
    lanes >> start & 0xFF != 0
}

/// A number for each of the lanes; others are 0, or what belongs to no lane that takes part.
#[inline(always)]
pub fn numbers(lanes: LaneMask, number: impl Fn(usize) -> f32) -> Lanes {
    let mut numbers = [0.0; LANES];
    for start in (0..LANES).step_by(STEP).filter(|start| has_any(lanes, *start)) {
        for (lane, to) in numbers.iter_mut().enumerate().skip(start).take(STEP) {
            *to = number(lane);
        }
    }
    numbers
}

/// Vectors by their components.
// A plain loop: closures within `array::from_fn` are not compiled for the vectors of the caller.
#[inline(always)]
pub fn vectors(lanes: LaneMask, component: impl Fn(usize, usize) -> f32) -> LaneVectors {
    let mut vectors = [[0.0; LANES]; 3];
    for (axis, numbers) in vectors.iter_mut().enumerate() {
        for start in (0..LANES).step_by(STEP).filter(|start| has_any(lanes, *start)) {
            for (lane, to) in numbers.iter_mut().enumerate().skip(start).take(STEP) {
                *to = component(axis, lane);
            }
        }
    }
    vectors
}

/// The vectors that start at component `first` of a block.
#[inline(always)]
pub fn load(block: &LaneBlock, first: usize, lanes: LaneMask) -> LaneVectors {
    let arrays = [
        array(block.floats(first)),
        array(block.floats(first + 1)),
        array(block.floats(first + 2)),
    ];
    vectors(lanes, |axis, lane| arrays[axis][lane])
}

/// Sets the vectors that start at component `first` of a block, for `lanes` only.
#[inline(always)]
pub fn store(block: &mut LaneBlock, first: usize, lanes: LaneMask, values: &LaneVectors) {
    for (axis, values) in values.iter().enumerate() {
        store_numbers(block, first + axis, lanes, values);
    }
}

/// Sets the numbers at a component of a block, for `lanes` only.
#[inline(always)]
pub fn store_numbers(block: &mut LaneBlock, component: usize, lanes: LaneMask, values: &Lanes) {
    blend(lanes, values, block.floats_mut(component));
}

/// Sets one number for all of `lanes`.
#[inline(always)]
pub fn fill(block: &mut LaneBlock, component: usize, lanes: LaneMask, value: f32) {
    store_numbers(block, component, lanes, &[value; LANES]);
}

/// Copies `from` to `to` for `lanes` only.
#[inline(always)]
pub fn blend(lanes: LaneMask, from: &Lanes, to: &mut [f32]) {
    let Ok(to) = <&mut Lanes>::try_from(to) else { return };
    for start in (0..LANES).step_by(STEP).filter(|start| has_any(lanes, *start)) {
        let on = (lanes >> start) as u32;
        for lane in 0..STEP {
            let place = start + lane;
            to[place] = if on >> lane & 1 != 0 { from[place] } else { to[place] };
        }
    }
}

/// Adds `from` to `to` for `lanes` only.
#[inline(always)]
pub fn add(lanes: LaneMask, from: &Lanes, to: &mut Lanes) {
    for start in (0..LANES).step_by(STEP).filter(|start| has_any(lanes, *start)) {
        let on = (lanes >> start) as u32;
        for lane in 0..STEP {
            let place = start + lane;
            let sum = to[place] + from[place];
            to[place] = if on >> lane & 1 != 0 { sum } else { to[place] };
        }
    }
}

/// The array of a block for a packet.
#[inline(always)]
pub fn array(floats: &[f32]) -> &Lanes {
    const NONE: &Lanes = &[0.0; LANES];
    floats.try_into().unwrap_or(NONE)
}

/// `Affine::vector` of each lane.
#[inline(always)]
pub fn mapped_vectors(map: &Affine, v: &LaneVectors, lanes: LaneMask) -> LaneVectors {
    let [x, y, z, _] = &map.columns;
    vectors(lanes, |row, lane| x[row] * v[0][lane] + y[row] * v[1][lane] + z[row] * v[2][lane])
}

/// `Affine::transposed_vector` of each lane.
#[inline(always)]
pub fn transposed_vectors(map: &Affine, v: &LaneVectors, lanes: LaneMask) -> LaneVectors {
    vectors(lanes, |row, lane| {
        let column = &map.columns[row];
        column[0] * v[0][lane] + column[1] * v[1][lane] + column[2] * v[2][lane]
    })
}

/// The scalar product of each lane.
#[inline(always)]
pub fn dots(a: &LaneVectors, b: &LaneVectors, lanes: LaneMask) -> Lanes {
    numbers(lanes, |lane| {
        a[0][lane] * b[0][lane] + a[1][lane] * b[1][lane] + a[2][lane] * b[2][lane]
    })
}

/// `normalize_or` of each lane.
#[inline(always)]
pub fn normalized_or(v: &LaneVectors, otherwise: &LaneVectors, lanes: LaneMask) -> LaneVectors {
    let larger = |a: f32, b: f32| if a > b { a } else { b };
    let largest =
        numbers(lanes, |lane| larger(larger(v[0][lane].abs(), v[1][lane].abs()), v[2][lane].abs()));
    let scaled = vectors(lanes, |axis, lane| v[axis][lane] / largest[lane]);
    let squares = dots(&scaled, &scaled, lanes);
    let lengths = numbers(lanes, |lane| squares[lane].sqrt());
    // No length where a component is NaN or infinite, or all are 0: NaN fails the comparison.
    vectors(lanes, |axis, lane| {
        let has_length = lengths[lane] >= 1.0 && largest[lane] < f32::INFINITY;
        if has_length { scaled[axis][lane] / lengths[lane] } else { otherwise[axis][lane] }
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use crate::math::normalize_or;

    use super::*;

    fn component() -> impl Strategy<Value = f32> {
        prop_oneof![-2.0_f32..2.0, any::<f32>(), Just(0.0), Just(f32::INFINITY), Just(f32::NAN)]
    }

    proptest! {
        #[test]
        fn lanes_are_normalised_as_single_vectors_are(
            x in component(), y in component(), z in component(), lane in 0..LANES,
        ) {
            let mut v = [[1.0; LANES]; 3];
            (v[0][lane], v[1][lane], v[2][lane]) = (x, y, z);
            let otherwise = [[0.0; LANES], [0.0; LANES], [1.0; LANES]];
            let normalised = normalized_or(&v, &otherwise, LaneMask::MAX);
            let expected = normalize_or([x, y, z], [0.0, 0.0, 1.0]);
            for axis in 0..3 {
                prop_assert_eq!(normalised[axis][lane].to_bits(), expected[axis].to_bits());
            }
        }
    }

    #[test]
    fn only_the_lanes_named_change() {
        let mut to = [1.0; LANES];
        blend(0x8000_0000_0000_0102, &[2.0; LANES], &mut to);
        let changed: Vec<usize> = (0..LANES).filter(|lane| to[*lane] == 2.0).collect();
        assert_eq!(changed, [1, 8, 63]);
    }
}
