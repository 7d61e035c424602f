//! Single rays in one space, prepared for the tests of boxes: see the module `space` for what these compute.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::bounds::Bounds;
use super::packet::RayPacket;
use super::space::{SLACK, Serial, finite_reciprocal};
use super::wide_tree::{Boxes, WIDTH};

/// One ray in one space.
#[derive(Clone, Copy, Debug)]
pub struct RaySpace {
    /// Where it starts.
    pub origin: [f32; 3],
    /// Its direction, of any length.
    pub direction: [f32; 3],
    /// One over the direction, held finite.
    inverse: [f32; 3],
    /// The least parameter of a hit (exclusive).
    pub epsilon: f32,
    /// The greatest parameter of a hit (exclusive).
    pub limit: f32,
    /// The time within the shutter.
    pub time: f32,
    /// Names this ray.
    pub serial: Serial,
}

impl RaySpace {
    /// The ray of a lane, which must be finite.
    #[inline(always)]
    pub fn new(rays: &RayPacket, lane: usize, serial: Serial) -> Self {
        let direction = rays.direction_of(lane);
        RaySpace {
            origin: rays.origin_of(lane),
            direction,
            inverse: direction.map(finite_reciprocal),
            epsilon: rays.epsilon[lane],
            limit: rays.limit[lane],
            time: rays.time[lane],
            serial,
        }
    }

    /// The same ray in another space; `None` where it is not finite there.
    pub fn moved(&self, origin: [f32; 3], direction: [f32; 3], serial: Serial) -> Option<Self> {
        let is_finite = origin.iter().chain(&direction).all(|component| component.is_finite());
        let inverse = direction.map(finite_reciprocal);
        is_finite.then_some(RaySpace { origin, direction, inverse, serial, ..*self })
    }

    /// Whether it meets the box, and not behind `distance`: `PacketSpace::test` for one ray.
    #[inline(always)]
    pub fn holds(&self, bounds: &Bounds, distance: f32) -> bool {
        let (mut near, mut far) = (f32::NEG_INFINITY, f32::INFINITY);
        for axis in 0..3 {
            let first = (bounds.min[axis] - self.origin[axis]) * self.inverse[axis];
            let second = (bounds.max[axis] - self.origin[axis]) * self.inverse[axis];
            near = near.max(first.min(second));
            far = far.min(first.max(second));
        }
        let (entry, exit) = (near * (1.0 - SLACK), far * (1.0 + SLACK));
        entry <= exit && exit >= self.epsilon && entry <= distance
    }
}

/// A ray, ready to be tested against eight boxes at once, again and again.
#[derive(Clone, Copy)]
pub struct RayBoxTest<S: Simd> {
    simd: S,
    origin: [f32x8<S>; 3],
    /// One over the direction, negative: `(origin - plane) * -inverse` needs an instruction less than
    /// `(plane - origin) * inverse`, and has the same value.
    negative_inverse: [f32x8<S>; 3],
    epsilon: f32x8<S>,
    /// Which planes the ray meets first, and which then, along each axis.
    near: [usize; 3],
    far: [usize; 3],
}

impl<S: Simd> RayBoxTest<S> {
    /// Prepares a ray.
    #[inline(always)]
    pub fn new(simd: S, ray: &RaySpace) -> Self {
        let splat = |number: f32| f32x8::splat(simd, number);
        let ([x, y, z], [a, b, c]) = (ray.origin, ray.inverse);
        let is_back = |axis: usize| ray.inverse[axis].is_sign_negative();
        let (back_x, back_y, back_z) = (is_back(0), is_back(1), is_back(2));
        RayBoxTest {
            simd,
            origin: [splat(x), splat(y), splat(z)],
            negative_inverse: [splat(-a), splat(-b), splat(-c)],
            epsilon: splat(ray.epsilon),
            near: [
                if back_x { 3 } else { 0 },
                if back_y { 4 } else { 1 },
                if back_z { 5 } else { 2 },
            ],
            far: [
                if back_x { 0 } else { 3 },
                if back_y { 1 } else { 4 },
                if back_z { 2 } else { 5 },
            ],
        }
    }

    /// The boxes, as bits, that the ray meets before `limit`, and its entries.
    #[inline(always)]
    pub fn test(&self, boxes: &Boxes, limit: f32) -> (u64, [f32; WIDTH]) {
        let meets = |plane: usize, axis: usize| {
            let planes = f32x8::load_array_ref(self.simd, &boxes.planes[plane]);
            (self.origin[axis] - planes) * self.negative_inverse[axis]
        };
        let [near_x, near_y, near_z] = self.near;
        let near = meets(near_x, 0).max(meets(near_y, 1)).max(meets(near_z, 2));
        let [far_x, far_y, far_z] = self.far;
        let far = meets(far_x, 0).min(meets(far_y, 1)).min(meets(far_z, 2));
        let (entry, exit) = (near * (1.0 - SLACK), far * (1.0 + SLACK));
        // One comparison for all three: no hit lies between an epsilon and a lesser limit.
        let end = exit.min(f32x8::splat(self.simd, limit));
        let meets = entry.max(self.epsilon).simd_le(end);
        (meets.to_bitmask(), entry.to_array())
    }
}
