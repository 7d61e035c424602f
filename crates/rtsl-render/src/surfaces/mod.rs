//! The surface properties that materials and lights read at hits. The shapes' methods run in object space; their
//! results are then transformed to world space.

mod hit_lanes;
mod state;
mod surface_needs;
mod transforms;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};
use rtsl::{HitPlacement, Method};
use rtsl_math::{SIMD_LANES, SURFACE_ERROR, TRANSFORM_ERROR};

pub use hit_lanes::{EightSurfaces, HitLanes, ObjectHit, SurfaceLanes};
pub use state::EightRays;
pub use surface_needs::SurfaceNeeds;
pub use transforms::SurfaceTransforms;

use crate::compiled::variables::variables;
use crate::lanes::eight::{Eight, Vectors, dots, points_on_rays, scaled, select};
use crate::lanes::surface_offset::{sizes, sizes_on_rays, surface_offsets};
use state::{
    normalize_normals, set_hits, set_inverse_directions, set_moved_coordinates, set_tangents,
};

/// The surfaces of objects of one traversal class.
pub struct Surfaces<'a> {
    /// The transforms of the objects.
    pub transforms: SurfaceTransforms<'a>,
    /// The properties to compute besides normals.
    pub needs: SurfaceNeeds,
    /// True if methods of the shapes may read normals.
    pub shapes_read_normals: bool,
    /// The parts of hits that the shapes' `computeNormal` sets.
    pub placement: HitPlacement,
}

impl Surfaces<'_> {
    /// Runs the shapes' methods for the hits of `lanes`. The state then has the inputs of materials.
    #[inline(always)]
    pub fn prepare<S: Simd>(&self, simd: S, lanes: &mut impl SurfaceLanes) {
        self.find_scratch(simd, lanes);
        self.set_local_hits(simd, lanes);
        let SurfaceNeeds { coordinates, derivatives, .. } = self.needs;
        lanes.call(Method::ComputeNormal);
        if self.shapes_read_normals {
            // The last normal written is normalised when it is transformed to the world.
            normalize_normals(lanes.eights(simd), lanes.state());
        }
        if lanes.needs(Method::SamplePdf) {
            lanes.call(Method::SamplePdf);
            self.keep_light_densities(simd, lanes);
        }
        if coordinates || derivatives {
            if self.placement.moves {
                set_moved_coordinates(lanes.eights(simd), lanes.state());
            }
            lanes.call(Method::ComputeTextureCoordinates);
        }
        if derivatives {
            lanes.call(Method::ComputeDerivatives);
        }
        self.to_world(simd, lanes);
    }

    /// Calls `intersect` again for the hits, to obtain its scratch, if it is read. The call reproduces the one that
    /// accepted the hit only if its inputs are the same: the ray's own limit rather than the hit's distance, unset
    /// scratch, and no random numbers.
    #[inline(always)]
    fn find_scratch<S: Simd>(&self, simd: S, lanes: &mut impl SurfaceLanes) {
        if !lanes.needs(Method::Intersect) {
            return;
        }
        for eight in lanes.eights(simd) {
            let rays = self.rays_in_group(eight, lanes);
            let limits = lanes.limits(eight);
            let state = lanes.state();
            rays.store(eight, state);
            set_inverse_directions(eight, state, &rays.direction);
            eight.store(state, variables().hit_distance, limits);
            let (scratch, arrays) = lanes.scratch();
            for array in 0..arrays {
                eight.store(scratch, array, eight.splat(0.0));
            }
        }
        lanes.call(Method::Intersect);
    }

    /// Returns the rays in the space of the objects' group.
    #[inline(always)]
    fn rays_in_group<S: Simd>(&self, eight: Eight<S>, lanes: &impl SurfaceLanes) -> EightRays<S> {
        let mut rays = lanes.rays(eight);
        if let Some(maps) = self.transforms.world_to_group(eight, lanes) {
            rays.transform(&maps);
        }
        rays
    }

    /// Sets the inputs of the shapes' methods, and default results for methods that the class lacks.
    #[inline(always)]
    fn set_local_hits<S: Simd>(&self, simd: S, lanes: &mut impl SurfaceLanes) {
        for eight in lanes.eights(simd) {
            let mut rays = self.rays_in_group(eight, lanes);
            // As in the traversal, an object without a transform gets its group's rays unchanged.
            if let Some(maps) = self.transforms.group_to_object(eight, lanes) {
                rays.transform(&maps);
            }
            let distance = lanes.distances(eight);
            set_hits(eight, lanes.state(), &rays, distance, self.needs);
        }
    }

    /// Transforms the densities with which `generateSample` would have sampled the hits, as seen from the rays'
    /// origins, to world space: by the Jacobian of directions under a linear map, which is its stretch along the
    /// direction, cubed, divided by its determinant.
    #[inline(always)]
    fn keep_light_densities<S: Simd>(&self, simd: S, lanes: &mut impl SurfaceLanes) {
        let v = variables();
        for eight in lanes.eights(simd) {
            let world = lanes.rays(eight).direction;
            let local = eight.load_vectors(lanes.state(), v.ray_direction);
            let squares = dots(&world, &world) / dots(&local, &local);
            let scale = squares * squares.sqrt() / self.transforms.volume_scales(eight, lanes);
            let density = eight.load(lanes.state(), v.pdf) * scale;
            let usable = density.simd_gt(0.0) & density.simd_lt(f32::INFINITY);
            lanes.keep_light_densities(eight, usable.select(density, eight.splat(0.0)));
        }
    }

    /// Transforms rays and surfaces to world space.
    #[inline(always)]
    fn to_world<S: Simd>(&self, simd: S, lanes: &mut impl SurfaceLanes) {
        let v = variables();
        let SurfaceNeeds { derivatives, inverse_directions, numbers, maps, .. } = self.needs;
        let has_derivatives = derivatives && lanes.needs(Method::ComputeDerivatives);
        for eight in lanes.eights(simd) {
            let rays = lanes.rays(eight);
            let surfaces = self.surfaces(eight, &rays, lanes);
            lanes.keep(eight, &surfaces);
            let EightSurfaces { point, geometric_normal, shading_normal, .. } = surfaces;
            if has_derivatives {
                for variable in [v.dpdu, v.dpdv] {
                    let local = eight.load_vectors(lanes.state(), variable);
                    let tangents = self.transforms.vectors(eight, lanes, &local);
                    eight.store_vectors(lanes.state(), variable, &tangents);
                }
            } else if derivatives {
                set_tangents(eight, lanes.state(), &geometric_normal);
            }
            if maps {
                self.store_maps(eight, lanes);
            }
            if numbers {
                store_numbers(eight, lanes);
            }
            let state = lanes.state();
            eight.store_vectors(state, v.geometric_normal, &geometric_normal);
            eight.store_vectors(state, v.shading_normal, &shading_normal);
            if self.transforms.are_local() {
                eight.store_vectors(state, v.ray_origin, &rays.origin);
                eight.store_vectors(state, v.ray_direction, &rays.direction);
                eight.store_vectors(state, v.hit_point, &point);
                if inverse_directions {
                    set_inverse_directions(eight, state, &rays.direction);
                }
            }
        }
    }

    /// Stores the maps between the objects' spaces and the world.
    #[inline(always)]
    fn store_maps<S: Simd>(&self, eight: Eight<S>, lanes: &mut impl SurfaceLanes) {
        let v = variables();
        let maps = [
            (v.to_object, self.transforms.world_to_object(eight, lanes)),
            (v.to_world, self.transforms.object_to_world(eight, lanes)),
        ];
        for (first, map) in maps {
            for (column, vectors) in map.columns().iter().enumerate() {
                eight.store_vectors(lanes.state(), first + 3 * column, vectors);
            }
        }
    }

    /// Returns the surfaces in world space, with the normals that the state has in object space.
    #[inline(always)]
    fn surfaces<S: Simd, L: SurfaceLanes>(
        &self,
        eight: Eight<S>,
        rays: &EightRays<S>,
        lanes: &mut L,
    ) -> EightSurfaces<S> {
        let v = variables();
        let normals = [
            eight.load_vectors(lanes.state(), v.geometric_normal),
            eight.load_vectors(lanes.state(), v.shading_normal),
        ];
        let [geometric, shading] = self.transforms.normals(eight, lanes, normals);
        let up = eight.splat_vector([0.0, 0.0, 1.0]);
        let geometric_normal = eight.normalized_or(&geometric, &up);
        let shading_normal = eight.normalized_or(&shading, &geometric_normal);
        let (point, sizes) = self.points(eight, rays, lanes);
        let HitPlacement { is_bounded, .. } = self.placement;
        let sizes = self.transforms.sizes_of_points(eight, lanes, &sizes, !is_bounded);
        let error = if is_bounded { TRANSFORM_ERROR } else { SURFACE_ERROR };
        let offset = surface_offsets(eight, &geometric_normal, (&sizes, error));
        let offset = match self.offsets_of_shapes(eight, &normals[0], lanes) {
            None => offset,
            Some(own) if is_bounded => own + offset,
            Some(own) => own.max(offset),
        };
        let direction = rays.direction;
        EightSurfaces { direction, point, offset, geometric_normal, shading_normal }
    }

    /// Returns the hit points in world space, and the sizes of the terms that they are computed from. Hits of shapes
    /// that put them back are where the shape says, but where the ray is if that is as precise in the shape's space and the
    /// shape has left them there: the world's coordinates near a camera have more digits than those of a planet.
    #[inline(always)]
    fn points<S: Simd>(
        &self,
        eight: Eight<S>,
        rays: &EightRays<S>,
        lanes: &mut impl SurfaceLanes,
    ) -> (Vectors<S>, Vectors<S>) {
        let v = variables();
        let distance = lanes.distances(eight);
        let on_rays = points_on_rays(&rays.origin, &rays.direction, distance);
        let of_rays = sizes_on_rays(&rays.origin, &rays.direction, distance);
        if !self.placement.moves {
            return (on_rays, of_rays);
        }
        let [origin, direction, found] = [v.ray_origin, v.ray_direction, v.hit_point]
            .map(|variable| eight.load_vectors(lanes.state(), variable));
        let [x, y, z] = points_on_rays(&origin, &direction, distance);
        let [size, of_ray] = [sizes(&found), sizes_on_rays(&origin, &direction, distance)]
            .map(|[x, y, z]| x + y + z);
        let stays = x.simd_eq(found[0])
            & y.simd_eq(found[1])
            & z.simd_eq(found[2])
            & of_ray.simd_le(size + size);
        let moved = self.transforms.points(eight, lanes, &found);
        (select(stays, &on_rays, &moved), select(stays, &of_rays, &sizes(&moved)))
    }

    /// Returns the offsets that the shapes set, in world space, given the normals in the shapes' spaces; `None` if none
    /// is positive.
    #[inline(always)]
    fn offsets_of_shapes<S: Simd, L: SurfaceLanes>(
        &self,
        eight: Eight<S>,
        normal: &Vectors<S>,
        lanes: &mut L,
    ) -> Option<f32x8<S>> {
        let zero = eight.splat(0.0);
        let local = eight.load(lanes.state(), variables().surface_offset);
        let usable = local.simd_gt(zero) & local.simd_lt(f32::INFINITY);
        if usable.to_bitmask() == 0 {
            return None;
        }
        let normal = eight.normalized_or(normal, &eight.splat_vector([0.0; 3]));
        let step = scaled(&normal, usable.select(local, zero));
        let world = self.transforms.vectors(eight, lanes, &step);
        let offset = dots(&world, &world).sqrt();
        Some(offset.simd_lt(f32::INFINITY).select(offset, zero))
    }
}

/// Stores the indices of the objects that the rays hit.
#[inline(always)]
fn store_numbers<S: Simd>(eight: Eight<S>, lanes: &mut impl SurfaceLanes) {
    let v = variables();
    for lane in eight.start()..eight.start() + SIMD_LANES {
        let ObjectHit { object, element, instance } = lanes.hit(lane);
        let instance = instance.map_or(-1.0, |instance| instance as f32);
        let state = lanes.state();
        state.floats_mut(v.object_number)[lane] = object as f32;
        state.floats_mut(v.instance_number)[lane] = instance;
        state.floats_mut(v.element_number)[lane] = element as f32;
    }
}
