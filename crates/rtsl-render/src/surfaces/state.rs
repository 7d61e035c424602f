//! The state variables that methods of shapes and materials read, for the surfaces hit by eight rays.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};
use rtsl::LaneBlock;

use super::surface_needs::SurfaceNeeds;
use crate::compiled::variables::variables;
use crate::lanes::eight::{Eight, Vectors, dots, points_on_rays, scaled, select};
use crate::lanes::lane_maps::LaneMaps;

/// Eight rays in some space.
#[derive(Clone, Copy)]
pub struct EightRays<S: Simd> {
    /// Their origins.
    pub origin: Vectors<S>,
    /// Their directions.
    pub direction: Vectors<S>,
    /// The least parameters of hits (exclusive).
    pub epsilon: f32x8<S>,
    /// The times within the shutter.
    pub time: f32x8<S>,
}

impl<S: Simd> EightRays<S> {
    /// Transforms the rays to another space.
    #[inline(always)]
    pub fn transform(&mut self, maps: &LaneMaps<S>) {
        self.origin = maps.points(&self.origin);
        self.direction = maps.vectors(&self.direction);
    }

    /// Sets the state variables of rays.
    #[inline(always)]
    pub fn store(&self, eight: Eight<S>, state: &mut LaneBlock) {
        let v = variables();
        eight.store_vectors(state, v.ray_origin, &self.origin);
        eight.store_vectors(state, v.ray_direction, &self.direction);
        eight.store(state, v.epsilon, self.epsilon);
        eight.store(state, v.time_seed, self.time);
    }
}

/// Sets the inputs of shapes' methods for hits at these parameters of rays, all in the shapes' own spaces, and default
/// results for methods that the class lacks.
#[inline(always)]
pub fn set_hits<S: Simd>(
    eight: Eight<S>,
    state: &mut LaneBlock,
    rays: &EightRays<S>,
    distance: f32x8<S>,
    needs: SurfaceNeeds,
) {
    let v = variables();
    let EightRays { origin, direction, .. } = rays;
    rays.store(eight, state);
    if needs.inverse_directions {
        set_inverse_directions(eight, state, direction);
    }
    let point = points_on_rays(origin, direction, distance);
    let facing = [-direction[0], -direction[1], -direction[2]];
    eight.store(state, v.hit_distance, distance);
    eight.store_vectors(state, v.hit_point, &point);
    eight.store_vectors(state, v.geometric_normal, &facing);
    eight.store_vectors(state, v.shading_normal, &facing);
    eight.store(state, v.surface_offset, eight.splat(0.0));
    eight.store(state, v.du, eight.splat(0.0));
    eight.store(state, v.dv, eight.splat(0.0));
    if needs.coordinates || needs.derivatives {
        set_coordinates(eight, state, &point);
    }
}

/// Sets the reciprocal directions.
#[inline(always)]
pub fn set_inverse_directions<S: Simd>(
    eight: Eight<S>,
    state: &mut LaneBlock,
    direction: &Vectors<S>,
) {
    let one: f32x8<S> = eight.splat(1.0);
    let inverse = [one / direction[0], one / direction[1], one / direction[2]];
    eight.store_vectors(state, variables().inverse_ray_direction, &inverse);
}

/// Sets the default texture coordinates and derivatives.
#[inline(always)]
fn set_coordinates<S: Simd>(eight: Eight<S>, state: &mut LaneBlock, point: &Vectors<S>) {
    let v = variables();
    let (zero, one) = (eight.splat(0.0), eight.splat(1.0));
    eight.store_vectors(state, v.texture_uvw, point);
    for component in [v.texture_uv, v.texture_uv + 1, v.dsdv, v.dtdu] {
        eight.store(state, component, zero);
    }
    for component in [v.dsdu, v.dtdv] {
        eight.store(state, component, one);
    }
}

/// Sets the default coordinates for solid textures to hit points that `computeNormal` may have moved.
#[inline(always)]
pub fn set_moved_coordinates<S: Simd>(
    eights: impl Iterator<Item = Eight<S>>,
    state: &mut LaneBlock,
) {
    let v = variables();
    for eight in eights {
        let point = eight.load_vectors(state, v.hit_point);
        eight.store_vectors(state, v.texture_uvw, &point);
    }
}

/// Normalises the normals in the object's space.
#[inline(always)]
pub fn normalize_normals<S: Simd>(eights: impl Iterator<Item = Eight<S>>, state: &mut LaneBlock) {
    let v = variables();
    for eight in eights {
        let up = eight.splat_vector([0.0, 0.0, 1.0]);
        let geometric = eight.load_vectors(state, v.geometric_normal);
        let geometric = eight.normalized_or(&geometric, &up);
        let shading = eight.load_vectors(state, v.shading_normal);
        let shading = eight.normalized_or(&shading, &geometric);
        eight.store_vectors(state, v.geometric_normal, &geometric);
        eight.store_vectors(state, v.shading_normal, &shading);
    }
}

/// Sets default tangents: an arbitrary frame of the normal.
#[inline(always)]
pub fn set_tangents<S: Simd>(eight: Eight<S>, state: &mut LaneBlock, normal: &Vectors<S>) {
    let v = variables();
    let [x, y, z] = [normal[0].abs(), normal[1].abs(), normal[2].abs()];
    let axis = |axis: usize| {
        let mut unit = [0.0; 3];
        unit[axis] = 1.0;
        eight.splat_vector(unit)
    };
    let is_x = x.simd_le(y) & x.simd_le(z);
    let least = select(is_x, &axis(0), &select(y.simd_le(z), &axis(1), &axis(2)));
    let along = scaled(normal, dots(normal, &least));
    let across = [least[0] - along[0], least[1] - along[1], least[2] - along[2]];
    let first = eight.normalized_or(&across, &axis(0));
    let second = [
        normal[1] * first[2] - normal[2] * first[1],
        normal[2] * first[0] - normal[0] * first[2],
        normal[0] * first[1] - normal[1] * first[0],
    ];
    eight.store_vectors(state, v.dpdu, &first);
    eight.store_vectors(state, v.dpdv, &second);
}
