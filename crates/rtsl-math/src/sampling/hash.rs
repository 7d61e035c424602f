//! Hashes of 32 bits, as in the text of samplers.

/// A hash of two words that depends on every bit of both.
#[inline(always)]
pub fn hash(a: u32, b: u32) -> u32 {
    mix(mix(a).wrapping_add(b).wrapping_add(0x9E37_79B9))
}

/// A bijection with little bias: two rounds of a shifted exclusive-or and an odd factor, as found by search (Wellons,
/// "Prospecting for Hash Functions", 2018).
#[inline(always)]
fn mix(word: u32) -> u32 {
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

#[cfg(test)]
mod tests {
    use super::*;

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
