//! Surface properties of sampled points of area lights, such as the texture coordinates that an image on a light needs:
//! those of hits of rays towards the points.

use fearless_simd::{Level, Simd, dispatch, f32x8};
use rtsl::host::NoHost;
use rtsl::{LaneBlock, Method};

use super::sample::LightMemory;
use crate::compiled::calls::Callee;
use crate::compiled::kernels::Batching;
use crate::compiled::object_class::ObjectClass;
use crate::compiled::surface_group::ShapeSurface;
use crate::integrate::path_tracer::PathTracer;
use crate::integrate::wavefront::PathHit;
use crate::lanes::eight::{Eight, FirstEights, eights_of};
use crate::surfaces::{
    EightRays, EightSurfaces, HitLanes, ObjectHit, SurfaceLanes, SurfaceTransforms, Surfaces,
};

impl PathTracer<'_> {
    /// Runs the methods of shapes of a traversal class for sampled points, and stores their results in the state.
    pub(super) fn prepare_sampled_surfaces(
        &self,
        (class, of): (u32, Batching),
        surface: &ShapeSurface,
        memory: &mut LightMemory,
    ) {
        let hits = memory.hits[..memory.lanes.count()].iter().map(PathHit::object_hit);
        let surfaces = Surfaces {
            transforms: SurfaceTransforms::new(&self.scene.compiled, class, hits),
            needs: surface.needs,
            shapes_read_normals: true,
            placement: surface.kernels.placement,
        };
        let class = self.scene.compiled.class(class);
        let mut lanes = SampledSurfaces { tracer: self, class, of, surface, memory };
        dispatch!(Level::new(), simd => surfaces.prepare(simd, &mut lanes));
    }
}

/// Sampled points of shapes of one traversal class.
struct SampledSurfaces<'a> {
    tracer: &'a PathTracer<'a>,
    class: &'a ObjectClass,
    of: Batching,
    surface: &'a ShapeSurface,
    memory: &'a mut LightMemory,
}

impl HitLanes for SampledSurfaces<'_> {
    #[inline(always)]
    fn hit(&self, lane: usize) -> ObjectHit {
        self.memory.hits[lane].object_hit()
    }

    #[inline(always)]
    fn time(&self, lane: usize) -> f32 {
        self.memory.time[lane]
    }
}

impl SurfaceLanes for SampledSurfaces<'_> {
    type Eights<S: Simd> = FirstEights<S>;

    #[inline(always)]
    fn eights<S: Simd>(&self, simd: S) -> FirstEights<S> {
        eights_of(simd, self.memory.lanes.count())
    }

    #[inline(always)]
    fn rays<S: Simd>(&self, eight: Eight<S>) -> EightRays<S> {
        EightRays {
            origin: eight.vectors(&self.memory.point),
            direction: eight.vectors(&self.memory.direction),
            epsilon: eight.splat(self.tracer.scene.compiled.epsilon),
            time: eight.floats(&self.memory.time),
        }
    }

    #[inline(always)]
    fn limits<S: Simd>(&self, eight: Eight<S>) -> f32x8<S> {
        eight.splat(f32::INFINITY)
    }

    #[inline(always)]
    fn distances<S: Simd>(&self, eight: Eight<S>) -> f32x8<S> {
        eight.floats(&self.memory.reach)
    }

    #[inline(always)]
    fn state(&mut self) -> &mut LaneBlock {
        &mut self.memory.state
    }

    fn scratch(&mut self) -> (&mut LaneBlock, usize) {
        let arrays = self.class.program().layout().scratch_arrays as usize;
        (&mut self.memory.scratch, arrays)
    }

    fn needs(&self, method: Method) -> bool {
        self.surface.kernels.kernel(method).is_some()
    }

    fn call(&mut self, method: Method) {
        let Some(kernel) = self.surface.kernels.kernel(method) else { return };
        let callee = Callee { class: &self.class.name, method, errors: self.tracer.errors };
        let LightMemory { lanes, state, scratch, accepted, objects, random, .. } =
            &mut *self.memory;
        let instances = self.of.instances(&self.class.objects, objects);
        let (count, blocks) = (lanes.count(), (state, scratch));
        if method == Method::Intersect {
            callee.call_for_first(kernel, count, instances, blocks, Some(accepted), &mut NoHost);
        } else {
            callee.call_for_first(kernel, count, instances, blocks, None, random);
        }
    }

    // Samples have densities already.
    #[inline(always)]
    fn keep_light_densities<S: Simd>(&mut self, _: Eight<S>, _: f32x8<S>) {}

    // The state has all that emitters read.
    #[inline(always)]
    fn keep<S: Simd>(&mut self, _: Eight<S>, _: &EightSurfaces<S>) {}
}
