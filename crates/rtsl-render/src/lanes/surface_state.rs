//! What methods of shapes and materials find in the state for the surfaces of eight rays.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};
use rtsl::LaneBlock;

use crate::compiled::variables::variables;

use super::eight::{Eight, Vectors, dots, scaled, select};

/// Sets one over the directions.
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

/// The texture coordinates and derivatives of a class that computes none.
#[inline(always)]
pub fn set_coordinates<S: Simd>(eight: Eight<S>, state: &mut LaneBlock, point: &Vectors<S>) {
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

/// Gives the normals of the object's space unit length.
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

/// Tangents of a class that computes none: any frame of the normal.
#[inline(always)]
pub fn set_tangents<S: Simd>(eight: Eight<S>, state: &mut LaneBlock, normal: &Vectors<S>) {
    let v = variables();
    let [x, y, z] = normal.map(|component| component.abs());
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
