//! Packets of rays as Embree has them: rows of one word a ray.

/// The most rays in a packet.
pub const MAX_RAYS: usize = 16;
/// No geometry, no primitive, no instance.
pub const NONE: u32 = u32::MAX;

/// Three rows: the origins of rays.
pub const ORIGIN: usize = 0;
/// The least distance of a hit.
pub const NEAR: usize = 3;
/// Three rows: the directions of rays.
pub const DIRECTION: usize = 4;
/// The time of rays.
pub const TIME: usize = 7;
/// The greatest distance of a hit, and then that of the hit.
pub const FAR: usize = 8;
const MASK: usize = 9;
/// The normal of the hit, three rows.
pub const NORMAL: usize = 12;
/// The number of the primitive that was hit.
pub const PRIMITIVE: usize = 17;
/// The number of the geometry.
pub const GEOMETRY: usize = 18;
/// The number of the instance.
pub const INSTANCE: usize = 19;
/// With a row for the elements of arrays of instances, which Embree 4 may have, and what single rays are padded to.
const ROWS: usize = 24;

/// A packet of 1, 4, 8 or 16 rays.
#[repr(C, align(64))]
pub struct Rays {
    words: [f32; ROWS * MAX_RAYS],
    /// 0 or -1 for each ray.
    valid: [i32; MAX_RAYS],
    count: usize,
}

impl Rays {
    /// Rays of which none is valid.
    pub fn new(count: usize) -> Rays {
        assert!([1, 4, 8, 16].contains(&count), "1, 4, 8 or 16 rays");
        Rays { words: [0.0; ROWS * MAX_RAYS], valid: [0; MAX_RAYS], count }
    }

    /// The number of rays.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Makes one valid, without an end and a hit.
    pub fn set(&mut self, ray: usize, origin: [f32; 3], direction: [f32; 3], near: f32) {
        self.valid[ray] = -1;
        for axis in 0..3 {
            *self.word(ORIGIN + axis, ray) = origin[axis];
            *self.word(DIRECTION + axis, ray) = direction[axis];
        }
        *self.word(NEAR, ray) = near;
        *self.word(FAR, ray) = f32::INFINITY;
        for row in [MASK, PRIMITIVE, GEOMETRY, INSTANCE] {
            *self.word(row, ray) = f32::from_bits(u32::MAX);
        }
    }

    /// True if the ray takes part.
    pub fn is_valid(&self, ray: usize) -> bool {
        self.valid[ray] != 0
    }

    /// A number of a ray.
    pub fn get(&self, row: usize, ray: usize) -> f32 {
        self.words[row * self.count + ray]
    }

    /// Three of them.
    pub fn vector(&self, row: usize, ray: usize) -> [f32; 3] {
        std::array::from_fn(|axis| self.get(row + axis, ray))
    }

    /// True if the ray has a hit.
    pub fn is_hit(&self, ray: usize) -> bool {
        self.get(GEOMETRY, ray).to_bits() != NONE
    }

    /// The arrays for Embree: which are valid, and the rows.
    pub fn pointers(&mut self) -> (*const i32, *mut f32) {
        (self.valid.as_ptr(), self.words.as_mut_ptr())
    }

    fn word(&mut self, row: usize, ray: usize) -> &mut f32 {
        &mut self.words[row * self.count + ray]
    }
}
