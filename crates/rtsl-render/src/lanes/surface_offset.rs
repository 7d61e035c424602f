//! Offsets of the origins of rays that leave surfaces, eight lanes at a time: with the bits of
//! `prelude/renderer/surface.rtsl`, which tells why they are as they are.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};
use rtsl_math::LIGHT_MARGIN;

use super::eight::{Eight, Vectors, dots, scaled};

/// Returns the sizes (magnitudes) of coordinates.
#[inline(always)]
pub fn sizes<S: Simd>(v: &Vectors<S>) -> Vectors<S> {
    [v[0].abs(), v[1].abs(), v[2].abs()]
}

/// Returns the sums.
#[inline(always)]
pub fn sums<S: Simd>(a: &Vectors<S>, b: &Vectors<S>) -> Vectors<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Returns the distances from points, which are computed from terms of these sizes with this relative error, along
/// their unit normals at which rays begin; 0 if sizes overflow.
#[inline(always)]
pub fn surface_offsets<S: Simd>(
    eight: Eight<S>,
    normal: &Vectors<S>,
    (sizes_of_points, error): (&Vectors<S>, f32),
) -> f32x8<S> {
    let offset = dots(&sizes(normal), sizes_of_points) * eight.splat(error);
    offset.simd_lt(f32::INFINITY).select(offset, eight.splat(0.0))
}

/// Returns the lengths of shadow rays towards lights without a shape, given their distances and the offsets of their
/// origins: a little shorter, so that the surface on which a light is mounted does not occlude it.
#[inline(always)]
pub fn distance_to_light<S: Simd>(
    eight: Eight<S>,
    distance: f32x8<S>,
    offset: f32x8<S>,
) -> f32x8<S> {
    distance * eight.splat(1.0 - LIGHT_MARGIN) - offset
}
