//! Streams: many incoherent rays that traverse a tree together.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4};

use super::hit::HitId;

/// The number of rays that are searched together: the data of their box tests fills the first-level cache of most
/// processors.
pub const RAYS_OF_STREAM: usize = 1024;

/// Rays and their hits. A ray is identified by its index: the number of rays added before it.
#[derive(Debug, Default)]
pub struct RayStream {
    rays: Vec<StreamRay>,
    lines: Vec<StreamLine>,
    times: Vec<f32>,
    ids: Vec<HitId>,
}

/// The data of a ray for box tests.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug)]
pub struct StreamRay {
    /// The origin, and the least parameter of a hit (exclusive).
    pub start: [f32; 4],
    /// The negated reciprocal direction as in a [`TraversalRay`](super::TraversalRay), and the parameter at which the
    /// search ends: that of the closest hit, or the ray's limit, or [`StreamRay::DONE`].
    pub slabs: [f32; 4],
}

/// The remaining data of a ray for object tests.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub struct StreamLine {
    /// The direction, of any length, and the greatest parameter of a hit (exclusive).
    pub along: [f32; 4],
}

/// A ray of a stream that meets the own box of an object.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// The index of the ray.
    pub ray: u32,
    /// The index of the object among those of its class.
    pub object: u32,
    /// The index of the object's item.
    pub item: u32,
    /// The parameter at which the ray enters the box, no less than its epsilon.
    pub entry: f32,
}

/// A pair whose ray hits its object.
#[derive(Clone, Copy, Debug)]
pub struct PairHit {
    /// The index of the pair.
    pub pair: u32,
    /// The parameter of the hit.
    pub distance: f32,
}

impl StreamRay {
    /// The end of the search for a ray with any hit: before all boxes.
    pub const DONE: f32 = f32::NEG_INFINITY;

    /// Returns the parameter at which the search ends.
    #[inline(always)]
    pub fn nearest(&self) -> f32 {
        self.slabs[3]
    }
}

impl RayStream {
    /// Takes rays in place of all that it has: the components of origins and directions, the greatest parameters of
    /// hits and the times, each with as many numbers, and the least parameter of each ray.
    pub fn load(
        &mut self,
        ends: [&[f32]; 6],
        epsilon: impl Fn(usize) -> f32,
        limits: &[f32],
        times: &[f32],
    ) {
        let count = times.len();
        let [x, y, z, along_x, along_y, along_z] = ends.map(|column| &column[..count]);
        let limits = &limits[..count];
        self.clear();
        self.rays.extend((0..count).map(|ray| StreamRay {
            start: [x[ray], y[ray], z[ray], epsilon(ray)],
            slabs: [0.0; 4],
        }));
        self.lines.extend((0..count).map(|ray| StreamLine {
            along: [along_x[ray], along_y[ray], along_z[ray], limits[ray]],
        }));
        self.times.extend_from_slice(times);
    }

    /// Removes all rays.
    pub fn clear(&mut self) {
        self.rays.clear();
        self.lines.clear();
        self.times.clear();
    }

    /// Adds a ray that searches for hits between two parameters.
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

    /// Returns the number of rays.
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    /// True if there are no rays.
    pub fn is_empty(&self) -> bool {
        self.rays.is_empty()
    }

    /// Returns the distance and the id of a ray's hit after a search. The distance is meaningless after an any-hit
    /// search.
    #[inline(always)]
    pub fn hit(&self, place: usize) -> Option<(f32, HitId)> {
        let id = self.ids[place];
        (id != HitId::NONE).then(|| (self.rays[place].nearest(), id))
    }

    /// Returns the data for box tests.
    #[inline(always)]
    pub fn rays(&self) -> &[StreamRay] {
        &self.rays
    }

    /// Returns the remaining data for object tests.
    #[inline(always)]
    pub fn lines(&self) -> &[StreamLine] {
        &self.lines
    }

    /// Returns the times within the shutter.
    #[inline(always)]
    pub fn times(&self) -> &[f32] {
        &self.times
    }

    /// Prepares the rays for a search. Rays that are not finite hit nothing.
    #[inline(always)]
    pub(super) fn begin<S: Simd>(&mut self, simd: S) {
        let infinity = f32x4::splat(simd, f32::INFINITY);
        for (ray, StreamLine { along }) in self.rays.iter_mut().zip(&self.lines) {
            let start = f32x4::load_array(simd, ray.start);
            let direction = f32x4::load_array(simd, *along);
            let finite = start.abs().simd_lt(infinity) & direction.abs().simd_lt(infinity);
            let is_finite = finite.to_bitmask() & 0b0111 == 0b0111;
            // Like `finite_reciprocal`, also for NaN.
            let inverse = f32x4::splat(simd, 1.0) / direction.abs();
            let is_held = inverse.simd_lt(f32::MAX);
            let inverse = is_held.select(inverse, f32x4::splat(simd, f32::MAX));
            let [x, y, z, _] = inverse.copysign(-direction).to_array();
            ray.slabs = [x, y, z, if is_finite { along[3] } else { StreamRay::DONE }];
        }
        self.ids.clear();
        self.ids.resize(self.rays.len(), HitId::NONE);
    }

    /// Records a hit of a ray if it is closer than the closest so far; of equally close hits, the one with the lower id
    /// is kept.
    #[inline(always)]
    pub(super) fn keep_nearer(&mut self, place: usize, distance: f32, id: HitId) {
        let (nearest, nearest_id) = (&mut self.rays[place].slabs[3], &mut self.ids[place]);
        if distance < *nearest || (distance == *nearest && id < *nearest_id) {
            (*nearest, *nearest_id) = (distance, id);
        }
    }

    /// Records that a ray hit something, which ends its search.
    #[inline(always)]
    pub(super) fn mark(&mut self, place: usize, id: HitId) {
        self.rays[place].slabs[3] = StreamRay::DONE;
        self.ids[place] = id;
    }
}
