//! The transform of a hit's group to the world: constant for all rays, or depending on the ray's time if the instance
//! moves.

use fearless_simd::Simd;
use rtsl_bvh::{Instance, LaneMask, Lanes, RayPacket};
use rtsl_math::Affine;

use crate::lanes::eight::{Eight, Vectors};

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

    /// Returns the rays of `lanes` in the group's space.
    #[inline(always)]
    pub fn rays_in_group(&self, rays: &RayPacket, lanes: LaneMask) -> RayPacket {
        self.instance.moved_packet(rays, lanes)
    }

    /// Transforms points of the world to the group's space, each at its time.
    #[inline(always)]
    pub fn points_to_group<S: Simd>(
        &self,
        eight: Eight<S>,
        points: &Vectors<S>,
        time: &Lanes,
    ) -> Vectors<S> {
        match &self.instance.motion {
            None => eight.point(&self.instance.inverse, points),
            Some(motion) => {
                eight.each(points, |lane, point| motion.inverse_at(time[lane]).point(point))
            }
        }
    }

    /// Transforms points of the group's space to the world's, each at its time.
    #[inline(always)]
    pub fn points_to_world<S: Simd>(
        &self,
        eight: Eight<S>,
        points: &Vectors<S>,
        time: &Lanes,
    ) -> Vectors<S> {
        match &self.instance.motion {
            None => eight.point(&self.forward, points),
            Some(motion) => {
                eight.each(points, |lane, point| motion.map_at(time[lane]).point(point))
            }
        }
    }

    /// Maps magnitudes of points to those in the group's space, for error bounds.
    #[inline(always)]
    pub fn sizes_to_group<S: Simd>(
        &self,
        eight: Eight<S>,
        sizes: &Vectors<S>,
        time: &Lanes,
    ) -> Vectors<S> {
        match &self.instance.motion {
            None => eight.point(&self.instance.inverse.of_sizes(), sizes),
            Some(motion) => eight
                .each(sizes, |lane, sizes| motion.inverse_at(time[lane]).of_sizes().point(sizes)),
        }
    }

    /// Maps magnitudes of vectors from the group's space to the world's, for error bounds.
    #[inline(always)]
    pub fn sizes_to_world<S: Simd>(
        &self,
        eight: Eight<S>,
        sizes: &Vectors<S>,
        time: &Lanes,
    ) -> Vectors<S> {
        match &self.instance.motion {
            None => eight.vector(&self.forward.of_sizes(), sizes),
            Some(motion) => {
                eight.each(sizes, |lane, sizes| motion.map_at(time[lane]).of_sizes().vector(sizes))
            }
        }
    }

    /// Transforms vectors of the group's space to the world's, each at its time.
    #[inline(always)]
    pub fn vectors_to_world<S: Simd>(
        &self,
        eight: Eight<S>,
        vectors: &Vectors<S>,
        time: &Lanes,
    ) -> Vectors<S> {
        match &self.instance.motion {
            None => eight.vector(&self.forward, vectors),
            Some(motion) => {
                eight.each(vectors, |lane, vector| motion.map_at(time[lane]).vector(vector))
            }
        }
    }

    /// Transforms normals of the group's space to the world's, of any length, each at its time.
    #[inline(always)]
    pub fn normals_to_world<S: Simd>(
        &self,
        eight: Eight<S>,
        normals: &Vectors<S>,
        time: &Lanes,
    ) -> Vectors<S> {
        match &self.instance.motion {
            None => eight.transposed_vector(&self.instance.inverse, normals),
            Some(motion) => eight.each(normals, |lane, normal| {
                motion.inverse_at(time[lane]).transposed_vector(normal)
            }),
        }
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
