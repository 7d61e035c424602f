//! What is known of the surfaces that the paths of a chunk hit, as materials read it: the methods of the
//! shapes in their own spaces, then everything in world space.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};
use rtsl::{Kernel, Method};

use super::instance_transforms::InstanceTransforms;
use super::kernels::Batching;
use super::scene::BatchScene;
use super::shading_batch::{Callee, ChunkCall, ChunkRays, ShadingBatch, set_numbers};
use super::surface_group::SurfaceGroup;
use super::tracer::PathTracer;
use super::wavefront::PathHit;
use crate::compiled::variables::variables;
use crate::lanes::eight::{Eight, dots, eights_of, points_on_rays};
use crate::lanes::surface_offset::{sizes_on_rays, surface_offsets};
use crate::lanes::surface_state::{
    EightRays, find_scratch, normalize_normals, set_hits, set_inverse_directions, set_tangents,
};

/// The surfaces of a chunk.
pub struct ChunkSurfaces<'a> {
    tracer: &'a PathTracer<'a>,
    group: &'a SurfaceGroup,
    places: InstanceTransforms<'a>,
}

impl<'a> ChunkSurfaces<'a> {
    /// Those of the chunk's lanes, which all belong to the group.
    pub fn new(tracer: &'a PathTracer<'a>, group: &'a SurfaceGroup, chunk: &ShadingBatch) -> Self {
        let places = InstanceTransforms::new(&tracer.scene.compiled, group.key.class, chunk.hits());
        ChunkSurfaces { tracer, group, places }
    }

    /// Runs the shapes' methods and leaves in the chunk and its state what materials and lights read.
    pub fn prepare(&self, chunk: &mut ShadingBatch) {
        number(self.tracer.scene, self.group, chunk);
        dispatch!(Level::new(), simd => self.prepare_in_vectors(simd, chunk));
    }

    #[inline(always)]
    fn prepare_in_vectors<S: Simd>(&self, simd: S, chunk: &mut ShadingBatch) {
        let SurfaceGroup { shape, needs, .. } = self.group;
        if let Some(kernel) = &shape.hit {
            self.find_scratch(simd, kernel, chunk);
        }
        self.set_local_hits(simd, chunk);
        if let Some(kernel) = &shape.normal {
            self.call(kernel, Method::ComputeNormal, chunk);
        }
        let reads_normals = shape.coordinates.is_some() || shape.derivatives.is_some();
        if reads_normals || shape.density.is_some() {
            normalize_normals(eights_of(simd, chunk.count), &mut chunk.state);
        }
        if let Some(kernel) = &shape.density {
            self.call(kernel, Method::SamplePdf, chunk);
            self.keep_densities(simd, chunk);
        }
        if let Some(kernel) = &shape.coordinates {
            self.call(kernel, Method::ComputeTextureCoordinates, chunk);
        }
        if let Some(kernel) = &shape.derivatives {
            self.call(kernel, Method::ComputeDerivatives, chunk);
        }
        self.to_world(simd, chunk);
        if needs.derivatives && shape.derivatives.is_none() {
            for eight in eights_of(simd, chunk.count) {
                let normal = eight.vectors(&chunk.geometric_normal);
                set_tangents(eight, &mut chunk.state, &normal);
            }
        }
        if needs.footprints {
            set_footprints(simd, chunk);
        }
    }

    fn call(&self, kernel: &Kernel, method: Method, chunk: &mut ShadingBatch) {
        let class = &self.places.scene().classes[self.group.key.class as usize];
        let callee = Callee { class: &class.name, method, problems: self.tracer.problems };
        let ShadingBatch { count, state, kept_scratch, objects, numbers, .. } = chunk;
        let instances = self.group.key.shape.instances(&class.objects, objects);
        callee.call(kernel, *count, instances, (state, kept_scratch), None, numbers);
    }

    /// Finds the scratch that the shapes' `intersect` left for the hits.
    #[inline(always)]
    fn find_scratch<S: Simd>(&self, simd: S, kernel: &Kernel, chunk: &mut ShadingBatch) {
        let class = &self.places.scene().classes[self.group.key.class as usize];
        let arrays = class.program().layout().scratch_arrays as usize;
        let callee = Callee {
            class: &class.name,
            method: Method::Intersect,
            problems: self.tracer.problems,
        };
        let count = chunk.count;
        let (rays, ChunkCall { blocks, accepted, objects }) = chunk.rays_and_call();
        let instances = self.group.key.shape.instances(&class.objects, objects);
        find_scratch(
            eights_of(simd, count),
            blocks,
            arrays,
            |eight| self.rays_in_group(eight, &rays),
            |state, scratch, host| {
                callee.call(kernel, count, instances, (state, scratch), Some(accepted), host);
            },
        );
    }

    /// The rays in the space of the objects' group, and their limits.
    #[inline(always)]
    fn rays_in_group<S: Simd>(
        &self,
        eight: Eight<S>,
        rays: &ChunkRays<'_>,
    ) -> (EightRays<S>, f32x8<S>) {
        let mut origin = eight.vectors(rays.origin);
        let mut direction = eight.vectors(rays.direction);
        if !self.places.is_in_world() {
            let maps = self.places.group_inverses(eight, rays.whereabouts);
            (origin, direction) = (maps.points(&origin), maps.vectors(&direction));
        }
        let (epsilon, time) = (eight.numbers(rays.epsilon), eight.numbers(rays.time));
        (EightRays { origin, direction, epsilon, time }, eight.numbers(rays.limit))
    }

    /// Sets what methods of shapes read, and what stands where the class lacks one.
    #[inline(always)]
    fn set_local_hits<S: Simd>(&self, simd: S, chunk: &mut ShadingBatch) {
        let count = chunk.count;
        let (of_chunk, ChunkCall { blocks: (state, _), .. }) = chunk.rays_and_call();
        for eight in eights_of(simd, count) {
            let (mut rays, _) = self.rays_in_group(eight, &of_chunk);
            if self.places.is_placed() {
                let maps = self.places.inverses(eight, of_chunk.whereabouts);
                rays.origin = maps.points(&rays.origin);
                rays.direction = maps.vectors(&rays.direction);
            }
            let distance = eight.numbers(of_chunk.distance);
            set_hits(eight, state, &rays, distance, self.group.needs);
        }
    }

    /// Takes the densities with which `generateSample` would have chosen the hits, seen from where the rays begin, to the
    /// world: by the Jacobian of directions under a linear map, which is its stretch along the direction, cubed,
    /// over its determinant.
    #[inline(always)]
    fn keep_densities<S: Simd>(&self, simd: S, chunk: &mut ShadingBatch) {
        let v = variables();
        for eight in eights_of(simd, chunk.count) {
            let state = &chunk.state;
            let world = eight.vectors(&chunk.direction);
            let local = eight.load_vectors(state, v.ray_direction);
            let squares = dots(&world, &world) / dots(&local, &local);
            let scale =
                squares * squares.sqrt() / self.places.volume_scales(eight, chunk.whereabouts());
            let density = eight.load(state, v.pdf) * scale;
            let usable = density.simd_gt(0.0) & density.simd_lt(f32::INFINITY);
            eight.blend(usable.select(density, eight.splat(0.0)), &mut chunk.light_density);
        }
    }

    /// Takes rays and surfaces to the world's space.
    #[inline(always)]
    fn to_world<S: Simd>(&self, simd: S, chunk: &mut ShadingBatch) {
        let v = variables();
        let needs = self.group.needs;
        let is_elsewhere = self.places.is_placed() || !self.places.is_in_world();
        let has_tangents = self.group.shape.derivatives.is_some();
        for eight in eights_of(simd, chunk.count) {
            let (origin, direction) =
                (eight.vectors(&chunk.origin), eight.vectors(&chunk.direction));
            let distance = eight.numbers(&chunk.distance);
            let point = points_on_rays(&origin, &direction, distance);
            eight.blend_vectors(&point, &mut chunk.point);
            let up = eight.splat_vector([0.0, 0.0, 1.0]);
            let geometric = eight.load_vectors(&chunk.state, v.geometric_normal);
            let shading = eight.load_vectors(&chunk.state, v.shading_normal);
            let [geometric, shading] =
                self.places.normals(eight, chunk.whereabouts(), [geometric, shading]);
            let geometric = eight.normalized_or(&geometric, &up);
            let shading = eight.normalized_or(&shading, &geometric);
            let sizes = sizes_on_rays(&origin, &direction, distance);
            let sizes = self.places.sizes_of_points(eight, chunk.whereabouts(), &sizes);
            eight.blend(surface_offsets(eight, &geometric, &sizes), &mut chunk.offset);
            let is_behind = dots(&direction, &geometric).simd_gt(0.0);
            eight.blend(is_behind.select(eight.splat(-1.0), eight.splat(1.0)), &mut chunk.side);
            eight.blend_vectors(&geometric, &mut chunk.geometric_normal);
            eight.blend_vectors(&shading, &mut chunk.shading_normal);
            if has_tangents {
                for variable in [v.dpdu, v.dpdv] {
                    let local = eight.load_vectors(&chunk.state, variable);
                    let tangents = self.places.vectors(eight, chunk.whereabouts(), &local);
                    eight.store_vectors(&mut chunk.state, variable, &tangents);
                }
            }
            let state = &mut chunk.state;
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

/// Sets how wide the rays are in surface parameters. A surface that is met at a slant is cut by an ellipse, whose area counts.
#[inline(always)]
fn set_footprints<S: Simd>(simd: S, chunk: &mut ShadingBatch) {
    let v = variables();
    for eight in eights_of(simd, chunk.count) {
        let direction = eight.vectors(&chunk.direction);
        let cosine = dots(&direction, &eight.vectors(&chunk.geometric_normal)).abs();
        let length = dots(&direction, &direction).sqrt();
        let slant = (cosine / length).max(eight.splat(MIN_COSINE)).sqrt();
        let width = eight.numbers(&chunk.width) / slant;
        for (width_of, tangent) in [(v.du, v.dpdu), (v.dv, v.dpdv)] {
            let tangents = eight.load_vectors(&chunk.state, tangent);
            let parameter = width / dots(&tangents, &tangents).sqrt();
            let is_usable = parameter.simd_lt(f32::INFINITY);
            let parameter = is_usable.select(parameter, eight.splat(0.0));
            eight.store(&mut chunk.state, width_of, parameter);
        }
    }
}

/// Surfaces that are met at a steeper slant are filtered as at this one.
const MIN_COSINE: f32 = 0.01;

/// Sets the numbers by which kernels know shapes, materials and emitters, where these differ from lane to
/// lane.
fn number(scene: &BatchScene, group: &SurfaceGroup, chunk: &mut ShadingBatch) {
    let count = chunk.count.next_multiple_of(8);
    let entry = |hit: &PathHit| &scene.objects[hit.object as usize];
    let hits = &chunk.hits[..count];
    if group.key.shape == Batching::Each {
        let class = &scene.compiled.classes[group.key.class as usize];
        let number = |hit: &PathHit| match class.has_elements() {
            true => class.number_of(hit.object, hit.element).unwrap_or(0),
            false => entry(hit).number,
        };
        set_numbers(&mut chunk.objects, hits.iter().map(number));
    }
    if group.key.material.1 == Batching::Each {
        set_numbers(&mut chunk.materials, hits.iter().map(|hit| entry(hit).material));
    }
    if let Some((_, Batching::Each)) = group.key.cut_out {
        set_numbers(&mut chunk.alpha, hits.iter().map(|hit| entry(hit).cut_out));
    }
    if let Some((_, Batching::Each)) = group.key.emitter {
        set_numbers(&mut chunk.emitters, hits.iter().map(|hit| entry(hit).emitter));
    }
}
