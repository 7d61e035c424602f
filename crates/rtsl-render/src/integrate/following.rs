//! Integration of spawned paths, and of those that they spawn, until none is left.

use std::mem;

use super::path_tracer::PathTracer;
use super::rows::{all_finite, are_finite};
use super::spawned_paths::{MAX_SPAWNED, SpawnedPaths};
use super::staged::{PathSet, StagedMethod, Wave};
use super::tracing::{IntegratorMemory, RAYS_OF_CALL};
use super::waiting_paths::WaitingPaths;
use super::wavefront::Path;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::variables::variables;

/// The greatest number of paths that run through the stages together: about as many as those of samples.
const PATHS_OF_WAVE: usize = 1 << 10;

/// The number of paths above which those of some samples wait until those of the others have ended.
pub const MAX_WAITING: usize = 1 << 16;

/// Receives the index of a sample and the radiance of one of its paths.
pub type AddRadiance<'a> = dyn FnMut(usize, [f32; 3]) + 'a;

impl PathTracer<'_> {
    /// Follows the paths that so many samples have spawned. `add` gets the radiance of each path, that of the paths of one
    /// sample in the order in which the light of the sample is defined. Their memory is used again.
    pub(super) fn follow(
        &self,
        memory: &mut IntegratorMemory,
        mut spawned: SpawnedPaths,
        samples: usize,
        add: &mut AddRadiance<'_>,
    ) {
        if !spawned.is_empty() {
            let mut waiting = memory.new_waiting();
            waiting.add(&mut spawned, samples, |sample| sample);
            self.follow_waiting(memory, waiting, add);
            spawned.clear();
        }
        memory.queries.spawned = spawned;
    }

    fn follow_waiting(
        &self,
        memory: &mut IntegratorMemory,
        mut waiting: WaitingPaths,
        add: &mut AddRadiance<'_>,
    ) {
        let [mut level, mut next] = [memory.new_waiting(), memory.new_waiting()];
        while let Some(depth) = waiting.least_depth().filter(|depth| self.is_traced_at(*depth)) {
            if self.errors.any() {
                break;
            }
            if waiting.len() > MAX_WAITING
                && let Some(later) = waiting.split_off_samples()
            {
                self.follow_waiting(memory, mem::replace(&mut waiting, later), add);
                continue;
            }
            waiting.take_depth(depth, &mut level);
            self.follow_level(memory, &level, &mut next, add);
            waiting.append(&mut next);
            level.clear();
        }
        memory.keep_waiting([waiting, level, next]);
    }

    /// Follows paths of one depth, and leaves what they spawn in `next`.
    fn follow_level(
        &self,
        memory: &mut IntegratorMemory,
        WaitingPaths { paths: level, order, .. }: &WaitingPaths,
        next: &mut WaitingPaths,
        add: &mut AddRadiance<'_>,
    ) {
        for chunk in order.chunks(PATHS_OF_WAVE) {
            memory.queries.rays.traced += chunk.len() as u64;
            match &self.scene.integrator.staged {
                Some(staged) => self.follow_in_stages(staged, memory, (level, chunk), add),
                None => self.follow_on_interpreter(memory, (level, chunk), add),
            }
            let sample = |path: u32| level.parents[chunk[path as usize] as usize];
            next.add(&mut memory.queries.spawned, chunk.len(), sample);
            memory.queries.spawned.clear();
            if next.len() > MAX_SPAWNED {
                self.errors.report_many_paths();
            }
            if self.errors.any() {
                return;
            }
        }
    }

    /// Runs some of the paths of one depth on the stages. What they spawn is left in the memory.
    fn follow_in_stages(
        &self,
        staged: &StagedMethod,
        memory: &mut IntegratorMemory,
        (level, chunk): (&SpawnedPaths, &[u32]),
        add: &mut AddRadiance<'_>,
    ) {
        let depth = level.depths[chunk[0] as usize];
        let exhausted = RuntimeErrors::default();
        let begun = self.begin_stages((staged, &exhausted), memory, (chunk.len(), depth));
        let Some(mut run) = begun else { return };
        let epsilon = self.scene.compiled.epsilon;
        run.wave.load_spawned(run.frames, &staged.columns, (level, chunk), epsilon);
        run.begin_rays();
        let all = PathSet::all(chunk.len());
        run.run(&all);
        let mut radiance = vec![[0.0; 3]; chunk.len()];
        let colors = (&*run.frames, &staged.columns, variables().sample_color);
        Wave::radiance(colors, &mut radiance);
        for (index, color) in chunk.iter().zip(&radiance) {
            add(level.parents[*index as usize] as usize, *color);
        }
        if exhausted.any() {
            let paths: Vec<Path> = run.paths(all.paths().iter().copied()).collect();
            return self.report_exhausted(&paths, depth, memory);
        }
        // Where a weight is not finite, the cause lies before.
        let is_lost = |path: &u32| {
            let index = chunk[*path as usize] as usize;
            !are_finite(&radiance[*path as usize]) && are_finite(&level.weights(index))
        };
        let lost: Vec<u32> = match all_finite(radiance.as_flattened()) {
            true => Vec::new(),
            false => all.paths().iter().copied().filter(is_lost).collect(),
        };
        let spawned = mem::take(&mut run.queries.spawned);
        let weightless = spawned.lost_parents().into_iter();
        let weightless =
            weightless.filter(|path| are_finite(&level.weights(chunk[*path as usize] as usize)));
        let lost: Vec<Path> = run.paths(lost.into_iter().chain(weightless)).collect();
        // A second evaluation spawns paths, too.
        lost.iter().for_each(|path| self.report_cause(path, depth, memory));
        memory.queries.spawned = spawned;
    }

    /// Calls the whole method for some of the paths of one depth. What they spawn is left in the memory.
    fn follow_on_interpreter(
        &self,
        memory: &mut IntegratorMemory,
        (level, chunk): (&SpawnedPaths, &[u32]),
        add: &mut AddRadiance<'_>,
    ) {
        let depth = level.depths[chunk[0] as usize];
        let epsilon = self.scene.compiled.epsilon;
        for (start, indices) in (0_u32..).step_by(RAYS_OF_CALL).zip(chunk.chunks(RAYS_OF_CALL)) {
            let path = |index: &u32| level.get(*index as usize).path(epsilon);
            let mut paths: Vec<Path> = indices.iter().map(path).collect();
            let all: Vec<u32> = (0..paths.len() as u32).collect();
            let before = memory.queries.spawned.len();
            let counts = self.call_integrator((&all, &paths), memory, depth);
            memory.queries.rays += counts;
            let parents = &mut memory.queries.spawned.parents[before..];
            parents.iter_mut().for_each(|parent| *parent += start);
            let lost = memory.queries.spawned.lost_parents().into_iter();
            for lane in lost.filter_map(|parent| parent.checked_sub(start)) {
                self.report_suspect(memory.rays[lane as usize].suspect);
            }
            for (lane, path) in paths.iter_mut().enumerate() {
                let IntegratorMemory { state, rays, .. } = &*memory;
                self.add_radiance(path, state, (&rays[lane], lane));
                add(level.parents[indices[lane] as usize] as usize, path.radiance);
            }
        }
    }
}
