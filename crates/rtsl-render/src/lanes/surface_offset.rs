//! Where rays begin that leave surfaces.
//!
//! A hit point lies off its surface by rounding, and a ray from it may meet the surface again, from behind even. How far
//! along the ray that happens grows without bound as the ray gets flatter, so no least distance of hits is right for all directions. A
//! ray therefore begins off the surface, along the geometric normal, on the side that it leads to, by more than rounding can
//! have moved the point and will move the next hit (Pharr, Jakob and Humphreys, "Physically Based Rendering",
//! 4th edition, section 6.8).
//!
//! Renderers know nothing of how a shape finds its hits but the ray, the parameter, the normal and the box. What is computed from
//! coordinates of some *size* is wrong by a few roundings of that size, so the bound follows from sizes, axis by axis: those
//! of the ray's origin and of its way to the hit, of the shape's box, and of what maps between spaces make of these. Along
//! an axis where all of them are small, as is the height over a level floor, the bound is small however far the other axes reach.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::eight::{Eight, Vectors, dots, scaled};

/// How many roundings of its coordinates' sizes a point on a surface may be wrong by: what a ray's transformation, the test of a
/// triangle, or of a sphere that is written with care, add up to, for the ray that found the point and the one that leaves it.
const ROUNDINGS: f32 = 16.0;

/// The relative error of one rounding.
const ROUNDING: f32 = f32::EPSILON / 2.0;

/// The sizes of coordinates: their magnitudes.
#[inline(always)]
pub fn sizes<S: Simd>(v: &Vectors<S>) -> Vectors<S> {
    v.map(|component| component.abs())
}

/// The sums.
#[inline(always)]
pub fn sums<S: Simd>(a: &Vectors<S>, b: &Vectors<S>) -> Vectors<S> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The sizes of what points on rays are computed from.
#[inline(always)]
pub fn sizes_on_rays<S: Simd>(
    origin: &Vectors<S>,
    direction: &Vectors<S>,
    parameter: f32x8<S>,
) -> Vectors<S> {
    sums(&sizes(origin), &sizes(&scaled(direction, parameter)))
}

/// How far from points, which are computed from numbers of these sizes, rays begin along their normals of unit length. Where
/// sizes are beyond all numbers, not at all.
#[inline(always)]
pub fn surface_offsets<S: Simd>(
    eight: Eight<S>,
    normal: &Vectors<S>,
    sizes_of_points: &Vectors<S>,
) -> f32x8<S> {
    let offset = dots(&sizes(normal), sizes_of_points) * eight.splat(ROUNDINGS * ROUNDING);
    offset.simd_lt(f32::INFINITY).select(offset, eight.splat(0.0))
}

/// Where rays begin that leave points in these directions, off the surface by this much.
#[inline(always)]
pub fn off_surfaces<S: Simd>(
    point: &Vectors<S>,
    normal: &Vectors<S>,
    direction: &Vectors<S>,
    offset: f32x8<S>,
) -> Vectors<S> {
    sums(point, &scaled(normal, offset.copysign(dots(direction, normal))))
}

/// Where rays end that look for what lies before lights without a shape, given their distances and how far off surfaces the rays
/// begin: a little before, so that what a light hangs from does not shade it.
#[inline(always)]
pub fn distance_to_light<S: Simd>(
    eight: Eight<S>,
    distance: f32x8<S>,
    offset: f32x8<S>,
) -> f32x8<S> {
    const PART: f32 = 1e-4;
    distance * eight.splat(1.0 - PART) - offset
}
