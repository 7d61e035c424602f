//! Transposition of four consecutive numbers for each lane to four vectors of lanes.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x8};

/// Returns the first, second, third and fourth numbers of eight lanes. They are transposed in registers, because
/// loading a vector that was stored number by number stalls.
#[inline(always)]
pub fn fours<S: Simd>(simd: S, four: impl Fn(usize) -> [f32; 4]) -> [f32x8<S>; 4] {
    let load = |lane: usize| f32x4::load_array(simd, four(lane));
    let [a, b, c, d] = transposed([load(0), load(1), load(2), load(3)]);
    let [e, f, g, h] = transposed([load(4), load(5), load(6), load(7)]);
    [a.combine(e), b.combine(f), c.combine(g), d.combine(h)]
}

#[inline(always)]
fn transposed<S: Simd>([a, b, c, d]: [f32x4<S>; 4]) -> [f32x4<S>; 4] {
    let (even, later_even) = (a.zip_low(c), a.zip_high(c));
    let (odd, later_odd) = (b.zip_low(d), b.zip_high(d));
    [
        even.zip_low(odd),
        even.zip_high(odd),
        later_even.zip_low(later_odd),
        later_even.zip_high(later_odd),
    ]
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[test]
    fn each_vector_has_a_number_of_every_lane() {
        let four = |lane: usize| [0, 1, 2, 3].map(|index: usize| (10 * lane + index) as f32);
        let vectors = dispatch!(Level::new(), simd => {
            let [a, b, c, d] = fours(simd, four);
            [a.to_array(), b.to_array(), c.to_array(), d.to_array()]
        });
        for (index, vector) in vectors.iter().enumerate() {
            assert_eq!(*vector, std::array::from_fn(|lane| (10 * lane + index) as f32));
        }
    }
}
