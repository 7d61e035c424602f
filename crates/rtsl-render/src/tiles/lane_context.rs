//! The context of each ray of a packet.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};
use rtsl::host::{Host, LaneFloats, LaneSet};
use rtsl_bvh::{LANES, LaneMask, Lanes, RayPacket};
use rtsl_math::sampling::Sampler;

use crate::lanes::eight::{Eight, LaneVectors, Vectors, difference, dots, eights_alone, select};
use crate::lanes::lane_streams::LaneStreams;
use crate::lanes::surface_offset::off_surfaces;

/// The context of each ray of a packet: everything but the ray itself.
#[derive(Clone)]
pub struct LaneContext {
    sampler: Sampler,
    /// The position of each ray in its random sequence.
    pub streams: LaneStreams,
    /// The time within the shutter.
    pub time: Lanes,
    /// An upper bound of the weight of each ray's radiance in its pixel, as far as shaders report it: 1 for camera
    /// rays.
    importance: Lanes,
    /// The points that the rays hit.
    points: LaneVectors,
    /// The offsets from these points at which rays that leave the surfaces begin.
    offsets: Lanes,
    geometric_normals: LaneVectors,
    shading_normals: LaneVectors,
    /// The lanes whose rays hit the surface from its back side.
    behind: LaneMask,
    /// The lanes that received light that is not finite.
    not_finite: LaneMask,
}

impl LaneContext {
    /// Creates the context of rays with these streams and times.
    pub fn new(sampler: Sampler, streams: LaneStreams, time: Lanes) -> Self {
        LaneContext {
            sampler,
            streams,
            time,
            importance: [1.0; LANES],
            points: [[0.0; LANES]; 3],
            offsets: [0.0; LANES],
            geometric_normals: [[0.0; LANES]; 3],
            shading_normals: [[0.0; LANES]; 3],
            behind: 0,
            not_finite: 0,
        }
    }

    /// Reuses the context for other rays, with these streams and times.
    pub fn begin(&mut self, streams: LaneStreams, time: Lanes) {
        (self.streams, self.time, self.not_finite) = (streams, time, 0);
    }

    /// Records that these lanes received light that is not finite, whose cause was reported.
    pub fn take_not_finite(&mut self, lanes: LaneMask) {
        self.not_finite |= lanes;
    }

    /// Returns those of `lanes` that received only finite light: other values that are not finite are caused by their
    /// own shader.
    pub fn lit_by_finite(&self, lanes: LaneMask) -> LaneMask {
        lanes & !self.not_finite
    }

    /// Reuses the context for other surfaces that the same rays hit.
    pub fn begin_beside(&mut self, other: &LaneContext) {
        self.sampler = other.sampler;
        self.begin(other.streams.clone(), other.time);
    }

    /// Sets `spawned` to the context of rays that those of `lanes` spawn, with these weights of their radiance. Its
    /// surface data is undefined until they hit something.
    #[inline(always)]
    pub fn spawn(&mut self, lanes: LaneMask, weights: &Lanes, spawned: &mut LaneContext) {
        for (lane, importance) in spawned.importance.iter_mut().enumerate() {
            *importance = self.importance[lane] * weights[lane];
        }
        self.streams.spawn(lanes, &mut spawned.streams);
        (spawned.sampler, spawned.time) = (self.sampler, self.time);
        (spawned.behind, spawned.not_finite) = (0, 0);
    }

    /// Returns those of `lanes` whose importance is less than `cutoff`. NaN is not.
    #[inline(always)]
    pub fn less_important_than<S: Simd>(&self, simd: S, cutoff: f32, lanes: LaneMask) -> LaneMask {
        let mut less = 0;
        for eight in eights_alone(simd, lanes) {
            less |= eight.lanes(eight.floats(&self.importance).simd_lt(cutoff));
        }
        less
    }

    /// Returns the geometric normal of the surface that a lane hit.
    pub fn geometric_normal(&self, lane: usize) -> [f32; 3] {
        [0, 1, 2].map(|axis: usize| self.geometric_normals[axis][lane])
    }

    /// Returns the shading normal at a lane's hit.
    pub fn shading_normal(&self, lane: usize) -> [f32; 3] {
        [0, 1, 2].map(|axis: usize| self.shading_normals[axis][lane])
    }

    /// Sets the normals of the surfaces that rays with these directions hit; the geometric normal determines the
    /// visible side.
    #[inline(always)]
    pub fn set_normals<S: Simd>(
        &mut self,
        eight: Eight<S>,
        geometric: &Vectors<S>,
        shading: &Vectors<S>,
        direction: &Vectors<S>,
    ) {
        eight.blend_vectors(geometric, &mut self.geometric_normals);
        eight.blend_vectors(shading, &mut self.shading_normals);
        let all = eight.lanes(eight.mask(LaneMask::MAX));
        let behind = eight.lanes(dots(direction, geometric).simd_gt(0.0));
        self.behind = self.behind & !all | behind;
    }

    /// Sets the points that rays hit, and the offsets at which rays that leave the surfaces begin.
    #[inline(always)]
    pub fn set_points<S: Simd>(&mut self, eight: Eight<S>, points: &Vectors<S>, offsets: f32x8<S>) {
        eight.blend_vectors(points, &mut self.points);
        eight.blend(offsets, &mut self.offsets);
    }

    /// Returns the offsets at which rays that leave the hit points begin.
    pub fn offsets(&self) -> &Lanes {
        &self.offsets
    }

    /// Moves the origins of rays that begin on the surfaces hit by the lanes, within rounding, off these to the side
    /// that the rays lead to. Shaders may have moved them along the surface. Other origins stay unchanged.
    pub fn leave_surfaces(&self, rays: &mut RayPacket, lanes: LaneMask) {
        dispatch!(Level::new(), simd => self.leave_in_vectors(simd, rays, lanes));
    }

    /// The same with a given instruction set.
    #[inline(always)]
    pub fn leave_in_vectors<S: Simd>(&self, simd: S, rays: &mut RayPacket, lanes: LaneMask) {
        for eight in eights_alone(simd, lanes) {
            let (origin, direction) = (eight.vectors(&rays.origin), eight.vectors(&rays.direction));
            let normal = eight.vectors(&self.geometric_normals);
            let offset = eight.floats(&self.offsets);
            let height = dots(&difference(&origin, &eight.vectors(&self.points)), &normal);
            let moved = off_surfaces(&origin, &normal, &direction, offset);
            let origin = select(height.abs().simd_le(offset), &moved, &origin);
            eight.blend_vectors(&origin, &mut rays.origin);
        }
    }

    /// Returns the geometric normals.
    #[inline(always)]
    pub fn geometric_normals<S: Simd>(&self, eight: Eight<S>) -> Vectors<S> {
        eight.vectors(&self.geometric_normals)
    }

    /// Returns the geometric and the shading normals on the visible side of the surface, which is the side that lights
    /// illuminate.
    #[inline(always)]
    pub fn seen_normals<S: Simd>(&self, eight: Eight<S>) -> [Vectors<S>; 2] {
        let behind = eight.mask(self.behind);
        let geometric = eight.vectors(&self.geometric_normals);
        let shading = eight.vectors(&self.shading_normals);
        [
            select(behind, &negated(&geometric), &geometric),
            select(behind, &negated(&shading), &shading),
        ]
    }
}

#[inline(always)]
fn negated<S: Simd>(v: &Vectors<S>) -> [f32x8<S>; 3] {
    [-v[0], -v[1], -v[2]]
}

/// A context alone answers `rand`; cameras, shapes and lights cannot make other requests.
impl Host for LaneContext {
    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        self.streams.next(&self.sampler, lanes, values);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rtsl_math::sampling::SamplerKind;

    #[test]
    fn weights_multiply_and_what_is_no_number_counts() {
        let sampler = Sampler { kind: SamplerKind::Independent, columns: 1, rows: 1, seed: 0 };
        let context = || LaneContext::new(sampler, LaneStreams::new([0; LANES], 0), [0.0; LANES]);
        let less = |context: &LaneContext, cutoff: f32, lanes: LaneMask| dispatch!(Level::new(), simd => context.less_important_than(simd, cutoff, lanes));
        let (mut camera, mut spawned, mut again) = (context(), context(), context());
        assert_eq!(less(&camera, 1.0, LaneMask::MAX), 0);
        let mut weights = [0.5; LANES];
        weights[3] = f32::NAN;
        camera.spawn(LaneMask::MAX, &weights, &mut spawned);
        assert_eq!(less(&spawned, 0.5, LaneMask::MAX), 0);
        weights[5] = 1.0;
        spawned.spawn(LaneMask::MAX, &weights, &mut again);
        assert_eq!(less(&again, 0.5, LaneMask::MAX), !(1 << 3 | 1 << 5));
        assert_eq!(less(&again, 0.5, 0b111000), 0b010000);
    }
}
