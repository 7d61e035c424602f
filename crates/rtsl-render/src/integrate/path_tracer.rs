//! The tracing of paths by the integrator of a scene.

use rtsl::{Instances, LaneBlock, Method, RayType};
use rtsl_bvh::LANES;

use super::following::follow;
use super::host::{RayOfCall, SceneHost};
use super::integrator_memory::{IntegratorMemory, RAYS_OF_CALL, StageMemory};
use super::memory::ThreadMemory;
use super::output_columns::copy_outputs;
use super::rows::{all_finite, are_finite};
use super::staged::{PathSet, StagedMethod, StagedPaths, ray_components};
use super::suspect::{Suspect, report_suspect};
use super::wavefront::{Path, Wavefront};
use crate::compiled::calls::Callee;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::surface_group::SurfaceGroup;
use crate::compiled::variables::variables;
use crate::film::features::{FeatureValues, Features, FirstHit};
use crate::schedule::tile_samples::{TileSamples, packets_of};
use crate::statistics::RayCounts;

/// The integrator of a scene at work. Everything that may trace further paths has it, since their radiance is computed
/// by the integrator again. Paths with radiance that is not finite are traced a second time, by another tracer.
#[derive(Clone, Copy)]
pub struct PathTracer<'a> {
    /// The scene.
    pub scene: &'a RenderScene,
    /// Its surface groups, with the kernels for the queries that are asked.
    pub groups: &'a [SurfaceGroup],
    /// The record of runtime errors.
    pub errors: &'a RuntimeErrors,
    /// True if the causes of radiance that is not finite are reported.
    pub finds_causes: bool,
}

impl<'t> PathTracer<'t> {
    /// Creates the tracer of paths that are traced for the first time.
    pub fn new(scene: &'t RenderScene, errors: &'t RuntimeErrors) -> Self {
        PathTracer { scene, groups: &scene.groups, errors, finds_causes: true }
    }

    /// Traces a path for each sample of some tiles, and leaves the results in the memory, with these features.
    pub fn trace_samples(
        &self,
        memory: &mut ThreadMemory,
        samples: &[TileSamples],
        features: Option<&Features>,
    ) {
        memory.samples.reset(packets_of(samples).count() * LANES, features);
        match &self.scene.integrator.staged {
            Some(staged) => self.run_stages_for_samples(staged, memory, samples),
            None => self.interpret_samples(memory, samples, features),
        }
    }

    /// The same without machine code: the integrator runs on the interpreter.
    fn interpret_samples(
        &self,
        memory: &mut ThreadMemory,
        samples: &[TileSamples],
        features: Option<&Features>,
    ) {
        memory.begin_samples(self.scene, self.errors, samples);
        let ThreadMemory { wavefront, integrator, rays, samples, .. } = memory;
        wavefront.features.reset(wavefront.paths.len(), features);
        if let Some(integrator) = integrator {
            *rays += self.integrate(wavefront, integrator, 0);
        }
        for (channel, to) in samples.radiance.iter_mut().enumerate() {
            let paths = to.iter_mut().zip(&wavefront.paths);
            paths.for_each(|(to, path)| *to = path.radiance[channel]);
        }
        std::mem::swap(&mut samples.features, &mut wavefront.features);
    }

    /// Reports the cause of a path's radiance that is not finite.
    #[cold]
    pub fn report_cause(&self, path: &Path, depth: u32, memory: &mut IntegratorMemory) {
        if self.finds_causes && self.errors.may_find_cause() {
            // What the second evaluation calls was reported by the first.
            let errors = RuntimeErrors::default();
            let suspect = self.again(&errors).interpret(path, depth, memory);
            report_suspect(self.scene, self.errors, suspect);
        }
    }

    /// Reports the method that exceeds its loop budget in one of these paths: the integrator's if no other is found.
    #[cold]
    pub fn report_exhausted(&self, paths: &[Path], depth: u32, memory: &mut IntegratorMemory) {
        let again = self.again(self.errors);
        for path in paths {
            if self.errors.any() {
                return;
            }
            again.interpret(path, depth, memory);
        }
        if !self.errors.any() {
            self.errors.report(self.scene.integrator.name(), Method::Radiance);
        }
    }

    /// Computes the radiance of a wavefront's active paths, whose rays have this depth.
    fn integrate(
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
                memory.add_radiance(self.scene, self.errors, lane, &mut paths[*index as usize]);
            }
            memory.keep_features(&self.scene.integrator, active, features);
            for lane in memory.queries.spawned.lost_parents(0) {
                report_suspect(self.scene, self.errors, memory.rays[lane as usize].suspect);
            }
            follow(self, memory, active.len(), &mut |lanes, radiance| {
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

    /// Computes the radiance along the rays of paths that other paths have spawned.
    pub(super) fn integrate_further(
        &self,
        paths: &[Path],
        memory: &mut IntegratorMemory,
        depth: u32,
        radiance: &mut [[f32; 3]],
    ) -> RayCounts {
        if let Some(staged) = &self.scene.integrator.staged {
            let load = |run: &mut StagedPaths<'_>| {
                run.wave.load_paths(run.frames, &staged.columns, paths);
            };
            return self.run_loaded(staged, load, memory, depth, radiance);
        }
        let mut wavefront = Wavefront::default();
        wavefront.paths.extend_from_slice(paths);
        wavefront.active.extend(0..paths.len() as u32);
        let counts = self.integrate(&mut wavefront, memory, depth);
        radiance.iter_mut().zip(&wavefront.paths).for_each(|(to, path)| *to = path.radiance);
        counts
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
        wave.begin(frames, staged, count, depth);
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
        follow(self, memory, radiance.len(), &mut |paths, light| {
            for (channel, column) in light.iter().enumerate() {
                for (path, light) in paths.iter().zip(column) {
                    radiance[*path as usize][channel] += light;
                }
            }
        });
        memory.take_ray_counts()
    }

    /// Runs the stages of the integrator for the camera rays of samples, and leaves the results in the memory.
    fn run_stages_for_samples(
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
        if !results.features.first_hits.is_empty() {
            run.wave.keep_first_hits();
        }
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
        follow(self, own, count, &mut |paths, light| {
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
    fn interpret(&self, path: &Path, depth: u32, memory: &mut IntegratorMemory) -> Option<Suspect> {
        self.call_integrator(&[0], std::slice::from_ref(path), memory, depth);
        memory.queries.spawned.clear();
        memory.rays.first()?.suspect
    }

    /// Returns the tracer for a second evaluation, in which the host is asked for everything.
    fn again<'a>(&self, errors: &'a RuntimeErrors) -> PathTracer<'a>
    where
        Self: 'a,
    {
        let groups = self.scene.full_groups();
        PathTracer { groups, errors, finds_causes: false, ..*self }
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
        let (tracer, slots) = (*self, None);
        let (notes_suspects, is_of_stages) = (true, false);
        let mut host =
            SceneHost { tracer, rays, slots, queries, free, depth, notes_suspects, is_of_stages };
        let (kernel, instances) = (&integrator.kernel, Instances::One(&integrator.block));
        callee.call_for_first(kernel, active.len(), instances, state, scratch, &mut host);
        host.add_contributions();
        std::mem::take(&mut queries.rays)
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
