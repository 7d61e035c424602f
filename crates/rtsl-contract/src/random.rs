//! Counter-based random numbers: each is a function of its purpose.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

/// The first dimension that shaders get from `rand()`; those before are for the checks.
pub const SHADER_DIMENSION: u32 = 16;

/// A sequence that is independent for each test.
#[derive(Clone, Copy, Debug)]
pub struct Stream(u64);

impl Stream {
    /// Returns the sequences of a seed.
    pub fn new(seed: u64) -> Stream {
        Stream(mix(seed))
    }

    /// Returns the sequence with this number within this one.
    pub fn at(self, number: u64) -> Stream {
        Stream(mix(self.0 ^ mix(number)))
    }

    /// Returns a number in [0,1) for an item and a dimension: a multiple of 2^-24.
    pub fn number(self, item: u64, dimension: u32) -> f32 {
        let word = mix(self.0 ^ mix(item << 16 | u64::from(dimension)));
        (word >> 40) as f32 / (1 << 24) as f32
    }

    /// Returns three numbers in [0,1).
    pub fn vector(self, item: u64) -> Vec3 {
        Vec3::from_array([0, 1, 2].map(|dimension| self.number(item, dimension)))
    }

    /// Returns a uniform direction on the sphere, from dimensions 3 and 4.
    pub fn direction(self, item: u64) -> DVec3 {
        let z = 2.0 * f64::from(self.number(item, 3)) - 1.0;
        on_sphere(z, f64::from(self.number(item, 4)))
    }
}

/// Returns the point of the unit sphere at a height, turned around the z axis by a fraction of a turn.
pub fn on_sphere(z: f64, turn: f64) -> DVec3 {
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sine, cosine) = libm::sincos(turn * TAU);
    DVec3::new(radius * cosine, radius * sine, z)
}

/// Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014.
fn mix(word: u64) -> u64 {
    let word = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ word >> 31
}
