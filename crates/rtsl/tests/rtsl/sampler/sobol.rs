//! Owen-scrambled points of Sobol's sequence.

use rtsl_math::sampling::hash;

use super::{call, equal, floats, function, hashes};

/// Returns the points of the first samples by the keys of pairs.
fn points(samples: u32) -> impl Iterator<Item = Vec<(f32, f32)>> {
    let pair = function("rt_sobolPair", &[]);
    hashes(0xF11F, 40).into_iter().map(move |key| {
        let numbers = call(&pair, &[equal(key, samples), (0..samples).collect()]);
        floats(&numbers[0]).into_iter().zip(floats(&numbers[1])).collect()
    })
}

/// True if every elementary interval of 2^-m contains one of 2^m points.
fn is_net(points: &[(f32, f32)]) -> bool {
    let m = points.len().ilog2();
    (0..=m).all(|columns| {
        let [width, height] = [columns, m - columns].map(|bits| (1 << bits) as f32);
        let cell = |(x, y): &(f32, f32)| ((x * width) as u32, (y * height) as u32);
        let mut cells: Vec<(u32, u32)> = points.iter().map(cell).collect();
        cells.sort_unstable();
        cells.dedup();
        cells.len() == points.len()
    })
}

#[test]
fn every_elementary_interval_holds_one_point() {
    for points in points(4 << 10) {
        for m in 0..=10 {
            assert!(is_net(&points[..1 << m]), "first 2^{m}");
            assert!(is_net(&points[3 << m..4 << m]), "fourth 2^{m}");
        }
    }
}

#[test]
fn points_that_are_not_aligned_are_no_net() {
    assert!(!points(17).all(|points| is_net(&points[1..17])));
}

#[test]
fn the_matrix_is_pascals_triangle() {
    // Row i of the product: the sum over j of (j choose i) and bit j, which is odd where i's bits are among j's.
    let row = |index: u32, i: u32| {
        (0..32_u32).filter(|j| j & i == i && index >> j & 1 == 1).count() as u32 & 1
    };
    let product = |index: &u32| (0..32).fold(0, |bits, i| bits | row(*index, i) << i);
    let indices = hashes(5, 256);
    let expected: Vec<u32> = indices.iter().map(product).collect();
    let pascal = function("rt_pascal", &[]);
    assert_eq!(call(&pascal, &[indices.clone(), equal(u32::MAX, 256)]), [expected]);
    assert_eq!(call(&pascal, &[indices.clone(), equal(0, 256)]), [indices]);
}

/// Two numbers with equal first bits keep this property, and differ first at the same bit.
#[test]
fn scrambling_keeps_prefixes_together() {
    let owen_hash = function("rt_owenHash", &[]);
    for word in hashes(0xF11F, 40) {
        let others: Vec<u32> = (0..32).map(|bit| word ^ 1 << bit).chain([word]).collect();
        let scrambled = call(&owen_hash, &[others, equal(77, 33)]).swap_remove(0);
        for (bit, other) in scrambled[..32].iter().enumerate() {
            assert_eq!((scrambled[32] ^ other).trailing_zeros(), bit as u32);
        }
    }
}

/// In a true Owen scrambling, a bit is flipped for half of all seeds, for every prefix of bits before it, and the flips
/// of different prefixes are independent.
#[test]
fn flips_are_fair_and_independent() {
    const SEEDS: u32 = 8192;
    let owen_hash = function("rt_owenHash", &[]);
    let flips = |word: u32, bit: u32| {
        let scrambled = call(&owen_hash, &[equal(word, SEEDS), hashes(9, SEEDS)]);
        scrambled[0].iter().map(|it| (it ^ word) >> bit & 1).collect::<Vec<u32>>()
    };
    // Five standard deviations of a binomial count; some hundred pairs are tested.
    let bound = 5.0 * f64::from(SEEDS).sqrt() / 2.0;
    for bit in [1_u32, 2, 5, 8, 13, 21, 31] {
        let prefix = hash(3, bit) & ((1 << bit) - 1);
        let ones = flips(prefix, bit);
        let heads = ones.iter().sum();
        for other in 0..bit {
            let others = flips(prefix ^ 1 << other, bit);
            let equal = ones.iter().zip(&others).filter(|(one, other)| one == other).count();
            for count in [heads, equal as u32] {
                let off = (f64::from(count) - f64::from(SEEDS) / 2.0).abs();
                assert!(off < bound, "bit {bit}, prefixes differ in {other}: {count}");
            }
        }
    }
}
