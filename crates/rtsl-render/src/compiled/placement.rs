//! Where the group of a hit stands in the world: the same for all rays of an instance that stands still,
//! for each ray what its time says where the instance moves.

use fearless_simd::Simd;
use rtsl_bvh::{Instance, LaneMask, Lanes, RayPacket};
use rtsl_math::Affine;

use crate::lanes::eight::{Eight, Vectors};

/// An instance, with both of its maps.
pub struct Placement<'a> {
    instance: &'a Instance,
    /// From the group's space to the world's, of what stands still.
    forward: Affine,
}

impl<'a> Placement<'a> {
    /// That of an instance which leads to the world by `forward`, unless it moves.
    pub fn new(instance: &'a Instance, forward: Affine) -> Self {
        Placement { instance, forward }
    }

    /// The rays of `lanes` in the group's space.
    #[inline(always)]
    pub fn rays_in_group(&self, rays: &RayPacket, lanes: LaneMask) -> RayPacket {
        self.instance.moved_packet(rays, lanes)
    }

    /// Points of the world in the group's space, each at its time.
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

    /// Points of the group's space in the world's, each at its time.
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

    /// The sizes of what points of these sizes become in the group's space.
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

    /// The sizes of what vectors of these sizes of the group's space become in the world's.
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

    /// Vectors of the group's space in the world's, each at its time.
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

    /// Normals of the group's space in the world's, of any length, each at its time.
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

    /// From the group's space to the world's, at this time.
    pub fn map_at(&self, time: f32) -> Affine {
        match &self.instance.motion {
            None => self.forward,
            Some(motion) => motion.map_at(time),
        }
    }

    /// From the world's space to the group's, at this time.
    pub fn inverse_at(&self, time: f32) -> Affine {
        match &self.instance.motion {
            None => self.instance.inverse,
            Some(motion) => motion.inverse_at(time),
        }
    }

    /// How much larger a volume of the group's space is in the world's; positive.
    pub fn volume_scale(&self, time: f32) -> f64 {
        match &self.instance.motion {
            None => self.forward.volume_scale(),
            Some(motion) => motion.map_at(time).volume_scale(),
        }
    }
}
