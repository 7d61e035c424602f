//! Lights without a shape.

use rtsl_math::Affine;

/// The place of a light.
pub struct Light {
    /// The transform from its own space to the world's.
    pub forward: Affine,
    /// The transform from the world's space to its own.
    pub inverse: Affine,
}
