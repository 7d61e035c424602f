//! Area lights: emissive shapes that are sampled.

use rtsl_bvh::HitId;

use super::shader_instance::ShaderInstance;

/// An area light.
pub struct AreaLight {
    /// The id by which searches report hits of it.
    pub id: HitId,
    /// The index of the instance that places it, if it moves.
    pub instance: Option<u32>,
    /// The index of its object.
    pub object: u32,
    /// The object's shape, or the element of it that is sampled.
    pub primitive: ShaderInstance,
    /// The index of the emissive material.
    pub emitter: u32,
    /// The factor by which volumes are scaled from the shape's space to its group's; positive.
    pub volume_scale: f64,
}

/// Meshes with more elements are not sampled: each element would cost a ray for every point.
pub const MAX_SAMPLED_ELEMENTS: u32 = 64;

impl AreaLight {
    /// Returns the factor that converts densities from the shape's space to the world's, given the distances in both:
    /// the Jacobian of directions under a linear map, which is its stretch along the direction, cubed, divided by its
    /// determinant.
    pub fn density_scale(&self, distance: f32, local_distance: f32) -> f64 {
        let stretch = f64::from(distance) / f64::from(local_distance);
        stretch * stretch * stretch / self.volume_scale
    }
}
