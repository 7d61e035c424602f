//! Lights without a shape.

use rtsl_math::Affine;

use super::shader_instance::ShaderInstance;

/// A light.
pub struct Light {
    /// The light.
    pub instance: ShaderInstance,
    /// The transform from its own space to the world's.
    pub forward: Affine,
    /// The transform from the world's space to its own.
    pub inverse: Affine,
}
