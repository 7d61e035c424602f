//! Validity and comparison of values.

use glam::Vec3;

/// The tolerance of the length of a unit direction.
const LENGTH_ERROR: f32 = 1e-4;
/// The relative tolerance between two computations of the same value.
const VALUE_ERROR: f32 = 2e-3;

/// True if a colour is finite and not negative.
pub fn is_color(value: Vec3) -> bool {
    value.is_finite() && value.min_element() >= 0.0
}

/// True if a direction has unit length.
pub fn is_unit(direction: Vec3) -> bool {
    (direction.length() - 1.0).abs() <= LENGTH_ERROR
}

/// True if two values are equal except for rounding.
pub fn is_close(a: Vec3, b: Vec3) -> bool {
    (a - b).abs().max_element() <= VALUE_ERROR * a.abs().max(b.abs()).max_element() + 1e-6
}
