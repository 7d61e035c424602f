//! Arrays with an element for each lane of a shading batch, and sets of its lanes.

use rtsl_bvh::lanes_of;

/// Lanes of a batch: more lanes need fewer calls, fewer lanes stay in caches. The number of vectors of sixteen is odd,
/// because arrays at a distance of a power of two compete for the same cache sets: a thousand spheres took 8 % less
/// time with 240 than with 256.
pub const BATCH_LANES: usize = 272;

/// A number for each lane.
pub type Row = [f32; BATCH_LANES];

/// A vector or colour for each lane, component by component.
pub type Rows = [Row; 3];

/// A set of lanes of a batch: bits, eight by eight.
pub struct BatchLanes([u8; BATCH_LANES / 8]);

impl BatchLanes {
    /// The empty set.
    pub const NONE: BatchLanes = BatchLanes([0; BATCH_LANES / 8]);

    /// Sets the membership of the eight lanes from `start` on.
    #[inline(always)]
    pub fn set_eight(&mut self, start: usize, bits: u8) {
        self.0[start / 8] = bits;
    }

    /// True if the set is empty.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|bits| *bits == 0)
    }

    /// Iterates over those of the first `count` lanes that are in the set.
    #[inline(always)]
    pub fn among(&self, count: usize) -> impl Iterator<Item = usize> {
        let eights = self.0.iter().zip((0..count).step_by(8));
        eights.flat_map(move |(bits, start)| {
            let in_use = 0xFF_u8 >> 8_usize.saturating_sub(count - start);
            lanes_of(u64::from(*bits & in_use)).map(move |lane| start + lane)
        })
    }
}

/// True if all numbers are finite. In vectors, unlike a search for one that is not.
pub fn all_finite(numbers: &[f32]) -> bool {
    const CHUNK: usize = 64;
    let is_odd = |number: &f32| u32::from(!number.is_finite());
    numbers.chunks(CHUNK).all(|chunk| chunk.iter().map(is_odd).sum::<u32>() == 0)
}

/// Sets a lane's vector.
#[inline(always)]
pub fn set(rows: &mut Rows, lane: usize, [x, y, z]: [f32; 3]) {
    (rows[0][lane], rows[1][lane], rows[2][lane]) = (x, y, z);
}

/// Returns a lane's vector.
#[inline(always)]
pub fn get(rows: &Rows, lane: usize) -> [f32; 3] {
    [rows[0][lane], rows[1][lane], rows[2][lane]]
}

/// True if all components of a vector are finite.
#[inline(always)]
pub fn are_finite(vector: &[f32; 3]) -> bool {
    vector.iter().all(|component| component.is_finite())
}
