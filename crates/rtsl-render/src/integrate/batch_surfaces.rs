//! Surface properties of the hits of a shading batch.

use rtsl::{Kernel, QueryColumns};
use rtsl_math::dot;

use super::path_tracer::PathTracer;
use super::rows::get;
use super::shading_batch::{ShadingBatch, set_indices};
use super::wavefront::{NO_INSTANCE, PathHit};
use crate::compiled::kernels::Batching;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::surface_group::SurfaceGroup;
use crate::compiled::variables::variables;
use crate::surfaces::{SurfaceCall, SurfaceKernels};

impl PathTracer<'_> {
    /// Runs the shapes' methods for a batch of hits of a group, and stores the inputs of materials and lights in the
    /// batch and its state.
    pub fn prepare_surfaces(&self, group: &SurfaceGroup, batch: &mut ShadingBatch) {
        let Some(surfaces) = &group.surfaces else { return };
        self.call_surfaces(group, surfaces, surfaces.surface(), batch);
        let ShadingBatch { count, kept_scratch, first_column, direction, side, .. } = batch;
        let results = batch.point.iter_mut().chain([&mut batch.offset]);
        let normals = batch.geometric_normal.iter_mut().chain(&mut batch.shading_normal);
        for (column, row) in (*first_column + QueryColumns::POINT..).zip(results.chain(normals)) {
            row[..*count].copy_from_slice(&kept_scratch.floats(column)[..*count]);
        }
        for lane in 0..*count {
            let is_behind = dot(get(direction, lane), get(&batch.geometric_normal, lane)) > 0.0;
            side[lane] = if is_behind { -1.0 } else { 1.0 };
        }
        if group.needs_numbers {
            store_numbers(batch);
        }
    }

    /// Computes the densities with which light samples for the points of a batch find its hits, which are of a group.
    pub fn prepare_densities(&self, group: &SurfaceGroup, batch: &mut ShadingBatch) {
        let Some(surfaces) = &group.surfaces else { return };
        let Some(kernel) = surfaces.density() else { return batch.light_density.fill(0.0) };
        self.call_surfaces(group, surfaces, kernel, batch);
        let ShadingBatch { count, kept_scratch, first_column, light_density, .. } = batch;
        let densities = kept_scratch.floats(*first_column + QueryColumns::DENSITY);
        light_density[..*count].copy_from_slice(&densities[..*count]);
    }

    /// Calls a kernel for the rays of a batch.
    fn call_surfaces(
        &self,
        group: &SurfaceGroup,
        surfaces: &SurfaceKernels,
        kernel: &Kernel,
        batch: &mut ShadingBatch,
    ) {
        set_instance_indices(self.scene, group, batch);
        let ShadingBatch { count, hits, state, kept_scratch, first_column, .. } = batch;
        let rays = batch.origin.iter().chain(&batch.direction);
        let limits = [&batch.epsilon, &batch.distance, &batch.limit];
        let limits = limits.into_iter().chain([&batch.time, &batch.width, &batch.spread]);
        let points = (*first_column + QueryColumns::POINT..).zip(&batch.point);
        for (column, row) in (*first_column..).zip(rays.chain(limits)).chain(points) {
            kept_scratch.floats_mut(column)[..*count].copy_from_slice(&row[..*count]);
        }
        let class = self.scene.compiled.class(group.key.class);
        let call = SurfaceCall {
            hits: &hits[..*count],
            instances: group.key.shape.instances(&class.objects, &batch.objects),
            state,
            scratch: kept_scratch,
            host: &mut batch.random,
        };
        surfaces.call(kernel, &self.scene.compiled, self.errors, call);
    }
}

/// Stores the indices of what the rays hit.
fn store_numbers(batch: &mut ShadingBatch) {
    let v = variables();
    for (lane, hit) in batch.hits[..batch.count].iter().enumerate() {
        let PathHit { object, element, instance, .. } = *hit;
        let instance = if instance == NO_INSTANCE { -1.0 } else { instance as f32 };
        batch.state.floats_mut(v.object_number)[lane] = object as f32;
        batch.state.floats_mut(v.instance_number)[lane] = instance;
        batch.state.floats_mut(v.element_number)[lane] = element as f32;
    }
}

/// Sets the indices of shapes, materials and emitters, if they vary between lanes.
fn set_instance_indices(scene: &RenderScene, group: &SurfaceGroup, batch: &mut ShadingBatch) {
    let count = batch.count;
    let entry = |hit: &PathHit| &scene.objects[hit.object as usize];
    let hits = &batch.hits[..count];
    if group.key.shape == Batching::Each {
        let class = scene.compiled.class(group.key.class);
        let index = |hit: &PathHit| match class.has_elements() {
            true => class.index_of(hit.object, hit.element).unwrap_or(0),
            false => entry(hit).index,
        };
        set_indices(&mut batch.objects, hits.iter().map(index));
    }
    if group.key.material.1 == Batching::Each {
        set_indices(&mut batch.materials, hits.iter().map(|hit| entry(hit).material));
    }
    if let Some((_, Batching::Each)) = group.key.alpha {
        set_indices(&mut batch.alpha, hits.iter().map(|hit| entry(hit).alpha));
    }
    if let Some((_, Batching::Each)) = group.key.emitter {
        set_indices(&mut batch.emitters, hits.iter().map(|hit| entry(hit).emitter));
    }
}
