//! The transfer function of sRGB, encoded by thresholds: for each of the 256 codes the least linear value that rounds
//! to it. The thresholds are computed from the decoding function by correctly rounded operations only, so the codes
//! have the same bits everywhere.

use rtsl_math::power_12_5;

/// Encodes linear values as 8-bit sRGB.
#[derive(Clone, Debug)]
pub struct SrgbEncoder {
    /// Element `i` is the least value of code `i + 1`.
    thresholds: [f32; 255],
}

impl SrgbEncoder {
    /// Computes the thresholds.
    pub fn new() -> Self {
        let threshold = |code: usize| decode((code as f64 + 0.5) / 255.0) as f32;
        SrgbEncoder { thresholds: std::array::from_fn(threshold) }
    }

    /// Returns the code of a linear value; values are clamped to 0 and 1, and NaN becomes 0.
    pub fn encode(&self, linear: f32) -> u8 {
        self.thresholds.partition_point(|threshold| *threshold <= linear) as u8
    }
}

impl Default for SrgbEncoder {
    fn default() -> Self {
        Self::new()
    }
}

/// Decodes a value from 0 to 1.
pub fn decode(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { power_12_5((encoded + 0.055) / 1.055) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_codes() {
        let encoder = SrgbEncoder::new();
        let codes = [0.0, 0.0031308, 0.18, 0.5, 1.0, 7.0, -1.0, f32::NAN, f32::INFINITY];
        let expected = [0, 10, 118, 188, 255, 255, 0, 0, 255];
        assert_eq!(codes.map(|linear| encoder.encode(linear)), expected);
    }

    #[test]
    fn every_code_survives_decoding() {
        let encoder = SrgbEncoder::new();
        for code in 0..=255_u8 {
            assert_eq!(encoder.encode(decode(f64::from(code) / 255.0) as f32), code);
        }
    }
}
