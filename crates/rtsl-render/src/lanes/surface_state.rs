//! What methods of shapes and materials find in the state for the surfaces of eight rays.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};
use rtsl::LaneBlock;
use rtsl::host::{Host, NoHost};

use crate::compiled::calls::CallBlocks;
use crate::compiled::shaders::SurfaceNeeds;
use crate::compiled::variables::variables;

use super::eight::{Eight, Vectors, dots, points_on_rays, scaled, select};

/// Rays of eight lanes in some space, and what belongs to them.
#[derive(Clone, Copy)]
pub struct EightRays<S: Simd> {
    /// Where they begin.
    pub origin: Vectors<S>,
    /// Where they go.
    pub direction: Vectors<S>,
    /// The least parameters of hits (exclusive).
    pub epsilon: f32x8<S>,
    /// The times within the shutter.
    pub time: f32x8<S>,
}

impl<S: Simd> EightRays<S> {
    /// Sets what methods read of rays.
    #[inline(always)]
    pub fn store(&self, eight: Eight<S>, state: &mut LaneBlock) {
        let v = variables();
        eight.store_vectors(state, v.ray_origin, &self.origin);
        eight.store_vectors(state, v.ray_direction, &self.direction);
        eight.store(state, v.epsilon, self.epsilon);
        eight.store(state, v.time_seed, self.time);
    }
}

/// Runs `intersect` once more for rays that hit, for the scratch that it leaves. Both renderers do so here: it does as it
/// did for the hit that was accepted only where it finds what it found then, which is the ray's own limit, not the hit
/// that is known by now; scratch that nothing has set; and no random numbers. `rays` says for eight lanes what the traversal
/// was given, in the space of the objects' group: the rays and their limits. `call` calls the class's `intersect`, which has
/// so many arrays of scratch.
#[inline(always)]
pub fn find_scratch<S: Simd, B: HasState>(
    eights: impl Iterator<Item = Eight<S>>,
    (blocks, scratch): (&mut B, &mut LaneBlock),
    scratch_arrays: usize,
    rays: impl Fn(Eight<S>) -> (EightRays<S>, f32x8<S>),
    call: impl FnOnce(&mut B, &mut LaneBlock, &mut dyn Host),
) {
    for eight in eights {
        let (rays, limit) = rays(eight);
        let state = blocks.state_mut();
        rays.store(eight, state);
        set_inverse_directions(eight, state, &rays.direction);
        eight.store(state, variables().hit_distance, limit);
        for array in 0..scratch_arrays {
            eight.store(scratch, array, eight.splat(0.0));
        }
    }
    call(blocks, scratch, &mut NoHost);
}

/// Blocks of a call, the state among them.
pub trait HasState {
    /// The state.
    fn state_mut(&mut self) -> &mut LaneBlock;
}

impl HasState for LaneBlock {
    fn state_mut(&mut self) -> &mut LaneBlock {
        self
    }
}

impl HasState for CallBlocks {
    fn state_mut(&mut self) -> &mut LaneBlock {
        &mut self.state
    }
}

/// Sets what methods of shapes read of hits at these parameters of rays, all in the shapes' own spaces, and what stands
/// where a class computes nothing.
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
    eight.store(state, v.du, eight.splat(0.0));
    eight.store(state, v.dv, eight.splat(0.0));
    if needs.coordinates || needs.derivatives {
        set_coordinates(eight, state, &point);
    }
}

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
