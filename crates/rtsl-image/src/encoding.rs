//! Encodings of 8-bit and 16-bit numbers.

use rtsl_math::power;

use crate::srgb_decode;

/// The encoding of 8-bit and 16-bit files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    /// The transfer function of sRGB.
    Srgb,
    /// Linear.
    Linear,
    /// A power: the linear number is the encoded number to this power.
    Gamma(f64),
}

impl Encoding {
    /// Returns the linear value of an encoded number from 0 to 1.
    pub fn decode(self, encoded: f64) -> f64 {
        match self {
            Encoding::Srgb => srgb_decode(encoded),
            Encoding::Linear => encoded,
            Encoding::Gamma(gamma) => power(encoded, gamma),
        }
    }

    /// Returns the linear values of the 256 codes of a byte.
    pub fn decoded_bytes(self) -> [f32; 256] {
        std::array::from_fn(|code| self.decode(code as f64 / 255.0) as f32)
    }

    /// Returns the least linear value of each code of a byte but the first.
    fn thresholds(self) -> [f32; 255] {
        std::array::from_fn(|code| self.decode((code as f64 + 0.5) / 255.0) as f32)
    }
}

/// Maps bytes to linear values and back.
#[derive(Clone, Debug)]
pub struct ByteCode {
    decoded: [f32; 256],
    thresholds: [f32; 255],
}

impl ByteCode {
    /// Computes the tables of an encoding.
    pub fn new(encoding: Encoding) -> Self {
        ByteCode { decoded: encoding.decoded_bytes(), thresholds: encoding.thresholds() }
    }

    /// Returns the linear value of a code.
    pub fn decode(&self, code: u8) -> f32 {
        self.decoded[usize::from(code)]
    }

    /// Returns the code that is nearest in the encoded scale.
    pub fn encode(&self, linear: f32) -> u8 {
        self.thresholds.partition_point(|threshold| *threshold <= linear) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives_each_encoding() {
        for encoding in [Encoding::Srgb, Encoding::Linear, Encoding::Gamma(2.2)] {
            let bytes = ByteCode::new(encoding);
            for code in 0..=255 {
                assert_eq!(bytes.encode(bytes.decode(code)), code, "{encoding:?}");
            }
            assert_eq!((bytes.decode(0), bytes.decode(255)), (0.0, 1.0), "{encoding:?}");
            assert_eq!((bytes.encode(-1.0), bytes.encode(7.0)), (0, 255));
        }
    }

    /// Values of the table in pbrt-v4, which is computed in another way.
    #[test]
    fn known_values_of_srgb() {
        let decoded = Encoding::Srgb.decoded_bytes();
        for (code, value) in [(1, 0.000_303_527), (10, 0.003_035_27), (128, 0.215_860_5)] {
            assert!((decoded[code] / value - 1.0).abs() < 1e-5, "{code}: {}", decoded[code]);
        }
        let gamma = Encoding::Gamma(2.0).decoded_bytes();
        assert!((gamma[128] - 128.0 * 128.0 / (255.0 * 255.0)).abs() < 1e-7);
    }
}
