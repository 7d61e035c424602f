//! Surface properties of the hits of a shading batch.

use rtsl::{Kernel, QueryColumns};
use rtsl_math::dot;

use super::shading_batch::{ShadingBatch, set_indices};
use super::wavefront::{NO_INSTANCE, PathHit};
use crate::compiled::kernels::Batching;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::surface_group::SurfaceGroup;
use crate::compiled::variables::variables;
use crate::surfaces::{SurfaceCall, SurfaceKernels};

impl SurfaceGroup {
    /// Runs the shapes' methods for a batch of hits of the group, and stores the inputs of materials and lights in the
    /// batch and its state.
    pub fn prepare_surfaces(
        &self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        batch: &mut ShadingBatch,
    ) {
        let Some(kernels) = &self.surfaces else { return };
        self.call_surfaces(kernels, kernels.surface(), scene, errors, batch);
        let ShadingBatch { count, surfaces, side, .. } = batch;
        for (lane, side) in side.iter_mut().enumerate().take(*count) {
            let direction = surfaces.vector(QueryColumns::DIRECTION, lane);
            let normal = surfaces.vector(QueryColumns::GEOMETRIC_NORMAL, lane);
            *side = if dot(direction, normal) > 0.0 { -1.0 } else { 1.0 };
        }
        if self.needs_numbers {
            store_numbers(batch);
        }
    }

    /// Computes the densities with which light samples for the points of a batch find its hits, which are of the
    /// group.
    pub fn prepare_densities(
        &self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        batch: &mut ShadingBatch,
    ) {
        let kernels = self.surfaces.as_ref();
        match kernels.and_then(|kernels| Some((kernels, kernels.density()?))) {
            Some((kernels, density)) => self.call_surfaces(kernels, density, scene, errors, batch),
            None => batch.surfaces.column_mut(QueryColumns::DENSITY).fill(0.0),
        }
    }

    /// Calls a kernel for the rays of a batch.
    fn call_surfaces(
        &self,
        kernels: &SurfaceKernels,
        kernel: &Kernel,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        batch: &mut ShadingBatch,
    ) {
        set_instance_indices(scene, self, batch);
        let class = scene.compiled.class(self.key.class);
        let call = SurfaceCall {
            hits: &batch.hits[..batch.count],
            instances: self.key.shape.instances(&class.objects, &batch.objects),
            state: &mut batch.state,
            columns: &mut batch.surfaces,
            host: &mut batch.random,
        };
        kernels.call(kernel, &scene.compiled, errors, call);
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
