//! Packets of rays in one space, prepared for box tests: see the module `box_test` for the formulas.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f32x16};

use super::bounds::Bounds;
use super::box_test::{SLACK, finite_reciprocal};
use super::bvh8::Boxes;
use super::packet::{LANES, LaneMask, LaneVector, Lanes, RayPacket, is_wide, load, vectors_of};
use super::ray_space::{RayFrame, TraversalRay};

/// Identifies a set of prepared rays within a search, so that implementations of `Objects` recognise rays that they
/// have loaded. Never 0.
pub type Serial = u32;

/// A packet of rays in one space.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub struct PacketSpace<'a> {
    /// The rays.
    pub rays: &'a RayPacket,
    /// The reciprocals of the directions, clamped to finite values.
    inverse: [Lanes; 3],
    /// The bounds of all rays.
    pub interval: Interval,
    /// The identity of these rays.
    pub serial: Serial,
    /// The common origin of all rays, if they have one.
    pub common_origin: Option<[f32; 3]>,
}

/// The least and greatest origins, reciprocal directions and limits of some rays.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    min_origin: [f32; 3],
    max_origin: [f32; 3],
    min_inverse: [f32; 3],
    max_inverse: [f32; 3],
    epsilon: f32,
    /// The axes along which directions have both signs: the interval does not constrain them.
    mixed: [bool; 3],
    /// True if more than one axis is mixed.
    is_loose: bool,
    /// True if no axis is mixed: all rays meet the planes of an axis in the same order.
    is_ordered: bool,
}

impl<'a> PacketSpace<'a> {
    /// Prepares the rays of `lanes`, which must be finite.
    #[inline(always)]
    pub fn new<S: Simd>(simd: S, rays: &'a RayPacket, lanes: LaneMask, serial: Serial) -> Self {
        let mut space = PacketSpace {
            rays,
            inverse: [[0.0; LANES]; 3],
            interval: Interval::EMPTY,
            serial,
            common_origin: None,
        };
        for axis in 0..3 {
            for lane in 0..LANES {
                space.inverse[axis][lane] = finite_reciprocal(space.rays.direction[axis][lane]);
            }
        }
        space.interval = space.interval_of(simd, lanes);
        let Interval { min_origin, max_origin, .. } = space.interval;
        space.common_origin = (min_origin == max_origin).then_some(min_origin);
        space
    }

    /// Returns the ray of a lane as a single ray.
    #[inline(always)]
    pub fn ray(&self, lane: usize) -> TraversalRay {
        TraversalRay {
            origin: self.rays.origin_of(lane),
            direction: self.rays.direction_of(lane),
            negative_inverse: [0, 1, 2].map(|axis| -self.inverse[axis][lane]),
            epsilon: self.rays.epsilon[lane],
            limit: self.rays.limit[lane],
            time: self.rays.time[lane],
            lane,
            frame: RayFrame::Packet,
        }
    }

    /// Returns the interval of some lanes.
    #[inline(always)]
    pub fn interval_of<S: Simd>(&self, simd: S, lanes: LaneMask) -> Interval {
        let mut interval = Interval::EMPTY;
        for axis in 0..3 {
            let origin = extremes(simd, &self.rays.origin[axis], lanes);
            let inverse = extremes(simd, &self.inverse[axis], lanes);
            (interval.min_origin[axis], interval.max_origin[axis]) = origin;
            (interval.min_inverse[axis], interval.max_inverse[axis]) = inverse;
            interval.mixed[axis] = inverse.0.is_sign_negative() != inverse.1.is_sign_negative();
        }
        let mixed = interval.mixed.iter().filter(|mixed| **mixed).count();
        (interval.is_ordered, interval.is_loose) = (mixed == 0, mixed > 1);
        interval.epsilon = extremes(simd, &self.rays.epsilon, lanes).0;
        interval
    }

    /// Returns the lanes of `mask` that meet the box before their `limit`. If the limit is the distance of a hit, these
    /// are the lanes whose hit lies in the box or beyond it.
    #[inline(always)]
    pub fn test<S: Simd>(
        &self,
        simd: S,
        bounds: &Bounds,
        mask: LaneMask,
        limit: &Lanes,
    ) -> LaneMask {
        self.test_some(simd, bounds, mask, limit, u32::MAX)
    }

    /// The same, but once `enough` lanes are found to meet the box, the lanes not tested yet are assumed to meet it.
    #[inline(always)]
    pub fn test_some<S: Simd>(
        &self,
        simd: S,
        bounds: &Bounds,
        mask: LaneMask,
        limit: &Lanes,
        enough: u32,
    ) -> LaneMask {
        match is_wide::<S>() {
            true => self.test_some_in::<S, f32x16<S>>(simd, bounds, mask, limit, enough),
            false => self.test_some_in::<S, f32x8<S>>(simd, bounds, mask, limit, enough),
        }
    }

    #[inline(always)]
    fn test_some_in<S: Simd, V: LaneVector<S>>(
        &self,
        simd: S,
        bounds: &Bounds,
        mask: LaneMask,
        limit: &Lanes,
        enough: u32,
    ) -> LaneMask {
        let mut rest = mask;
        let mut passed = 0;
        for (start, some) in vectors_of::<S, V>(mask) {
            rest ^= some << start;
            let meets = self.test_vector::<S, V>(simd, bounds, start, limit);
            passed |= (meets & some) << start;
            if passed.count_ones() >= enough {
                return passed | rest;
            }
        }
        passed
    }

    /// Tests the lanes from `start` on. Returns those that meet the box, as the lowest bits.
    #[inline(always)]
    fn test_vector<S: Simd, V: LaneVector<S>>(
        &self,
        simd: S,
        bounds: &Bounds,
        start: usize,
        limit: &Lanes,
    ) -> LaneMask {
        let (entry, exit) = self.slabs::<S, V>(simd, bounds, start);
        // One comparison serves all three conditions: no hit lies between an epsilon and a lesser limit.
        let end = exit.min(load::<S, V>(simd, limit, start));
        let entry = entry.max(load::<S, V>(simd, &self.rays.epsilon, start));
        entry.simd_le(end).to_bitmask()
    }

    #[inline(always)]
    fn slabs<S: Simd, V: LaneVector<S>>(&self, simd: S, bounds: &Bounds, start: usize) -> (V, V) {
        let [x, y, z] = self.interval.ordered_planes(bounds);
        let x = self.meets::<S, V>(simd, 0, x, start);
        let y = self.meets::<S, V>(simd, 1, y, start);
        let z = self.meets::<S, V>(simd, 2, z, start);
        let [x, y, z] = match self.interval.is_ordered {
            true => [x, y, z],
            false => [ordered(x), ordered(y), ordered(z)],
        };
        let (near, far) = (x.0.max(y.0).max(z.0), x.1.min(y.1).min(z.1));
        (near * (1.0 - SLACK), far * (1.0 + SLACK))
    }

    /// Returns the distances at which rays meet two planes.
    #[inline(always)]
    fn meets<S: Simd, V: LaneVector<S>>(
        &self,
        simd: S,
        axis: usize,
        [first, second]: [f32; 2],
        start: usize,
    ) -> (V, V) {
        let origin = load::<S, V>(simd, &self.rays.origin[axis], start);
        let inverse = load::<S, V>(simd, &self.inverse[axis], start);
        let first = (V::splat(simd, first) - origin) * inverse;
        (first, (V::splat(simd, second) - origin) * inverse)
    }
}

/// Returns the lesser distances, then the greater.
#[inline(always)]
fn ordered<S: Simd, V: LaneVector<S>>((one, other): (V, V)) -> (V, V) {
    (one.min(other), one.max(other))
}

/// Returns the greatest value of some lanes, at least one.
#[inline(always)]
pub fn greatest<S: Simd>(simd: S, lanes: &Lanes, mask: LaneMask) -> f32 {
    extremes(simd, lanes, mask).1
}

/// Returns the least and the greatest value of some lanes, at least one.
#[inline(always)]
fn extremes<S: Simd>(simd: S, lanes: &Lanes, mask: LaneMask) -> (f32, f32) {
    match is_wide::<S>() {
        true => extremes_in::<S, f32x16<S>>(simd, lanes, mask),
        false => extremes_in::<S, f32x8<S>>(simd, lanes, mask),
    }
}

#[inline(always)]
fn extremes_in<S: Simd, V: LaneVector<S>>(simd: S, lanes: &Lanes, mask: LaneMask) -> (f32, f32) {
    let (infinity, negative) = (V::splat(simd, f32::INFINITY), V::splat(simd, f32::NEG_INFINITY));
    let (mut least, mut greatest) = (infinity, negative);
    for (start, bits) in vectors_of::<S, V>(mask) {
        let values = load::<S, V>(simd, lanes, start);
        let on = V::Mask::from_bitmask(simd, bits);
        least = least.min(on.select(values, infinity));
        greatest = greatest.max(on.select(values, negative));
    }
    (least.reduce_min(), greatest.reduce_max())
}

impl Interval {
    const EMPTY: Interval = Interval {
        min_origin: [0.0; 3],
        max_origin: [0.0; 3],
        min_inverse: [0.0; 3],
        max_inverse: [0.0; 3],
        epsilon: 0.0,
        mixed: [true; 3],
        is_loose: true,
        is_ordered: false,
    };

    /// True if the interval constrains too little for its tests to be useful.
    #[inline(always)]
    pub fn is_loose(&self) -> bool {
        self.is_loose
    }

    /// Returns the planes of a box along each axis, in the order in which rays meet them if the axis is not mixed.
    #[inline(always)]
    fn ordered_planes(&self, bounds: &Bounds) -> [[f32; 2]; 3] {
        [0, 1, 2].map(|axis| match self.min_inverse[axis].is_sign_negative() {
            true => [bounds.max[axis], bounds.min[axis]],
            false => [bounds.min[axis], bounds.max[axis]],
        })
    }

    /// Tests the first `count` boxes. Returns a mask of those that any of the rays may meet before `limit`, and the
    /// least distances of entry.
    #[inline(always)]
    pub fn test<S: Simd>(
        &self,
        simd: S,
        boxes: &Boxes,
        count: usize,
        limit: f32,
    ) -> (u64, f32x8<S>) {
        let mut near = f32x8::splat(simd, f32::NEG_INFINITY);
        let mut far = f32x8::splat(simd, f32::INFINITY);
        for axis in 0..3 {
            if self.mixed[axis] {
                continue;
            }
            let min = f32x8::load_array_ref(simd, boxes.min(axis));
            let max = f32x8::load_array_ref(simd, boxes.max(axis));
            let (least, greatest) = (self.min_inverse[axis], self.max_inverse[axis]);
            let (first, last) = if least.is_sign_negative() {
                (max - self.min_origin[axis], min - self.max_origin[axis])
            } else {
                (min - self.max_origin[axis], max - self.min_origin[axis])
            };
            near = near.max((first * least).min(first * greatest));
            far = far.min((last * least).max(last * greatest));
        }
        let (entry, exit) = (near * (1.0 - SLACK), far * (1.0 + SLACK));
        let meets = entry.simd_le(exit)
            & exit.simd_ge(f32x8::splat(simd, self.epsilon))
            & entry.simd_le(f32x8::splat(simd, limit));
        (meets.to_bitmask() & ((1 << count) - 1), entry)
    }
}

/// Returns the lanes of `mask` whose rays are finite; others hit nothing.
#[inline(always)]
pub fn finite_lanes<S: Simd>(simd: S, rays: &RayPacket, mask: LaneMask) -> LaneMask {
    match is_wide::<S>() {
        true => finite_lanes_in::<S, f32x16<S>>(simd, rays, mask),
        false => finite_lanes_in::<S, f32x8<S>>(simd, rays, mask),
    }
}

#[inline(always)]
fn finite_lanes_in<S: Simd, V: LaneVector<S>>(
    simd: S,
    rays: &RayPacket,
    mask: LaneMask,
) -> LaneMask {
    let mut finite = 0;
    for start in (0..LANES).step_by(V::LEN) {
        // A number that is not finite times zero is NaN, and so is every sum with it.
        let mut sum = V::splat(simd, 0.0);
        for component in rays.origin.iter().chain(&rays.direction) {
            sum += load::<S, V>(simd, component, start) * 0.0;
        }
        finite |= sum.simd_eq(V::splat(simd, 0.0)).to_bitmask() << start;
    }
    finite & mask
}
