//! Streams: many rays, of all directions, that go through a tree together.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4};

use super::hit::HitId;

/// So many rays are searched for together: what boxes are tested with fills the fastest cache of most processors.
pub const RAYS_OF_STREAM: usize = 1024;

/// Rays, and what they hit. A ray is known by its *place*: how many were added before it.
#[derive(Debug, Default)]
pub struct RayStream {
    rays: Vec<StreamRay>,
    lines: Vec<StreamLine>,
    times: Vec<f32>,
    ids: Vec<HitId>,
}

/// What a ray is tested against boxes with.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug)]
pub struct StreamRay {
    /// Where it starts, and the least parameter of a hit (exclusive).
    pub start: [f32; 4],
    /// The negative inverse of its direction as in a [`TraversalRay`](super::TraversalRay), and the parameter behind which it looks for
    /// nothing: that of its nearest hit, or its limit, or [`StreamRay::DONE`].
    pub slabs: [f32; 4],
}

/// What objects read of a ray besides its start.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct StreamLine {
    /// Its direction, of any length, and the greatest parameter of a hit (exclusive).
    pub along: [f32; 4],
}

/// A ray of a stream that meets the own box of an object.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// The place of the ray.
    pub ray: u32,
    /// The number of the object among those of its class.
    pub object: u32,
    /// Which item the object is.
    pub item: u32,
    /// Where the ray enters the box, no less than its epsilon.
    pub entry: f32,
}

/// A pair whose ray hits its object.
#[derive(Clone, Copy, Debug)]
pub struct PairHit {
    /// The index of the pair.
    pub pair: u32,
    /// The parameter.
    pub distance: f32,
}

impl StreamRay {
    /// Nearer than all boxes: the ray looks for nothing.
    pub const DONE: f32 = f32::NEG_INFINITY;

    /// The parameter behind which it looks for nothing.
    #[inline(always)]
    pub fn nearest(&self) -> f32 {
        self.slabs[3]
    }
}

impl RayStream {
    /// Forgets all rays.
    pub fn clear(&mut self) {
        self.rays.clear();
        self.lines.clear();
        self.times.clear();
    }

    /// Adds a ray, which looks for hits between two parameters.
    #[inline(always)]
    pub fn push(
        &mut self,
        [x, y, z]: [f32; 3],
        [along_x, along_y, along_z]: [f32; 3],
        (epsilon, limit): (f32, f32),
        time: f32,
    ) {
        self.rays.push(StreamRay { start: [x, y, z, epsilon], slabs: [0.0; 4] });
        self.lines.push(StreamLine { along: [along_x, along_y, along_z, limit] });
        self.times.push(time);
    }

    /// How many rays there are.
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }

    /// What a ray hit, once that was searched for: where, and what. After a search for any hit the first says nothing.
    #[inline(always)]
    pub fn hit(&self, place: usize) -> Option<(f32, HitId)> {
        let id = self.ids[place];
        (id != HitId::NONE).then(|| (self.rays[place].nearest(), id))
    }

    /// What the rays are tested against boxes with.
    #[inline(always)]
    pub fn rays(&self) -> &[StreamRay] {
        &self.rays
    }

    /// What objects read besides.
    #[inline(always)]
    pub fn lines(&self) -> &[StreamLine] {
        &self.lines
    }

    /// Their times within the shutter.
    #[inline(always)]
    pub fn times(&self) -> &[f32] {
        &self.times
    }

    /// Makes the rays ready for a search. Those that are not finite hit nothing.
    #[inline(always)]
    pub(super) fn begin<S: Simd>(&mut self, simd: S) {
        let infinity = f32x4::splat(simd, f32::INFINITY);
        for (ray, StreamLine { along }) in self.rays.iter_mut().zip(&self.lines) {
            let start = f32x4::load_array(simd, ray.start);
            let direction = f32x4::load_array(simd, *along);
            let finite = start.abs().simd_lt(infinity) & direction.abs().simd_lt(infinity);
            let is_finite = finite.to_bitmask() & 0b0111 == 0b0111;
            // As `finite_reciprocal`, for numbers that are none too.
            let inverse = f32x4::splat(simd, 1.0) / direction.abs();
            let is_held = inverse.simd_lt(f32::MAX);
            let inverse = is_held.select(inverse, f32x4::splat(simd, f32::MAX));
            let [x, y, z, _] = inverse.copysign(-direction).to_array();
            ray.slabs = [x, y, z, if is_finite { along[3] } else { StreamRay::DONE }];
        }
        self.ids.clear();
        self.ids.resize(self.rays.len(), HitId::NONE);
    }

    /// Takes a hit of a ray if it is nearer than what it hit so far; of equally near ones that of the lower id.
    #[inline(always)]
    pub(super) fn keep_nearer(&mut self, place: usize, distance: f32, id: HitId) {
        let (nearest, nearest_id) = (&mut self.rays[place].slabs[3], &mut self.ids[place]);
        if distance < *nearest || (distance == *nearest && id < *nearest_id) {
            (*nearest, *nearest_id) = (distance, id);
        }
    }

    /// Notes that a ray hit something: it looks no further.
    #[inline(always)]
    pub(super) fn mark(&mut self, place: usize, id: HitId) {
        self.rays[place].slabs[3] = StreamRay::DONE;
        self.ids[place] = id;
    }
}
