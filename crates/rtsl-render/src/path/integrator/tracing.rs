//! Calls of an integrator for the rays of a wavefront.

use std::cell::RefCell;

use rtsl::{CallArguments, Instances, LaneBlock, Method, new_state};

use super::super::features::PathFeatures;
use super::super::memory::BatchMemory;
use super::super::path_tracer::PathTracer;
use super::super::rows::are_finite;
use super::super::scene::BatchScene;
use super::super::wavefront::{Path, Wavefront};
use super::Integrator;
use super::host::{RayOfCall, SceneHost};
use super::staged::{Blocks, Frames, StagedIntegrator, StagedPaths};
use crate::compiled::calls::Callee;
use crate::compiled::variables::{variables, vector};
use crate::statistics::RayCounts;

/// The number of rays of a call.
const RAYS_OF_CALL: usize = 64;

/// The greatest depth of rays that `trace` traces: each level takes a level of the thread's stack.
pub const MAX_DEPTH: u32 = 64;

/// The memory of one thread for an integrator, for one level of recursion.
pub struct IntegratorMemory {
    /// The frames of paths, if the integrator runs as stages.
    frames: Option<Frames>,
    /// The inputs and outputs of a call.
    state: LaneBlock,
    scratch: LaneBlock,
    /// The rays of the call.
    rays: Vec<RayOfCall>,
    /// The memory of queries, which are about one ray.
    queries: Box<BatchMemory>,
    /// The memory of further levels, when they are not in use.
    free: RefCell<Vec<IntegratorMemory>>,
}

impl IntegratorMemory {
    /// Allocates the memory for a scene.
    pub fn new(scene: &BatchScene, integrator: &Integrator) -> Self {
        let frames = integrator.staged.as_ref().map(|staged| Frames::new(&staged.program));
        IntegratorMemory {
            frames,
            state: new_state(RAYS_OF_CALL),
            scratch: integrator.program.new_scratch(RAYS_OF_CALL),
            rays: Vec::new(),
            queries: Box::new(BatchMemory::for_queries(scene)),
            free: RefCell::default(),
        }
    }
}

impl PathTracer<'_> {
    /// Computes the radiance of a wavefront's active paths, whose rays have this depth.
    pub fn integrate(
        &self,
        integrator: &Integrator,
        wavefront: &mut Wavefront,
        memory: &mut IntegratorMemory,
        depth: u32,
    ) -> RayCounts {
        if let Some(staged) = &integrator.staged {
            return self.run_stages(integrator, staged, wavefront, memory, depth);
        }
        let Wavefront { paths, active, features, .. } = wavefront;
        let mut counts = RayCounts::default();
        for active in active.chunks(RAYS_OF_CALL) {
            if self.errors.any() {
                break;
            }
            counts += self.call_integrator(integrator, (active, &*paths), memory, depth);
            for (lane, index) in active.iter().enumerate() {
                let IntegratorMemory { state, scratch, rays, .. } = &*memory;
                let path = &mut paths[*index as usize];
                self.add_radiance(integrator, path, state, (&rays[lane], lane));
                if let Some(features) = features.get_mut(*index as usize) {
                    *features = features_of(integrator, scratch, (&rays[lane], lane));
                }
            }
        }
        active.clear();
        counts
    }

    /// Runs the stages of an integrator for a wavefront's active paths.
    fn run_stages(
        &self,
        integrator: &Integrator,
        staged: &StagedIntegrator,
        wavefront: &mut Wavefront,
        memory: &mut IntegratorMemory,
        depth: u32,
    ) -> RayCounts {
        let Wavefront { paths, active, features, .. } = wavefront;
        let IntegratorMemory { frames: Some(frames), rays, queries, free, .. } = memory else {
            return RayCounts::default();
        };
        frames.make_room(&staged.program, active.len());
        let mut run = StagedPaths {
            tracer: *self,
            integrator,
            staged,
            frames,
            rays,
            queries,
            free,
            depth,
            are_together: depth == 0,
        };
        run.run(paths, active);
        let Blocks { state, scratch } = &frames.paths;
        for (slot, index) in active.iter().enumerate() {
            let path = &mut paths[*index as usize];
            self.add_radiance(integrator, path, state, (&rays[slot], slot));
            if let Some(features) = features.get_mut(*index as usize) {
                *features = features_of(integrator, scratch, (&rays[slot], slot));
            }
        }
        active.clear();
        std::mem::take(&mut queries.rays)
    }

    /// Calls `radiance` for the rays of some paths.
    fn call_integrator(
        &self,
        integrator: &Integrator,
        (active, paths): (&[u32], &[Path]),
        memory: &mut IntegratorMemory,
        depth: u32,
    ) -> RayCounts {
        let IntegratorMemory { state, scratch, rays, queries, free, .. } = memory;
        rays.clear();
        for (lane, index) in active.iter().enumerate() {
            let path = &paths[*index as usize];
            set_ray(state, lane, path, depth);
            rays.push(RayOfCall::new(path));
        }
        let callee =
            Callee { class: integrator.name(), method: Method::Radiance, errors: self.errors };
        let slots = None;
        let mut host = SceneHost { tracer: *self, integrator, rays, slots, queries, free, depth };
        callee.call(
            &integrator.kernel,
            CallArguments {
                state,
                scratch,
                count: active.len(),
                mask: None,
                accepted: None,
                instances: Instances::One(&integrator.block),
                host: &mut host,
            },
        );
        host.add_contributions();
        std::mem::take(&mut queries.rays)
    }

    /// Adds the radiance of a lane to its path.
    fn add_radiance(
        &self,
        integrator: &Integrator,
        path: &mut Path,
        state: &LaneBlock,
        (ray, lane): (&RayOfCall, usize),
    ) {
        let color = vector(state, variables().sample_color, lane);
        let lit = ray.lit;
        for channel in 0..3 {
            path.radiance[channel] += path.throughput[channel] * (color[channel] + lit[channel]);
        }
        if !are_finite(&path.radiance) && !path.is_blamed {
            path.is_blamed = true;
            self.report_lost(integrator.name(), Method::Radiance, 1);
        }
    }
}

/// Returns the features of a lane's first surface.
fn features_of(
    integrator: &Integrator,
    scratch: &LaneBlock,
    (ray, lane): (&RayOfCall, usize),
) -> PathFeatures {
    let output =
        |first: Option<usize>| first.map_or([0.0; 3], |first| vector(scratch, first, lane));
    let (distance, object) = ray.first_hit.unwrap_or((f32::INFINITY, -1.0));
    PathFeatures {
        albedo: output(integrator.features.albedo),
        normal: output(integrator.features.normal),
        distance,
        object,
    }
}

/// Sets the inputs of `radiance` for a lane.
fn set_ray(state: &mut LaneBlock, lane: usize, path: &Path, depth: u32) {
    for (component, value) in ray_components() {
        state.floats_mut(component)[lane] = value(path);
    }
    state.floats_mut(variables().ray_depth)[lane] = depth as f32;
}

/// A component of state, and its value for a path's ray.
pub type RayComponent = (usize, fn(&Path) -> f32);

/// Returns the components of state with a path's ray.
pub fn ray_components() -> [RayComponent; 11] {
    let v = variables();
    [
        (v.ray_origin, |path| path.origin[0]),
        (v.ray_origin + 1, |path| path.origin[1]),
        (v.ray_origin + 2, |path| path.origin[2]),
        (v.ray_direction, |path| path.direction[0]),
        (v.ray_direction + 1, |path| path.direction[1]),
        (v.ray_direction + 2, |path| path.direction[2]),
        (v.epsilon, |path| path.epsilon),
        (v.hit_distance, |path| path.limit),
        (v.time_seed, |path| path.time),
        (v.ray_width, |path| path.width),
        (v.ray_spread, |path| path.spread),
    ]
}
