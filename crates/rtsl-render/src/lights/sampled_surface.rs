//! Surface properties of sampled points of area lights, such as the texture coordinates that an image on a light needs:
//! those of hits of rays towards the points.

use rtsl::SurfaceColumns;

use super::sample::LightMemory;
use crate::compiled::kernels::Batching;
use crate::integrate::path_tracer::PathTracer;
use crate::surfaces::{SurfaceCall, SurfaceKernels};

impl PathTracer<'_> {
    /// Runs the methods of shapes for sampled points, and stores their results in the state. `of` selects the shapes.
    pub(super) fn prepare_sampled_surfaces(
        &self,
        surfaces: &SurfaceKernels,
        of: Batching,
        memory: &mut LightMemory,
    ) {
        let scene = &self.scene.compiled;
        let count = memory.lanes.count();
        let LightMemory {
            hits,
            point,
            direction,
            reach,
            time,
            state,
            scratch,
            objects,
            random,
            ..
        } = memory;
        let rows = point.iter().chain(&*direction);
        let columns = [(SurfaceColumns::DISTANCE, &*reach), (SurfaceColumns::TIME, time)];
        let columns = (SurfaceColumns::ORIGIN..).zip(rows).chain(columns);
        for (column, row) in columns {
            let column = scratch.floats_mut(scene.scratch_arrays + column);
            column[..count].copy_from_slice(&row[..count]);
        }
        for (column, number) in [
            (SurfaceColumns::EPSILON, scene.epsilon),
            (SurfaceColumns::LIMIT, f32::INFINITY),
            // Light samples have no footprint.
            (SurfaceColumns::WIDTH, 0.0),
            (SurfaceColumns::SPREAD, 0.0),
        ] {
            scratch.floats_mut(scene.scratch_arrays + column)[..count].fill(number);
        }
        let shapes = scene.class(surfaces.class());
        let call = SurfaceCall {
            hits: &hits[..count],
            instances: of.instances(&shapes.objects, objects),
            state,
            scratch,
            host: random,
        };
        surfaces.call(surfaces.surface(), scene, self.errors, call);
    }
}
