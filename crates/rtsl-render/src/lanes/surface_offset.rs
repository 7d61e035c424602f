//! Offsets of the origins of rays that leave surfaces.
//!
//! Because of rounding, a hit point lies off its surface, and a ray from it may hit the surface again, even from
//! behind. The distance of that hit along the ray grows without bound at grazing angles, so no least distance of hits
//! is right for all directions. The origin of a ray is therefore moved off the surface, along the geometric normal, on
//! the side that it leads to, by more than rounding can have moved the point and will move the next hit (Pharr, Jakob
//! and Humphreys, "Physically Based Rendering", 4th edition, section 6.8).
//!
//! Renderers do not know how a shape computes its hits; they know only the ray, the parameter, the normal and the box.
//! A result computed from coordinates of some magnitude (*size*) has an error of a few roundings of that size, so the
//! bound follows from sizes, axis by axis: those of the ray's origin and of its segment up to the hit, of the shape's
//! box, and of their images under the transforms between spaces. Along an axis where all of them are small, as is the
//! height over a level floor, the bound is small however far the other axes reach.
//!
//! Shapes that put their hits back on the surface know the error of that. Renderers then add only their own: that of
//! the point and its transforms, without the shape's box, and without the ray where the point has been moved.

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

/// Returns the sizes of the terms from which points on rays are computed.
#[inline(always)]
pub fn sizes_on_rays<S: Simd>(
    origin: &Vectors<S>,
    direction: &Vectors<S>,
    parameter: f32x8<S>,
) -> Vectors<S> {
    sums(&sizes(origin), &sizes(&scaled(direction, parameter)))
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
