//! Numbers in no order, the same in every run.

use rtsl_ir::{Constant, Scalar};
use rtsl_testing::functions::Entropy;
use rtsl_testing::random::Random;

/// A stream of scalars.
pub struct Noise(Random);

impl Noise {
    pub fn new(seed: u64) -> Noise {
        Noise(Random::new(seed))
    }

    pub fn bits(&mut self) -> u32 {
        self.0.bits()
    }

    pub fn below(&mut self, count: u32) -> u32 {
        self.0.below(count)
    }

    /// In [0,1).
    pub fn unit(&mut self) -> f32 {
        self.0.unit()
    }

    /// The bits of a scalar, at an edge in one of `edges` cases: of sizes that scenes have else.
    pub fn scalar(&mut self, scalar: Scalar, edges: u32) -> u32 {
        if self.below(edges) == 0 {
            let bytes: Vec<u8> = (0..8).map(|_| self.bits() as u8).collect();
            return Entropy::new(&bytes).constant(scalar).bits();
        }
        match scalar {
            Scalar::F32 => (self.unit() * 4.0 - 2.0).to_bits(),
            Scalar::I32 | Scalar::U32 => self.below(6),
            Scalar::Bool => self.below(2),
        }
    }

    /// A scalar within these bounds.
    pub fn between(&mut self, scalar: Scalar, minimum: Option<f32>, maximum: Option<f32>) -> u32 {
        let least = minimum.unwrap_or(-2.0);
        let greatest = maximum.unwrap_or(least.max(0.0) + 4.0);
        let value = least + (greatest - least) * self.unit();
        match scalar {
            Scalar::F32 => Constant::F32(value).bits(),
            Scalar::I32 => Constant::I32(value as i32).bits(),
            Scalar::U32 => Constant::U32(value as u32).bits(),
            Scalar::Bool => self.below(2),
        }
    }
}
