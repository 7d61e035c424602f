//! Random choices drawn from bytes.

use rtsl_ir::{Constant, Scalar};

use crate::random;

/// Random choices drawn from bytes; once the bytes are exhausted every choice is the first. So a fuzzer that shortens
/// and lowers the bytes makes the outcome simpler.
#[derive(Clone, Debug)]
pub struct Entropy<'a> {
    bytes: &'a [u8],
}

impl<'a> Entropy<'a> {
    /// Returns a source of choices from these bytes.
    pub fn new(bytes: &'a [u8]) -> Self {
        Entropy { bytes }
    }

    /// Returns `len` bytes for this seed.
    pub fn bytes(seed: u64, len: usize) -> Vec<u8> {
        (0..len as u64).map(|index| mix(seed.wrapping_add(index << 32)) as u8).collect()
    }

    /// True if all bytes have been drawn.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Returns the next byte.
    pub fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.bytes.split_first() else { return 0 };
        self.bytes = rest;
        *first
    }

    /// Returns a number less than `count`, which is at most 256.
    pub fn below(&mut self, count: usize) -> usize {
        usize::from(self.byte()) * count / 256
    }

    /// Returns one of these choices.
    pub fn choose<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    /// Returns true with probability `part` / 256.
    pub fn chance(&mut self, part: u8) -> bool {
        !self.byte() < part
    }

    /// Returns four bytes.
    pub fn bits(&mut self) -> u32 {
        u32::from_le_bytes(std::array::from_fn(|_| self.byte()))
    }

    /// Returns a value of this type: mostly small, often a boundary value, sometimes any bits.
    pub fn constant(&mut self, scalar: Scalar) -> Constant {
        match scalar {
            Scalar::F32 => Constant::F32(self.f32()),
            Scalar::I32 | Scalar::U32 => Constant::from_bits(scalar, self.integer()),
            Scalar::Bool => Constant::Bool(self.chance(128)),
        }
    }

    fn f32(&mut self) -> f32 {
        match self.below(8) {
            0..4 => f32::from(self.byte() as i8) / 16.0,
            4..6 => (f32::from(self.byte()) + f32::from(self.byte()) / 256.0 - 128.0) * 0.013,
            6 => self.choose(&EDGES),
            _ => f32::from_bits(self.bits()),
        }
    }

    fn integer(&mut self) -> u32 {
        match self.below(4) {
            0..2 => (i32::from(self.byte() as i8) / 8) as u32,
            2 => self.choose(&[0, 1, u32::MAX, i32::MAX as u32, i32::MIN as u32, 31, 32, 33]),
            _ => self.bits(),
        }
    }
}

/// Numbers at which operations change their behaviour.
const EDGES: [f32; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    f32::MAX,
    f32::MIN_POSITIVE,
    1e-45,
    0.5,
    2.5,
    16_777_217.0,
    2_147_483_648.0,
    -2_147_483_904.0,
    4_294_967_296.0,
];

/// A hash: the number at this position of SplitMix64's sequence.
pub(super) fn mix(position: u64) -> u64 {
    random::mix(position.wrapping_mul(random::GAMMA))
}
