//! Packets of rays in structure-of-arrays form.

use std::marker::PhantomData;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f32x16};
use rtsl_math::Affine;

/// The number of rays in a packet: a tile of 8 by 8 pixels.
pub const LANES: usize = 64;

/// A set of lanes: bit `i` is lane `i`.
pub type LaneMask = u64;

/// One number for each lane.
pub type Lanes = [f32; LANES];

/// Returns an iterator over the lanes of a mask, in ascending order.
pub fn lanes_of(mask: LaneMask) -> LanesOf {
    LanesOf(mask)
}

/// An iterator over the lanes of a mask.
#[derive(Clone, Debug)]
pub struct LanesOf(LaneMask);

impl Iterator for LanesOf {
    type Item = usize;

    // Without `inline(always)` the compiler emits a call for every lane of a packet.
    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let lane = self.0.trailing_zeros() as usize;
        self.0 &= self.0.wrapping_sub(1);
        (lane < LANES).then_some(lane)
    }
}

/// A vector of the numbers of some lanes of a packet: of sixteen where that is one register, of eight otherwise.
pub(super) trait LaneVector<S: Simd>: SimdFloat<S, Element = f32> {}

impl<S: Simd> LaneVector<S> for f32x8<S> {}
impl<S: Simd> LaneVector<S> for f32x16<S> {}

/// The number of lanes of a wide vector.
const WIDE_LANES: usize = 16;

/// True if a vector of [`WIDE_LANES`] is one register.
#[inline(always)]
pub(super) fn is_wide<S: Simd>() -> bool {
    <S::f32s as SimdBase<S>>::LEN >= WIDE_LANES
}

/// Loads the numbers of a vector of lanes.
#[inline(always)]
pub(super) fn load<S: Simd, V: LaneVector<S>>(simd: S, numbers: &Lanes, start: usize) -> V {
    V::from_slice(simd, &numbers[start..start + V::LEN])
}

/// Returns an iterator over the vectors of `N` lanes that contain some lanes of a mask: the first lane of each, and the
/// vector's part of the mask, as the lowest bits.
#[inline(always)]
pub(super) fn vectors_of<S: Simd, V: LaneVector<S>>(mask: LaneMask) -> VectorsOf<S, V> {
    VectorsOf(mask, PhantomData)
}

/// An iterator over the vectors of a mask.
pub(super) struct VectorsOf<S, V>(LaneMask, PhantomData<(S, V)>);

impl<S: Simd, V: LaneVector<S>> Iterator for VectorsOf<S, V> {
    type Item = (usize, LaneMask);

    #[inline(always)]
    fn next(&mut self) -> Option<(usize, LaneMask)> {
        if self.0 == 0 {
            return None;
        }
        let start = self.0.trailing_zeros() as usize / V::LEN * V::LEN;
        let some = self.0 >> start & !(LaneMask::MAX << V::LEN);
        self.0 ^= some << start;
        Some((start, some))
    }
}

/// A packet of rays.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub struct RayPacket {
    /// Origins, component by component.
    pub origin: [Lanes; 3],
    /// Directions, of any length.
    pub direction: [Lanes; 3],
    /// The least parameter of a hit (exclusive).
    pub epsilon: Lanes,
    /// The greatest parameter of a hit (exclusive).
    pub limit: Lanes,
    /// The time within the shutter.
    pub time: Lanes,
}

impl Default for RayPacket {
    fn default() -> Self {
        RayPacket {
            origin: [[0.0; LANES]; 3],
            direction: [[0.0; LANES]; 3],
            epsilon: [0.0; LANES],
            limit: [0.0; LANES],
            time: [0.0; LANES],
        }
    }
}

impl RayPacket {
    /// Returns the origin of a lane's ray.
    #[inline(always)]
    pub fn origin_of(&self, lane: usize) -> [f32; 3] {
        [self.origin[0][lane], self.origin[1][lane], self.origin[2][lane]]
    }

    /// Returns the direction of a lane's ray.
    #[inline(always)]
    pub fn direction_of(&self, lane: usize) -> [f32; 3] {
        [self.direction[0][lane], self.direction[1][lane], self.direction[2][lane]]
    }

    /// Sets origin and direction of a lane's ray.
    pub fn set(&mut self, lane: usize, origin: [f32; 3], direction: [f32; 3]) {
        for axis in 0..3 {
            self.origin[axis][lane] = origin[axis];
            self.direction[axis][lane] = direction[axis];
        }
    }
}

/// Transforms the rays of a packet.
#[inline(always)]
pub fn moved_packet(rays: &RayPacket, map: &Affine) -> RayPacket {
    let [x, y, z, origin] = &map.columns;
    let mut moved = rays.clone();
    for row in 0..3 {
        // The order of operations is that of `Affine::point` and `Affine::vector`.
        let turned = |from: &[[f32; LANES]; 3], lane: usize| {
            x[row] * from[0][lane] + y[row] * from[1][lane] + z[row] * from[2][lane]
        };
        for lane in 0..LANES {
            moved.origin[row][lane] = turned(&rays.origin, lane) + origin[row];
            moved.direction[row][lane] = turned(&rays.direction, lane);
        }
    }
    moved
}

/// Transforms the rays of `lanes`, each by the transform at its time; others stay as they are.
pub fn moved_packet_by(
    rays: &RayPacket,
    lanes: LaneMask,
    map_at: impl Fn(f32) -> Affine,
) -> RayPacket {
    let mut moved = rays.clone();
    for lane in lanes_of(lanes) {
        let map = map_at(rays.time[lane]);
        moved.set(lane, map.point(rays.origin_of(lane)), map.vector(rays.direction_of(lane)));
    }
    moved
}
