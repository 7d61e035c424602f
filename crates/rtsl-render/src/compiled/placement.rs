//! The transform of a hit's group to the world: constant for all rays, or depending on the ray's time if the instance
//! moves.

use rtsl_bvh::Instance;
use rtsl_math::{Affine, Transform};

/// An instance with its transforms in both directions.
pub struct Placement<'a> {
    instance: &'a Instance,
    /// The transform from the group's space to the world's, if the instance does not move.
    forward: Affine,
}

impl<'a> Placement<'a> {
    /// The placement of an instance, which has the transform `forward` to the world unless it moves.
    pub fn new(instance: &'a Instance, forward: Affine) -> Self {
        Placement { instance, forward }
    }

    /// True if the transform depends on the time.
    pub fn moves(&self) -> bool {
        self.instance.motion.is_some()
    }

    /// Returns the transform from the group's space to the world's at a time.
    pub fn map_at(&self, time: f32) -> Affine {
        match &self.instance.motion {
            None => self.forward,
            Some(motion) => motion.map_at(time),
        }
    }

    /// Returns the transform from the world's space to the group's at a time.
    pub fn inverse_at(&self, time: f32) -> Affine {
        match &self.instance.motion {
            None => self.instance.inverse,
            Some(motion) => motion.inverse_at(time),
        }
    }

    /// Returns the factor by which volumes are scaled from the group's space to the world's; positive.
    pub fn volume_scale(&self, time: f32) -> f64 {
        match &self.instance.motion {
            None => self.forward.volume_scale(),
            Some(motion) => motion.map_at(time).volume_scale(),
        }
    }
}

/// Returns the inverse of a placement.
pub fn inverse(transform: Transform) -> Affine {
    // The reader rejects transforms without an inverse.
    transform.inverse().map_or(Affine::IDENTITY, Transform::affine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instances_are_small() {
        // Those of the geometry, and the transforms of a compiled scene.
        let size = size_of::<Instance>() + size_of::<Affine>();
        assert!(size <= 128, "{size}");
    }
}
