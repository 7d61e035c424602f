//! Owen-scrambled Sobol points: each pair of dimensions is an independent (0,2)-sequence.
//!
//! The first two dimensions of Sobol's sequence are its best: of any aligned 2^m points each elementary interval of
//! area 2^-m contains one. Every pair therefore uses these two, with an independent order of samples (a nested uniform
//! shuffle, which keeps aligned blocks together) and independent scrambling (Burley, "Practical Hash-based Owen
//! Scrambling", JCGT 2020). A pixel's first 2^m samples are such a set for every m, so any number of samples can be
//! taken, and more added later.
//!
//! The computation uses 32-bit integers, without branches and tables: the first dimension is bit reversal, the second
//! is preceded by the matrix of Pascal's triangle modulo 2. With AVX2 a number takes 1.9 ns, or 1.6 ns as one of a
//! pair, against 0.9 ns for the independent sampler and 3.3 ns for the stratified one.

use super::hash::mix;

/// Returns a number of a pair, as 32 bits after the binary point. `component` is 0 or 1.
#[inline(always)]
pub fn sobol_bits(pair_key: u32, component: u32, sample: u32) -> u32 {
    let index = shuffled(sample, pair_key);
    // All bits for the second component, none for the first.
    let chosen = component.wrapping_neg();
    scrambled(pascal(index, chosen), pair_key, component)
}

/// Returns both numbers of a pair: the results of [`sobol_bits`].
#[inline(always)]
pub fn sobol_pair_bits(pair_key: u32, sample: u32) -> [u32; 2] {
    let index = shuffled(sample, pair_key);
    [scrambled(index, pair_key, 0), scrambled(pascal(index, u32::MAX), pair_key, 1)]
}

/// Returns the index that replaces `sample`. Any aligned block of 2^m indices is mapped to such a block.
#[inline(always)]
fn shuffled(sample: u32, pair_key: u32) -> u32 {
    owen_hash(sample.reverse_bits(), pair_key).reverse_bits()
}

/// Maps the index, multiplied by the matrix of its dimension, to the point.
///
/// A point is the bit reversal of that product, and scrambling hashes the reversal of a point: two of the three
/// reversals cancel.
#[inline(always)]
fn scrambled(product: u32, pair_key: u32, component: u32) -> u32 {
    // The hash breaks up any correlation between the seeds of the components and of the order.
    let seed = mix(pair_key.wrapping_add(component.wrapping_add(1).wrapping_mul(0x9E37_79B9)));
    owen_hash(product, seed).reverse_bits()
}

/// The product with the matrix whose element (i, j) is j choose i, modulo 2, for the bits that are
/// `chosen`: the fifth Kronecker power of ((1, 1), (0, 1)), so five steps do.
#[inline(always)]
fn pascal(index: u32, chosen: u32) -> u32 {
    let index = index ^ index >> 16 & 0x0000_FFFF & chosen;
    let index = index ^ index >> 8 & 0x00FF_00FF & chosen;
    let index = index ^ index >> 4 & 0x0F0F_0F0F & chosen;
    let index = index ^ index >> 2 & 0x3333_3333 & chosen;
    index ^ index >> 1 & 0x5555_5555 & chosen
}

/// A bijective hash in which each bit depends only on itself and lower ones, which makes it an Owen scrambling of
/// reversed numbers. The constants, found by search, leave less structure than those of the first such hashes (Vegdahl,
/// "Building a Better LK Hash", 2021).
#[inline(always)]
fn owen_hash(bits: u32, seed: u32) -> u32 {
    let bits = bits ^ bits.wrapping_mul(0x3D20_ADEA);
    let bits = bits.wrapping_add(seed).wrapping_mul(seed >> 16 | 1);
    let bits = bits ^ bits.wrapping_mul(0x0552_6C56);
    bits ^ bits.wrapping_mul(0x53A2_2864)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::sampling::hash;

    const PAIRS: u32 = 40;

    fn pair_keys() -> impl Iterator<Item = u32> {
        (0..PAIRS).map(|index| hash(0xF11F, index))
    }

    fn points(pair_key: u32, samples: std::ops::Range<u32>) -> Vec<[u32; 2]> {
        samples.map(|sample| sobol_pair_bits(pair_key, sample)).collect()
    }

    /// True if every elementary interval of 2^-m contains one of 2^m points.
    fn is_net(points: &[[u32; 2]]) -> bool {
        let m = points.len().ilog2();
        (0..=m).all(|columns| {
            let mut cells: Vec<u64> = points
                .iter()
                .map(|[x, y]| {
                    u64::from(*x) >> (32 - columns) << 32 | u64::from(*y) >> (32 - m + columns)
                })
                .collect();
            cells.sort_unstable();
            cells.dedup();
            cells.len() == points.len()
        })
    }

    #[test]
    fn every_elementary_interval_holds_one_point() {
        for key in pair_keys() {
            for m in 0..=10 {
                assert!(is_net(&points(key, 0..1 << m)), "first 2^{m} of {key:#x}");
                assert!(is_net(&points(key, 3 << m..4 << m)), "fourth 2^{m} of {key:#x}");
            }
        }
    }

    #[test]
    fn points_that_are_not_aligned_are_no_net() {
        assert!(!pair_keys().all(|key| is_net(&points(key, 1..17))));
    }

    #[test]
    fn scrambling_keeps_prefixes_together() {
        // Two numbers with equal first bits keep this property, and differ first at the same bit.
        for key in pair_keys() {
            for bit in 0..32 {
                let [a, b] = [key, key ^ 1 << bit].map(|bits| owen_hash(bits, 77));
                assert_eq!((a ^ b).trailing_zeros(), bit);
            }
        }
    }

    /// In a true Owen scrambling, a bit is flipped for half of all seeds, for every prefix of bits before it, and the
    /// flips of different prefixes are independent.
    #[test]
    fn flips_are_fair_and_independent() {
        const SEEDS: u32 = 8192;
        let flip = |bits: u32, seed: u32, bit: u32| (owen_hash(bits, seed) ^ bits) >> bit & 1;
        // Five standard deviations of a binomial count; some hundred pairs are tested.
        let bound = 5.0 * f64::from(SEEDS).sqrt() / 2.0;
        for bit in [1_u32, 2, 5, 8, 13, 21, 31] {
            for other in 0..bit {
                let (mut heads, mut equal) = (0_u32, 0_u32);
                for index in 0..SEEDS {
                    let seed = hash(9, index);
                    let prefix = hash(3, bit) & ((1 << bit) - 1);
                    let one = flip(prefix, seed, bit);
                    heads += one;
                    equal += u32::from(one == flip(prefix ^ 1 << other, seed, bit));
                }
                for count in [heads, equal] {
                    let off = (f64::from(count) - f64::from(SEEDS) / 2.0).abs();
                    assert!(off < bound, "bit {bit}, prefixes differ in {other}: {count}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn pairs_are_two_numbers(key in any::<u32>(), sample in any::<u32>()) {
            let pair = sobol_pair_bits(key, sample);
            prop_assert_eq!(pair, [sobol_bits(key, 0, sample), sobol_bits(key, 1, sample)]);
        }

        #[test]
        fn the_matrix_is_pascals_triangle(index in any::<u32>()) {
            // Row i of the product: the sum over j of (j choose i) and bit j, which is odd where i's bits are among j's.
            let row = |i: u32| (0..32_u32).filter(|j| j & i == i && index >> j & 1 == 1).count() as u32 & 1;
            let product = (0..32).fold(0, |bits, i| bits | row(i) << i);
            prop_assert_eq!(pascal(index, u32::MAX), product);
            prop_assert_eq!(pascal(index, 0), index);
        }
    }
}
