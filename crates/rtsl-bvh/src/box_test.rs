//! The test of a box.
//!
//! A ray meets a box if it is within all three slabs at some parameter. With `a` and `b` the parameters at which it
//! meets the two planes of a slab, computed as a difference times the reciprocal of the direction, the ray's *entry* is
//! the greatest of the lesser, and its *exit* the least of the greater. Both are widened by a fraction of their size,
//! so that a hit that rounding moved before a flat, far box counts as inside. The ray meets the box if entry is not
//! beyond exit, and exit not before the ray's epsilon.
//!
//! Reciprocals are clamped to finite values and corners of boxes are no NaN, so no product is NaN. Subtraction,
//! multiplication by one factor, minimum and maximum are monotonic under IEEE rounding. Two things follow, and the
//! traversal relies on both:
//!
//! - If a box lies in another, its entry is no less and its exit no greater than the other's.
//! - The same formulas on the least and greatest origins and reciprocals of many rays bound the results for each of
//!   them: `Interval` misses no box that one of its rays meets.
//!
//! Only operations with one IEEE result are used (no fused ones), so all machines agree.

/// The fraction by which entry and exit are widened.
pub const SLACK: f32 = 1.0 / 4096.0;

/// Returns the reciprocal of a direction's component. Near 0 it is clamped to the greatest finite number: a ray along a
/// slab's face counts as inside.
#[inline(always)]
pub fn finite_reciprocal(component: f32) -> f32 {
    let magnitude = 1.0 / component.abs();
    let held = if magnitude < f32::MAX { magnitude } else { f32::MAX };
    held.copysign(component)
}
