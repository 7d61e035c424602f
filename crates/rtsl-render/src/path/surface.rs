//! The surface properties that materials read for the hits of a batch: the shapes' methods run in object space, then
//! everything is transformed to world space.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};
use rtsl::{Kernel, Method};

use super::instance_transforms::InstanceTransforms;
use super::kernels::Batching;
use super::scene::BatchScene;
use super::shading_batch::{BatchCall, BatchRays, ShadingBatch, set_numbers};
use super::surface_group::SurfaceGroup;
use super::tracer::PathTracer;
use super::wavefront::PathHit;
use crate::compiled::calls::Callee;
use crate::compiled::variables::variables;
use crate::lanes::eight::{Eight, dots, eights_of, points_on_rays};
use crate::lanes::surface_offset::{sizes_on_rays, surface_offsets};
use crate::lanes::surface_state::{
    EightRays, find_scratch, normalize_normals, set_hits, set_inverse_directions, set_tangents,
};

/// The surfaces of a batch.
pub struct BatchSurfaces<'a> {
    tracer: &'a PathTracer<'a>,
    group: &'a SurfaceGroup,
    places: InstanceTransforms<'a>,
}

impl<'a> BatchSurfaces<'a> {
    /// The surfaces of the batch's lanes, which all belong to the group.
    pub fn new(tracer: &'a PathTracer<'a>, group: &'a SurfaceGroup, batch: &ShadingBatch) -> Self {
        let places = InstanceTransforms::new(&tracer.scene.compiled, group.key.class, batch.hits());
        BatchSurfaces { tracer, group, places }
    }

    /// Runs the shapes' methods and stores the inputs of materials and lights in the batch and its state.
    pub fn prepare(&self, batch: &mut ShadingBatch) {
        number(self.tracer.scene, self.group, batch);
        dispatch!(Level::new(), simd => self.prepare_in_vectors(simd, batch));
    }

    #[inline(always)]
    fn prepare_in_vectors<S: Simd>(&self, simd: S, batch: &mut ShadingBatch) {
        let SurfaceGroup { shape, needs, .. } = self.group;
        if let Some(kernel) = &shape.hit {
            self.find_scratch(simd, kernel, batch);
        }
        self.set_local_hits(simd, batch);
        if let Some(kernel) = &shape.normal {
            self.call(kernel, Method::ComputeNormal, batch);
        }
        let reads_normals = shape.coordinates.is_some() || shape.derivatives.is_some();
        if reads_normals || shape.density.is_some() {
            normalize_normals(eights_of(simd, batch.count), &mut batch.state);
        }
        if let Some(kernel) = &shape.density {
            self.call(kernel, Method::SamplePdf, batch);
            self.keep_densities(simd, batch);
        }
        if let Some(kernel) = &shape.coordinates {
            self.call(kernel, Method::ComputeTextureCoordinates, batch);
        }
        if let Some(kernel) = &shape.derivatives {
            self.call(kernel, Method::ComputeDerivatives, batch);
        }
        self.to_world(simd, batch);
        if needs.derivatives && shape.derivatives.is_none() {
            for eight in eights_of(simd, batch.count) {
                let normal = eight.vectors(&batch.geometric_normal);
                set_tangents(eight, &mut batch.state, &normal);
            }
        }
        if needs.footprints {
            set_footprints(simd, batch);
        }
    }

    fn call(&self, kernel: &Kernel, method: Method, batch: &mut ShadingBatch) {
        let class = &self.places.scene().classes[self.group.key.class as usize];
        let callee = Callee { class: &class.name, method, errors: self.tracer.errors };
        let ShadingBatch { count, state, kept_scratch, objects, numbers, .. } = batch;
        let instances = self.group.key.shape.instances(&class.objects, objects);
        callee.call_for_first(kernel, *count, instances, (state, kept_scratch), None, numbers);
    }

    /// Recomputes the scratch of the shapes' `intersect` for the hits.
    #[inline(always)]
    fn find_scratch<S: Simd>(&self, simd: S, kernel: &Kernel, batch: &mut ShadingBatch) {
        let class = &self.places.scene().classes[self.group.key.class as usize];
        let arrays = class.program().layout().scratch_arrays as usize;
        let callee =
            Callee { class: &class.name, method: Method::Intersect, errors: self.tracer.errors };
        let count = batch.count;
        let (rays, BatchCall { blocks, accepted, objects }) = batch.rays_and_call();
        let instances = self.group.key.shape.instances(&class.objects, objects);
        find_scratch(
            eights_of(simd, count),
            blocks,
            arrays,
            |eight| self.rays_in_group(eight, &rays),
            |state, scratch, host| {
                callee.call_for_first(
                    kernel,
                    count,
                    instances,
                    (state, scratch),
                    Some(accepted),
                    host,
                );
            },
        );
    }

    /// Returns the rays in the space of the objects' group, and their limits.
    #[inline(always)]
    fn rays_in_group<S: Simd>(
        &self,
        eight: Eight<S>,
        rays: &BatchRays<'_>,
    ) -> (EightRays<S>, f32x8<S>) {
        let mut origin = eight.vectors(rays.origin);
        let mut direction = eight.vectors(rays.direction);
        if !self.places.is_in_world() {
            let maps = self.places.group_inverses(eight, rays.surface_points);
            (origin, direction) = (maps.points(&origin), maps.vectors(&direction));
        }
        let (epsilon, time) = (eight.numbers(rays.epsilon), eight.numbers(rays.time));
        (EightRays { origin, direction, epsilon, time }, eight.numbers(rays.limit))
    }

    /// Sets the inputs of the shapes' methods, and default results for methods that the class lacks.
    #[inline(always)]
    fn set_local_hits<S: Simd>(&self, simd: S, batch: &mut ShadingBatch) {
        let count = batch.count;
        let (of_batch, BatchCall { blocks: (state, _), .. }) = batch.rays_and_call();
        for eight in eights_of(simd, count) {
            let (mut rays, _) = self.rays_in_group(eight, &of_batch);
            if self.places.is_placed() {
                let maps = self.places.inverses(eight, of_batch.surface_points);
                rays.origin = maps.points(&rays.origin);
                rays.direction = maps.vectors(&rays.direction);
            }
            let distance = eight.numbers(of_batch.distance);
            set_hits(eight, state, &rays, distance, self.group.needs);
        }
    }

    /// Transforms the densities with which `generateSample` would have sampled the hits, as seen from the rays'
    /// origins, to world space: by the Jacobian of directions under a linear map, which is its stretch along the
    /// direction, cubed, divided by its determinant.
    #[inline(always)]
    fn keep_densities<S: Simd>(&self, simd: S, batch: &mut ShadingBatch) {
        let v = variables();
        for eight in eights_of(simd, batch.count) {
            let state = &batch.state;
            let world = eight.vectors(&batch.direction);
            let local = eight.load_vectors(state, v.ray_direction);
            let squares = dots(&world, &world) / dots(&local, &local);
            let scale =
                squares * squares.sqrt() / self.places.volume_scales(eight, batch.surface_points());
            let density = eight.load(state, v.pdf) * scale;
            let usable = density.simd_gt(0.0) & density.simd_lt(f32::INFINITY);
            eight.blend(usable.select(density, eight.splat(0.0)), &mut batch.light_density);
        }
    }

    /// Transforms rays and surfaces to world space.
    #[inline(always)]
    fn to_world<S: Simd>(&self, simd: S, batch: &mut ShadingBatch) {
        let v = variables();
        let needs = self.group.needs;
        let is_elsewhere = self.places.is_placed() || !self.places.is_in_world();
        let has_tangents = self.group.shape.derivatives.is_some();
        for eight in eights_of(simd, batch.count) {
            let (origin, direction) =
                (eight.vectors(&batch.origin), eight.vectors(&batch.direction));
            let distance = eight.numbers(&batch.distance);
            let point = points_on_rays(&origin, &direction, distance);
            eight.blend_vectors(&point, &mut batch.point);
            let up = eight.splat_vector([0.0, 0.0, 1.0]);
            let geometric = eight.load_vectors(&batch.state, v.geometric_normal);
            let shading = eight.load_vectors(&batch.state, v.shading_normal);
            let [geometric, shading] =
                self.places.normals(eight, batch.surface_points(), [geometric, shading]);
            let geometric = eight.normalized_or(&geometric, &up);
            let shading = eight.normalized_or(&shading, &geometric);
            let sizes = sizes_on_rays(&origin, &direction, distance);
            let sizes = self.places.sizes_of_points(eight, batch.surface_points(), &sizes);
            eight.blend(surface_offsets(eight, &geometric, &sizes), &mut batch.offset);
            let is_behind = dots(&direction, &geometric).simd_gt(0.0);
            eight.blend(is_behind.select(eight.splat(-1.0), eight.splat(1.0)), &mut batch.side);
            eight.blend_vectors(&geometric, &mut batch.geometric_normal);
            eight.blend_vectors(&shading, &mut batch.shading_normal);
            if has_tangents {
                for variable in [v.dpdu, v.dpdv] {
                    let local = eight.load_vectors(&batch.state, variable);
                    let tangents = self.places.vectors(eight, batch.surface_points(), &local);
                    eight.store_vectors(&mut batch.state, variable, &tangents);
                }
            }
            let state = &mut batch.state;
            eight.store_vectors(state, v.geometric_normal, &geometric);
            eight.store_vectors(state, v.shading_normal, &shading);
            if is_elsewhere {
                eight.store_vectors(state, v.ray_origin, &origin);
                eight.store_vectors(state, v.ray_direction, &direction);
                eight.store_vectors(state, v.hit_point, &point);
                if needs.inverse_directions {
                    set_inverse_directions(eight, state, &direction);
                }
            }
        }
    }
}

/// Sets the width of the rays' footprints in surface parameters. At grazing angles the footprint is an ellipse, whose
/// area determines the width.
#[inline(always)]
fn set_footprints<S: Simd>(simd: S, batch: &mut ShadingBatch) {
    let v = variables();
    for eight in eights_of(simd, batch.count) {
        let direction = eight.vectors(&batch.direction);
        let cosine = dots(&direction, &eight.vectors(&batch.geometric_normal)).abs();
        let length = dots(&direction, &direction).sqrt();
        let slant = (cosine / length).max(eight.splat(MIN_COSINE)).sqrt();
        let width = eight.numbers(&batch.width) / slant;
        for (width_of, tangent) in [(v.du, v.dpdu), (v.dv, v.dpdv)] {
            let tangents = eight.load_vectors(&batch.state, tangent);
            let parameter = width / dots(&tangents, &tangents).sqrt();
            let is_usable = parameter.simd_lt(f32::INFINITY);
            let parameter = is_usable.select(parameter, eight.splat(0.0));
            eight.store(&mut batch.state, width_of, parameter);
        }
    }
}

/// The least cosine for which footprints are computed; smaller ones are clamped.
const MIN_COSINE: f32 = 0.01;

/// Sets the indices of shapes, materials and emitters, if they vary between lanes.
fn number(scene: &BatchScene, group: &SurfaceGroup, batch: &mut ShadingBatch) {
    let count = batch.count.next_multiple_of(8);
    let entry = |hit: &PathHit| &scene.objects[hit.object as usize];
    let hits = &batch.hits[..count];
    if group.key.shape == Batching::Each {
        let class = &scene.compiled.classes[group.key.class as usize];
        let number = |hit: &PathHit| match class.has_elements() {
            true => class.number_of(hit.object, hit.element).unwrap_or(0),
            false => entry(hit).number,
        };
        set_numbers(&mut batch.objects, hits.iter().map(number));
    }
    if group.key.material.1 == Batching::Each {
        set_numbers(&mut batch.materials, hits.iter().map(|hit| entry(hit).material));
    }
    if let Some((_, Batching::Each)) = group.key.alpha {
        set_numbers(&mut batch.alpha, hits.iter().map(|hit| entry(hit).alpha));
    }
    if let Some((_, Batching::Each)) = group.key.emitter {
        set_numbers(&mut batch.emitters, hits.iter().map(|hit| entry(hit).emitter));
    }
}
