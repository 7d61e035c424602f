//! Samples of lights at a point, in the world.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};
use rtsl_math::STRETCH_ROUNDING;

use super::eight::Eight;

/// Returns the factors that convert colours of samples from the spaces of lights to the world. The colour of a delta
/// light at a finite distance is its intensity over the squared distance, which the light's transform stretches by
/// `stretch2` along the sample's direction; intensities are those of the world, as in pbrt-v4.
#[inline(always)]
pub fn delta_scale<S: Simd>(
    eight: Eight<S>,
    stretch2: f32x8<S>,
    distance: f32x8<S>,
    density: f32x8<S>,
) -> f32x8<S> {
    let one = eight.splat(1.0);
    let is_scaled = (stretch2 - one).abs().simd_gt(STRETCH_ROUNDING);
    let is_delta = density.simd_le(0.0) & distance.simd_lt(f32::INFINITY);
    (is_scaled & is_delta).select(one / stretch2, one)
}
