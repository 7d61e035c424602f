//! Objects: shapes with transforms and materials.

use rtsl_math::Affine;

use super::shader_instance::ShaderInstance;

/// An object.
pub struct Object {
    /// Its shape.
    pub primitive: ShaderInstance,
    /// The transform from its own space to its group's. A moving object is placed by a moving instance of a group to
    /// itself.
    pub forward: Affine,
    /// The transform from its group's space to its own.
    pub inverse: Affine,
    /// The map of magnitudes for error bounds, from its group's space through its own and back.
    pub sizes: Affine,
    /// The factor by which volumes are scaled from its own space to its group's; positive.
    pub volume_scale: f32,
    /// The index of its material; `None` if the shape is its own material.
    pub material: Option<u32>,
    /// The index of the material whose emission it gives off besides.
    pub emitter: Option<u32>,
    /// True if its normals are flipped.
    pub reverse_orientation: bool,
}
