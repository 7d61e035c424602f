//! 32-bit integer hashing and permutation, suited to vectorisation.

/// A hash of two words that depends on every bit of both.
#[inline(always)]
pub fn hash(a: u32, b: u32) -> u32 {
    mix(mix(a).wrapping_add(b).wrapping_add(0x9E37_79B9))
}

/// A bijection with little bias: two rounds of a shifted exclusive-or and an odd factor, as found by search (Wellons,
/// "Prospecting for Hash Functions", 2018).
#[inline(always)]
pub fn mix(word: u32) -> u32 {
    let word = (word ^ word >> 16).wrapping_mul(0x7FEB_352D);
    let word = (word ^ word >> 15).wrapping_mul(0x846C_A68B);
    word ^ word >> 16
}

/// Converts the upper 24 bits to a number in [0,1); every value is exact in binary32.
#[inline(always)]
pub fn unit_float(bits: u32) -> f32 {
    // Through i32, for which every machine has a vector conversion.
    (bits >> 8) as i32 as f32 * (1.0 / 16_777_216.0)
}

/// Element `index` of the permutation of `0..length` selected by `key`: a permutation of the next power of two,
/// iterated until the value is in range (cycle walking).
pub fn permute(index: u32, length: u32, key: u32) -> u32 {
    if length <= 1 {
        return 0;
    }
    if length.is_power_of_two() {
        return permute_power_of_two(index, length, key);
    }
    let mut value = index.min(length - 1);
    loop {
        value = permute_power_of_two(value, length.next_power_of_two(), key);
        if value < length {
            return value;
        }
    }
}

/// The same for a length that is a power of two: a bijective hash.
fn permute_power_of_two(index: u32, length: u32, key: u32) -> u32 {
    let mask = length.wrapping_sub(1);
    let shift = (mask.count_ones() / 2).max(1);
    let mut value = index & mask;
    for round in 0..4 {
        let word = hash(key, round);
        // An odd factor, an addition and a shifted exclusive-or are each bijective.
        value = value.wrapping_mul(word | 1).wrapping_add(word >> 16) & mask;
        value ^= value >> shift;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn permutations_are_permutations() {
        for length in [1, 2, 3, 4, 7, 16, 25, 100] {
            for key in 0..20 {
                let mut seen: Vec<u32> =
                    (0..length).map(|index| permute(index, length, key)).collect();
                seen.sort_unstable();
                assert_eq!(seen, (0..length).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn numbers_are_even() {
        const COUNT: u32 = 1 << 16;
        let mut bins = [0_u32; 16];
        for index in 0..COUNT {
            bins[(unit_float(hash(7, index)) * 16.0) as usize] += 1;
        }
        let expected = f64::from(COUNT) / 16.0;
        let chi_square: f64 = bins
            .iter()
            .map(|count| {
                let difference = f64::from(*count) - expected;
                difference * difference / expected
            })
            .sum();
        // 15 degrees of freedom: 1 in 1000 exceeds 37.7.
        assert!(chi_square < 37.7, "{chi_square}");
    }
}
