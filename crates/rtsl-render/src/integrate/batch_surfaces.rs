//! Surface properties of the hits of a shading batch.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};
use rtsl::host::NoHost;
use rtsl::{Kernel, LaneBlock, Method};
use rtsl_math::MIN_FOOTPRINT_COSINE;

use super::path_tracer::PathTracer;
use super::shading_batch::{ShadingBatch, set_indices};
use super::wavefront::PathHit;
use crate::compiled::calls::Callee;
use crate::compiled::kernels::Batching;
use crate::compiled::object_class::ObjectClass;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::surface_group::SurfaceGroup;
use crate::compiled::variables::variables;
use crate::lanes::eight::{Eight, FirstEights, dots, eights_of};
use crate::surfaces::{
    EightRays, EightSurfaces, HitLanes, ObjectHit, SurfaceLanes, SurfaceTransforms, Surfaces,
};

impl PathTracer<'_> {
    /// Runs the shapes' methods for a batch of hits of a group, and stores the inputs of materials and lights in the
    /// batch and its state.
    pub fn prepare_surfaces(&self, group: &SurfaceGroup, batch: &mut ShadingBatch) {
        set_instance_indices(self.scene, group, batch);
        let hits = batch.hits().iter().map(PathHit::object_hit);
        let surfaces = Surfaces {
            transforms: SurfaceTransforms::new(&self.scene.compiled, group.key.class, hits),
            needs: group.needs,
            shapes_read_normals: group.shapes_read_normals,
            placement: group.shape.placement,
        };
        let mut lanes = BatchSurfaces { tracer: self, group, batch };
        dispatch!(Level::new(), simd => {
            surfaces.prepare(simd, &mut lanes);
            if group.needs.footprints {
                set_footprints(simd, lanes.batch);
            }
        });
    }
}

/// A batch of hits of a group.
struct BatchSurfaces<'a> {
    tracer: &'a PathTracer<'a>,
    group: &'a SurfaceGroup,
    batch: &'a mut ShadingBatch,
}

impl<'a> BatchSurfaces<'a> {
    fn class(&self) -> &'a ObjectClass {
        self.tracer.scene.compiled.class(self.group.key.class)
    }

    fn kernel(&self, method: Method) -> Option<&'a Kernel> {
        self.group.shape.kernel(method)
    }
}

impl HitLanes for BatchSurfaces<'_> {
    #[inline(always)]
    fn hit(&self, lane: usize) -> ObjectHit {
        self.batch.hits[lane].object_hit()
    }

    #[inline(always)]
    fn time(&self, lane: usize) -> f32 {
        self.batch.time[lane]
    }
}

impl SurfaceLanes for BatchSurfaces<'_> {
    type Eights<S: Simd> = FirstEights<S>;

    #[inline(always)]
    fn eights<S: Simd>(&self, simd: S) -> FirstEights<S> {
        eights_of(simd, self.batch.count)
    }

    #[inline(always)]
    fn rays<S: Simd>(&self, eight: Eight<S>) -> EightRays<S> {
        EightRays {
            origin: eight.vectors(&self.batch.origin),
            direction: eight.vectors(&self.batch.direction),
            epsilon: eight.floats(&self.batch.epsilon),
            time: eight.floats(&self.batch.time),
        }
    }

    #[inline(always)]
    fn limits<S: Simd>(&self, eight: Eight<S>) -> f32x8<S> {
        eight.floats(&self.batch.limit)
    }

    #[inline(always)]
    fn distances<S: Simd>(&self, eight: Eight<S>) -> f32x8<S> {
        eight.floats(&self.batch.distance)
    }

    #[inline(always)]
    fn state(&mut self) -> &mut LaneBlock {
        &mut self.batch.state
    }

    fn scratch(&mut self) -> (&mut LaneBlock, usize) {
        let arrays = self.class().program().layout().scratch_arrays as usize;
        (&mut self.batch.kept_scratch, arrays)
    }

    fn needs(&self, method: Method) -> bool {
        self.kernel(method).is_some()
    }

    fn call(&mut self, method: Method) {
        let Some(kernel) = self.kernel(method) else { return };
        let class = self.class();
        let callee = Callee { class: &class.name, method, errors: self.tracer.errors };
        let ShadingBatch { count, state, kept_scratch, accepted, objects, random, .. } =
            &mut *self.batch;
        let instances = self.group.key.shape.instances(&class.objects, objects);
        let blocks = (state, kept_scratch);
        if method == Method::Intersect {
            let accepted = Some(accepted);
            callee.call_for_first(kernel, *count, instances, blocks, accepted, &mut NoHost);
        } else {
            callee.call_for_first(kernel, *count, instances, blocks, None, random);
        }
    }

    #[inline(always)]
    fn keep_light_densities<S: Simd>(&mut self, eight: Eight<S>, densities: f32x8<S>) {
        eight.put(densities, &mut self.batch.light_density);
    }

    #[inline(always)]
    fn keep<S: Simd>(&mut self, eight: Eight<S>, surfaces: &EightSurfaces<S>) {
        let EightSurfaces { direction, point, offset, geometric_normal, shading_normal } = surfaces;
        let batch = &mut *self.batch;
        eight.put_vectors(point, &mut batch.point);
        eight.put(*offset, &mut batch.offset);
        let is_behind = dots(direction, geometric_normal).simd_gt(0.0);
        eight.put(is_behind.select(eight.splat(-1.0), eight.splat(1.0)), &mut batch.side);
        eight.put_vectors(geometric_normal, &mut batch.geometric_normal);
        eight.put_vectors(shading_normal, &mut batch.shading_normal);
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
        let slant = (cosine / length).max(eight.splat(MIN_FOOTPRINT_COSINE)).sqrt();
        let width = eight.floats(&batch.width) / slant;
        for (width_of, tangent) in [(v.du, v.dpdu), (v.dv, v.dpdv)] {
            let tangents = eight.load_vectors(&batch.state, tangent);
            let parameter = width / dots(&tangents, &tangents).sqrt();
            let is_usable = parameter.simd_lt(f32::INFINITY);
            let parameter = is_usable.select(parameter, eight.splat(0.0));
            eight.store(&mut batch.state, width_of, parameter);
        }
    }
}

/// Sets the indices of shapes, materials and emitters, if they vary between lanes.
fn set_instance_indices(scene: &RenderScene, group: &SurfaceGroup, batch: &mut ShadingBatch) {
    let count = batch.count.next_multiple_of(8);
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
