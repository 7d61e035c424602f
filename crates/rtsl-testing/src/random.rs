//! Random numbers that are the same in every run: SplitMix64 (Steele, Lea and Flood, "Fast Splittable
//! Pseudorandom Number Generators", 2014).

/// The increment of SplitMix64: 2^64 divided by the golden ratio.
pub const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// The output function of SplitMix64 after one step from `state`: also a hash of `state`.
pub fn mix(state: u64) -> u64 {
    let state = state.wrapping_add(GAMMA);
    let state = (state ^ state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let state = (state ^ state >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    state ^ state >> 31
}

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// Returns the stream of this seed.
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    /// Returns 32 random bits.
    pub fn bits(&mut self) -> u32 {
        let word = mix(self.0);
        self.0 = self.0.wrapping_add(GAMMA);
        word as u32
    }

    /// Returns an integer in `0..end`.
    pub fn below(&mut self, end: u32) -> u32 {
        self.bits() % end
    }

    /// Returns a number in [0,1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / (1 << 24) as f32
    }

    /// Returns a number in [-1,1).
    pub fn signed(&mut self) -> f32 {
        (self.bits() >> 8) as f32 / (1 << 23) as f32 - 1.0
    }
}
