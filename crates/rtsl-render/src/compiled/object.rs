//! Objects: shapes with transforms.

use rtsl::Role;
use rtsl_math::Affine;
use rtsl_scene::SceneObject;

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
    /// True if its normals are flipped.
    pub reverse_orientation: bool,
}

/// True if a shape's class is also a material, whose methods shade it.
pub fn is_own_material(object: &SceneObject) -> bool {
    object.primitive.class().roles.contains(&Role::Material)
}
