//! Integer hashing and permutation.

/// A hash of two words in which every bit of both takes part: the output function of PCG's
/// "RXS-M-XS" on 64 bits, applied twice.
pub fn hash(a: u64, b: u64) -> u64 {
    mix(mix(a).wrapping_add(b).wrapping_add(0x9E37_79B9_7F4A_7C15))
}

fn mix(state: u64) -> u64 {
    let state =
        state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    let word = ((state >> ((state >> 59) + 5)) ^ state).wrapping_mul(12_605_985_483_714_917_081);
    (word >> 43) ^ word
}

/// The upper 24 bits as a number in [0,1); every value is exact in binary32.
pub fn unit_float(bits: u64) -> f32 {
    (bits >> 40) as f32 * (1.0 / 16_777_216.0)
}

/// Element `index` of a permutation of `0..length` that `key` chooses: a hash that is reversible
/// on the next power of two, walked until it falls inside (cycle walking).
pub fn permute(index: u32, length: u32, key: u64) -> u32 {
    if length <= 1 {
        return 0;
    }
    let mask = length.next_power_of_two().wrapping_sub(1);
    let shift = (mask.count_ones() / 2).max(1);
    let mut value = index.min(length - 1);
    loop {
        for round in 0..4 {
            let word = hash(key, round);
            // An odd factor, an addition and a shifted exclusive-or are each reversible.
            value = value.wrapping_mul(word as u32 | 1).wrapping_add((word >> 32) as u32) & mask;
            value ^= value >> shift;
        }
        if value < length {
            return value;
        }
    }
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
        const COUNT: u64 = 1 << 16;
        let mut bins = [0_u32; 16];
        for index in 0..COUNT {
            bins[(unit_float(hash(7, index)) * 16.0) as usize] += 1;
        }
        let expected = COUNT as f64 / 16.0;
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
