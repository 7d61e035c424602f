//! What numbers may be.

use glam::Vec3;

/// How far the length of a direction may be from 1.
const LENGTH_ERROR: f32 = 1e-4;
/// How far values of the same thing that are computed twice may be apart, relatively.
const VALUE_ERROR: f32 = 2e-3;

/// Whether a colour is one that light may have.
pub fn is_color(value: Vec3) -> bool {
    value.is_finite() && value.min_element() >= 0.0
}

/// Whether a direction has unit length.
pub fn is_unit(direction: Vec3) -> bool {
    (direction.length() - 1.0).abs() <= LENGTH_ERROR
}

/// Whether two values of the same thing are equal but for rounding.
pub fn is_close(a: Vec3, b: Vec3) -> bool {
    (a - b).abs().max_element() <= VALUE_ERROR * a.abs().max(b.abs()).max_element() + 1e-6
}
