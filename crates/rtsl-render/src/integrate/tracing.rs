//! Calls of an integrator for the rays of a wavefront.

use std::cell::RefCell;

use rtsl::{CallArguments, Instances, LaneBlock, Method, RayType, new_state};
use rtsl_bvh::LANES;

use super::following::{FollowedPaths, MAX_WAITING};
use super::host::{RayOfCall, SceneHost};
use super::memory::ThreadMemory;
use super::output_columns::copy_outputs;
use super::path_tracer::PathTracer;
use super::rows::{all_finite, are_finite};
use super::staged::{Frames, PathSet, StagedMethod, StagedPaths, Wave, ray_components};
use super::suspect::Suspect;
use super::waiting_paths::WaitingPaths;
use super::wavefront::{Path, Wavefront};
use crate::compiled::calls::Callee;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::variables::{variables, vector};
use crate::film::features::{FeatureValues, FirstHit};
use crate::schedule::tile_samples::{TileSamples, packets_of};
use crate::statistics::RayCounts;

/// The number of rays of a call.
pub(super) const RAYS_OF_CALL: usize = 64;

/// The greatest depth of rays that `trace` traces: each level takes a level of the thread's stack.
pub const MAX_DEPTH: u32 = 64;

/// The memory of one thread for an integrator, for one level of recursion.
pub struct IntegratorMemory {
    /// The memory of stages, if the integrator runs as stages.
    stages: Option<StageMemory>,
    /// The inputs and outputs of a call.
    pub(super) state: LaneBlock,
    scratch: LaneBlock,
    /// The rays of the call.
    pub(super) rays: Vec<RayOfCall>,
    /// The memory of queries, which are about one ray.
    pub(crate) queries: Box<ThreadMemory>,
    /// The memory of further levels, when they are not in use.
    pub(super) free: RefCell<Vec<IntegratorMemory>>,
    /// Memory for paths that wait.
    spare: Vec<WaitingPaths>,
    /// Memory for those that run.
    pub(super) followed: FollowedPaths,
}

/// The memory of stages.
struct StageMemory {
    frames: Frames,
    wave: Wave,
}

impl IntegratorMemory {
    /// Returns the numbers of rays traced since the last call.
    pub fn take_ray_counts(&mut self) -> RayCounts {
        std::mem::take(&mut self.queries.rays)
    }

    /// Allocates the memory for a scene.
    pub fn new(scene: &RenderScene) -> Self {
        let integrator = &scene.integrator;
        let stages = integrator.staged.as_ref().map(|staged| StageMemory {
            frames: Frames::new(scene.block_sizes(staged)),
            wave: Wave::default(),
        });
        IntegratorMemory {
            stages,
            state: new_state(RAYS_OF_CALL),
            scratch: integrator.program.new_scratch(RAYS_OF_CALL),
            rays: Vec::new(),
            queries: Box::new(ThreadMemory::for_queries(scene)),
            free: RefCell::default(),
            spare: Vec::new(),
            followed: FollowedPaths::default(),
        }
    }

    /// Returns memory for paths that wait, without any.
    pub(super) fn new_waiting(&mut self) -> WaitingPaths {
        self.spare.pop().unwrap_or_default()
    }

    /// Keeps memory for paths that wait, unless it is for far more than usual.
    pub(super) fn keep_waiting<const N: usize>(&mut self, used: [WaitingPaths; N]) {
        for mut waiting in used.into_iter().filter(|it| it.capacity() <= MAX_WAITING) {
            waiting.clear();
            self.spare.push(waiting);
        }
    }
}

impl PathTracer<'_> {
    /// Computes the radiance of a wavefront's active paths, whose rays have this depth.
    pub fn integrate(
        &self,
        wavefront: &mut Wavefront,
        memory: &mut IntegratorMemory,
        depth: u32,
    ) -> RayCounts {
        let Wavefront { paths, active, features, .. } = wavefront;
        let mut counts = RayCounts::default();
        for active in active.chunks(RAYS_OF_CALL) {
            if self.errors.any() {
                break;
            }
            counts += self.call_integrator(active, paths, memory, depth);
            for (lane, index) in active.iter().enumerate() {
                let IntegratorMemory { state, rays, .. } = &*memory;
                let path = &mut paths[*index as usize];
                self.add_radiance(path, state, &rays[lane], lane);
            }
            self.keep_features(active, memory, features);
            for lane in memory.queries.spawned.lost_parents(0) {
                self.report_suspect(memory.rays[lane as usize].suspect);
            }
            self.follow(memory, active.len(), &mut |lanes, radiance| {
                for (channel, column) in radiance.iter().enumerate() {
                    for (lane, light) in lanes.iter().zip(column) {
                        paths[active[*lane as usize] as usize].radiance[channel] += light;
                    }
                }
            });
            counts += memory.take_ray_counts();
        }
        active.clear();
        counts
    }

    /// Copies the features of a call for these paths to those of all paths, as far as they are kept.
    fn keep_features(
        &self,
        active: &[u32],
        memory: &IntegratorMemory,
        FeatureValues { first_hits, outputs }: &mut FeatureValues,
    ) {
        let lanes = active.iter().enumerate().map(|(lane, index)| (lane, *index as usize));
        // Paths of further rays have no features.
        if !first_hits.is_empty() {
            for (lane, index) in lanes.clone() {
                first_hits[index] = FirstHit::from(memory.rays[lane].first_hit);
            }
        }
        if !outputs.is_empty() {
            let columns = self.scene.integrator.outputs.iter().copied();
            copy_outputs(columns, &memory.scratch, lanes, outputs);
        }
    }

    /// Begins a number of paths of this depth on the stages of the integrator; they have no rays yet.
    pub(super) fn begin_stages<'a>(
        &self,
        staged: &'a StagedMethod,
        exhausted: &'a RuntimeErrors,
        memory: &'a mut IntegratorMemory,
        count: usize,
        depth: u32,
    ) -> Option<StagedPaths<'a>>
    where
        Self: 'a,
    {
        let IntegratorMemory { stages, queries, free, .. } = memory;
        let StageMemory { frames, wave } = stages.as_mut()?;
        frames.make_room(count);
        wave.begin(frames, staged, count, depth, self.keeps_first_hits());
        let (tracer, are_together) = (*self, depth == 0);
        Some(StagedPaths {
            tracer,
            exhausted,
            staged,
            frames,
            wave,
            queries,
            free,
            depth,
            are_together,
        })
    }

    /// Computes the radiance along the rays of paths that other paths have spawned.
    pub(super) fn integrate_further(
        &self,
        paths: &[Path],
        memory: &mut IntegratorMemory,
        depth: u32,
        radiance: &mut [[f32; 3]],
    ) -> RayCounts {
        if let Some(staged) = &self.scene.integrator.staged {
            return self.run_stages(staged, paths, memory, depth, radiance);
        }
        let mut wavefront = Wavefront::default();
        wavefront.paths.extend_from_slice(paths);
        wavefront.active.extend(0..paths.len() as u32);
        let counts = self.integrate(&mut wavefront, memory, depth);
        radiance.iter_mut().zip(&wavefront.paths).for_each(|(to, path)| *to = path.radiance);
        counts
    }

    /// Runs the stages of the integrator for paths.
    fn run_stages(
        &self,
        staged: &StagedMethod,
        paths: &[Path],
        memory: &mut IntegratorMemory,
        depth: u32,
        radiance: &mut [[f32; 3]],
    ) -> RayCounts {
        let load = |run: &mut StagedPaths<'_>| {
            run.wave.load_paths(run.frames, &staged.columns, paths);
        };
        self.run_loaded(staged, load, memory, depth, radiance)
    }

    /// Runs the stages of the integrator for as many paths as there is `radiance`, which `load` loads.
    pub(super) fn run_loaded(
        &self,
        staged: &StagedMethod,
        load: impl FnOnce(&mut StagedPaths<'_>),
        memory: &mut IntegratorMemory,
        depth: u32,
        radiance: &mut [[f32; 3]],
    ) -> RayCounts {
        let exhausted = RuntimeErrors::default();
        let begun = self.begin_stages(staged, &exhausted, memory, radiance.len(), depth);
        let Some(mut run) = begun else { return RayCounts::default() };
        run.wave.begin_weights(run.frames, &staged.columns);
        load(&mut run);
        run.begin_rays();
        let all = PathSet::all(radiance.len());
        run.run(&all);
        run.radiance(radiance);
        let spawned = std::mem::take(&mut run.queries.spawned);
        if exhausted.any() {
            let paths: Vec<Path> = run.paths(all.paths().iter().copied()).collect();
            self.report_exhausted(&paths, depth, memory);
            return memory.take_ray_counts();
        }
        let is_lost = |path: &u32| !are_finite(&radiance[*path as usize]);
        let lost = all.paths().iter().copied().filter(is_lost);
        let lost: Vec<Path> = match all_finite(radiance.as_flattened()) {
            true => run.paths(spawned.lost_parents(0).into_iter()).collect(),
            false => run.paths(lost.chain(spawned.lost_parents(0))).collect(),
        };
        lost.iter().for_each(|path| self.report_cause(path, depth, memory));
        memory.queries.spawned = spawned;
        self.follow(memory, radiance.len(), &mut |paths, light| {
            for (channel, column) in light.iter().enumerate() {
                for (path, light) in paths.iter().zip(column) {
                    radiance[*path as usize][channel] += light;
                }
            }
        });
        memory.take_ray_counts()
    }

    /// True if rays of this depth are traced.
    pub fn is_traced_at(&self, depth: u32) -> bool {
        depth <= MAX_DEPTH.min(self.scene.compiled.settings.max_depth)
    }

    /// Runs the stages of the integrator for the camera rays of samples, and leaves the results in the memory.
    pub fn run_stages_for_samples(
        &self,
        staged: &StagedMethod,
        memory: &mut ThreadMemory,
        samples: &[TileSamples],
    ) {
        let ThreadMemory { integrator: own, samples: results, rays: counts, lane_use, .. } = memory;
        let Some(own) = own else { return };
        let count = packets_of(samples).count() * LANES;
        let exhausted = RuntimeErrors::default();
        let begun = self.begin_stages(staged, &exhausted, own, count, 0);
        let Some(mut run) = begun else { return };
        let active = run.load_samples(samples);
        run.begin_rays();
        counts.camera += active.len() as u64;
        run.run(&active);
        let spawned = std::mem::take(&mut run.queries.spawned);
        *lane_use += std::mem::take(&mut run.queries.lane_use);
        if exhausted.any() {
            let all: Vec<Path> = run.paths(active.paths().iter().copied()).collect();
            *counts += own.take_ray_counts();
            return self.report_exhausted(&all, 0, own);
        }
        let scratch = &run.frames.paths.scratch;
        run.radiance_of(&active, &mut results.radiance);
        let paths = || active.paths().iter().map(|path| *path as usize);
        let FeatureValues { first_hits, outputs } = &mut results.features;
        if !first_hits.is_empty() {
            let hits = paths().map(|path| (path, run.wave.first_hits[path]));
            hits.for_each(|(path, hit)| first_hits[path] = FirstHit::from(hit));
        }
        if !outputs.is_empty() {
            let columns = self.scene.integrator.outputs.iter();
            let columns = columns.map(|column| column.in_stages(staged));
            copy_outputs(columns, scratch, paths().map(|path| (path, path)), outputs);
        }
        let lost = run.lost(&active, &results.radiance);
        let lost: Vec<Path> = run.paths(lost.chain(spawned.lost_parents(0))).collect();
        lost.iter().for_each(|path| self.report_cause(path, 0, own));
        own.queries.spawned = spawned;
        let channels = &mut results.radiance;
        self.follow(own, count, &mut |paths, light| {
            for (channel, column) in channels.iter_mut().zip(light) {
                for (path, light) in paths.iter().zip(column) {
                    channel[*path as usize] += light;
                }
            }
        });
        *counts += own.take_ray_counts();
        *lane_use += std::mem::take(&mut own.queries.lane_use);
    }

    /// Evaluates a path on the interpreter, and returns the first method whose values are not finite.
    pub fn interpret(
        &self,
        path: &Path,
        depth: u32,
        memory: &mut IntegratorMemory,
    ) -> Option<Suspect> {
        self.call_integrator(&[0], std::slice::from_ref(path), memory, depth);
        memory.queries.spawned.clear();
        memory.rays.first()?.suspect
    }

    /// Calls `radiance` for the rays of some paths.
    pub(super) fn call_integrator(
        &self,
        active: &[u32],
        paths: &[Path],
        memory: &mut IntegratorMemory,
        depth: u32,
    ) -> RayCounts {
        let integrator = &self.scene.integrator;
        let IntegratorMemory { state, scratch, rays, queries, free, .. } = memory;
        rays.clear();
        for (lane, index) in active.iter().enumerate() {
            let path = &paths[*index as usize];
            set_ray(state, lane, path, depth);
            rays.push(RayOfCall::of_path(path));
        }
        let callee =
            Callee { class: integrator.name(), method: Method::Radiance, errors: self.errors };
        let slots = None;
        let (tracer, notes_suspects) = (*self, true);
        let is_of_stages = false;
        let mut host =
            SceneHost { tracer, rays, slots, queries, free, depth, notes_suspects, is_of_stages };
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
    pub(super) fn add_radiance(
        &self,
        path: &mut Path,
        state: &LaneBlock,
        ray: &RayOfCall,
        lane: usize,
    ) {
        let color = vector(state, variables().sample_color, lane);
        let lit = ray.lit;
        for channel in 0..3 {
            path.radiance[channel] += path.throughput[channel] * (color[channel] + lit[channel]);
        }
        if !are_finite(&path.radiance) && !path.is_blamed {
            path.is_blamed = true;
            self.report_suspect(ray.suspect);
        }
    }
}

/// Sets the inputs of `radiance` for a lane.
fn set_ray(state: &mut LaneBlock, lane: usize, path: &Path, depth: u32) {
    for (component, value, _) in ray_components() {
        state.floats_mut(component)[lane] = value(path);
    }
    state.floats_mut(variables().ray_depth)[lane] = depth as f32;
    state.floats_mut(variables().ray_type)[lane] = RayType::of(depth, 0).value();
}
