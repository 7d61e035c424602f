//! Single rays in one space, prepared for box tests: see the module `box_test` for the formulas.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x8, u32x8};
use rtsl_math::{Affine, SIMD_LANES};

use super::bounds::Bounds;
use super::box_test::{SLACK, finite_reciprocal};
use super::bvh8::{Boxes, Child, Node8};
use super::stream::StreamRay;

/// One ray in one space.
#[repr(align(64))]
#[derive(Clone, Copy, Debug)]
pub struct TraversalRay {
    /// The origin.
    pub origin: [f32; 3],
    /// The direction, of any length.
    pub direction: [f32; 3],
    /// The negated reciprocal of the direction, clamped to finite values: `(origin - plane) * -inverse` needs one
    /// instruction less than `(plane - origin) * inverse` and has the same value.
    pub(super) negative_inverse: [f32; 3],
    /// The least parameter of a hit (exclusive).
    pub epsilon: f32,
    /// The greatest parameter of a hit (exclusive).
    pub limit: f32,
    /// The time within the shutter.
    pub time: f32,
    /// The ray's lane in its packet.
    pub lane: usize,
    /// The frame in which the ray is loaded.
    pub frame: RayFrame,
}

/// Selects the state from which `intersect` reads a ray: the packet's block or the single-ray block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayFrame {
    /// The ray is in the space of its packet.
    Packet,
    /// The ray entered an instance without the other rays of its packet.
    Alone,
}

impl TraversalRay {
    /// Returns the ray alone in the space that `map` leads to, or `None` if it is not finite there.
    pub fn moved(&self, map: &Affine) -> Option<Self> {
        let (origin, direction) = (map.point(self.origin), map.vector(self.direction));
        let is_finite = origin.iter().chain(&direction).all(|component| component.is_finite());
        let negative_inverse = direction.map(|component| -finite_reciprocal(component));
        is_finite.then_some(TraversalRay {
            origin,
            direction,
            negative_inverse,
            frame: RayFrame::Alone,
            ..*self
        })
    }

    /// True if the ray meets the box, and not beyond `distance`: `PacketSpace::test` for one ray.
    #[inline(always)]
    pub fn holds(&self, bounds: &Bounds, distance: f32) -> bool {
        let (mut near, mut far) = (f32::NEG_INFINITY, f32::INFINITY);
        for axis in 0..3 {
            let first = (self.origin[axis] - bounds.min[axis]) * self.negative_inverse[axis];
            let second = (self.origin[axis] - bounds.max[axis]) * self.negative_inverse[axis];
            near = near.max(first.min(second));
            far = far.min(first.max(second));
        }
        let (entry, exit) = (near * (1.0 - SLACK), far * (1.0 + SLACK));
        entry <= exit && exit >= self.epsilon && entry <= distance
    }

    /// Tests the boxes of a node. Returns the children that the ray meets before `limit`, and the distances at which it
    /// enters them.
    #[inline(always)]
    pub(super) fn test_node<S: Simd>(
        &self,
        simd: S,
        node: &Node8,
        limit: f32,
    ) -> (mask32x8<S>, f32x8<S>) {
        let TraversalRay { origin, negative_inverse, epsilon, .. } = *self;
        let (met, entry) = test(simd, origin, negative_inverse, &node.boxes, epsilon, limit);
        // Children are compared, and not counted, so that the mask stays in its register.
        let children = u32x8::load_array(simd, node.children.map(Child::bits));
        let is_none = children.simd_eq(u32x8::splat(simd, Child::END.bits()));
        (met & !is_none, entry)
    }

    /// Tests the first `count` boxes. Returns a mask of those that the ray meets before `limit`, and the distances at
    /// which it enters them, none less than its epsilon.
    #[inline(always)]
    pub fn test<S: Simd>(&self, simd: S, boxes: &Boxes, count: u32, limit: f32) -> (u64, f32x8<S>) {
        let TraversalRay { origin, negative_inverse, epsilon, .. } = *self;
        let (met, entry) = test(simd, origin, negative_inverse, boxes, epsilon, limit);
        (met.to_bitmask() & !(u64::MAX << count), entry)
    }
}

impl StreamRay {
    /// Tests eight boxes. Returns a mask of those that the ray meets before its closest hit, and the distances at which
    /// it enters them, none less than its epsilon. The results for empty boxes are arbitrary.
    #[inline(always)]
    pub fn test<S: Simd>(&self, simd: S, boxes: &Boxes) -> (mask32x8<S>, f32x8<S>) {
        let ([x, y, z, epsilon], [slab_x, slab_y, slab_z, nearest]) = (self.start, self.slabs);
        test(simd, [x, y, z], [slab_x, slab_y, slab_z], boxes, epsilon, nearest)
    }
}

/// The box test for a ray given by its origin and its negated reciprocal direction, between two distances.
#[inline(always)]
fn test<S: Simd>(
    simd: S,
    origin: [f32; 3],
    negative_inverse: [f32; 3],
    boxes: &Boxes,
    epsilon: f32,
    limit: f32,
) -> (mask32x8<S>, f32x8<S>) {
    let splat = |number: f32| f32x8::splat(simd, number);
    let slab = |axis: usize| {
        let meets = |planes: &[f32; SIMD_LANES]| {
            let planes = f32x8::load_array_ref(simd, planes);
            (splat(origin[axis]) - planes) * splat(negative_inverse[axis])
        };
        let (first, second) = (meets(boxes.min(axis)), meets(boxes.max(axis)));
        (first.min(second), first.max(second))
    };
    let [(near_x, far_x), (near_y, far_y), (near_z, far_z)] = [slab(0), slab(1), slab(2)];
    let (near, far) = (near_x.max(near_y).max(near_z), far_x.min(far_y).min(far_z));
    let (entry, exit) = (near * (1.0 - SLACK), far * (1.0 + SLACK));
    // One comparison serves all three conditions: no hit lies between an epsilon and a lesser limit.
    let end = exit.min(splat(limit));
    let entry = entry.max(splat(epsilon));
    (entry.simd_le(end), entry)
}
