//! Shapes that give off light and can be sampled.

use rtsl_bvh::HitId;

use super::compiled_scene::ShaderInstance;

/// A shape that is sampled.
pub struct AreaLight {
    /// By which hits name it.
    pub id: HitId,
    /// The number of the instance that places it, if it moves.
    pub instance: Option<u32>,
    /// The index of its object.
    pub object: u32,
    /// The object's shape, or the element of it that is sampled.
    pub primitive: ShaderInstance,
    /// The index of the material whose emission it gives off.
    pub emitter: u32,
    /// How much larger a volume of the shape's space is in its group's; positive.
    pub volume_scale: f64,
}

/// Of a mesh with more elements none is sampled: each of them would cost a ray for every point.
pub const MAX_SAMPLED_ELEMENTS: u32 = 64;

impl AreaLight {
    /// What densities of the shape's space are multiplied with for the world's, by the distances in
    /// both: the Jacobian of directions under a linear map, which is its stretch along the direction, cubed, over
    /// its determinant.
    pub fn density_scale(&self, distance: f32, local_distance: f32) -> f64 {
        let stretch = f64::from(distance) / f64::from(local_distance);
        stretch * stretch * stretch / self.volume_scale
    }
}
