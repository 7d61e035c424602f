//! Integration of spawned paths, and of those that they spawn, until none is left.

use std::mem;

use super::integrator_memory::{IntegratorMemory, RAYS_OF_CALL};
use super::path_tracer::PathTracer;
use super::rows::{all_finite, are_finite};
use super::spawned_paths::{MAX_SPAWNED, SpawnedPaths};
use super::staged::{PathSet, StagedMethod};
use super::suspect::report_suspect;
use super::waiting_paths::WaitingPaths;
use super::wavefront::Path;
use crate::compiled::runtime_errors::RuntimeErrors;

/// The greatest number of paths that run through the stages together: about as many as those of samples.
const PATHS_OF_WAVE: usize = 1 << 10;

/// The number of paths above which those of some samples wait until those of the others have ended.
pub const MAX_WAITING: usize = 1 << 16;

/// A function that receives the samples of paths, and the radiance of the paths, channel by channel.
pub type AddRadiance<'a> = dyn FnMut(&[u32], &[Vec<f32>; 3]) + 'a;

/// The memory of paths that run together.
#[derive(Default)]
pub struct FollowedPaths {
    all: PathSet,
    /// The sample of each path.
    samples: Vec<u32>,
    /// The radiance of the paths.
    radiance: [Vec<f32>; 3],
}

/// Follows the paths in the memory that so many samples have spawned. `add` gets the radiance of each path, that of the
/// paths of one sample in the order in which the light of the sample is defined.
pub fn follow(
    tracer: &PathTracer<'_>,
    memory: &mut IntegratorMemory,
    samples: usize,
    add: &mut AddRadiance<'_>,
) {
    if memory.queries.spawned.is_empty() {
        return;
    }
    let mut waiting = memory.new_waiting();
    mem::swap(&mut memory.queries.spawned, &mut waiting.paths);
    waiting.order_last(samples, |sample| sample);
    Following { tracer, memory, add }.follow_waiting(waiting);
}

/// The integration of spawned paths.
struct Following<'a> {
    tracer: &'a PathTracer<'a>,
    memory: &'a mut IntegratorMemory,
    /// The function that gets the radiance of paths.
    add: &'a mut AddRadiance<'a>,
}

impl Following<'_> {
    fn follow_waiting(&mut self, mut waiting: WaitingPaths) {
        let PathTracer { scene, errors, .. } = *self.tracer;
        let [mut level, mut next] = [self.memory.new_waiting(), self.memory.new_waiting()];
        while let Some(depth) = waiting.least_depth().filter(|depth| scene.is_traced_at(*depth)) {
            if errors.any() {
                break;
            }
            if waiting.len() > MAX_WAITING
                && let Some(later) = waiting.split_off_samples()
            {
                self.follow_waiting(mem::replace(&mut waiting, later));
                continue;
            }
            waiting.take_depth(depth, &mut level);
            self.follow_level(&level, &mut next);
            waiting.append(&mut next);
            level.clear();
        }
        self.memory.keep_waiting([waiting, level, next]);
    }

    /// Follows paths of one depth, and leaves what they spawn in `next`.
    fn follow_level(
        &mut self,
        WaitingPaths { paths: level, order, .. }: &WaitingPaths,
        next: &mut WaitingPaths,
    ) {
        let PathTracer { scene, errors, .. } = *self.tracer;
        for chunk in order.chunks(PATHS_OF_WAVE) {
            let memory = &mut *self.memory;
            memory.queries.rays.traced += chunk.len() as u64;
            let mut followed = mem::take(&mut memory.followed);
            followed.samples.clear();
            followed.samples.extend(chunk.iter().map(|index| level.parents[*index as usize]));
            // What these paths spawn is appended to what those before them have.
            mem::swap(&mut memory.queries.spawned, &mut next.paths);
            match &scene.integrator.staged {
                Some(staged) => self.follow_in_stages(staged, level, chunk, &mut followed),
                None => self.follow_on_interpreter(level, chunk, &mut followed),
            }
            mem::swap(&mut self.memory.queries.spawned, &mut next.paths);
            next.order_last(chunk.len(), |path| followed.samples[path as usize]);
            (self.add)(&followed.samples, &followed.radiance);
            self.memory.followed = followed;
            if next.len() > MAX_SPAWNED {
                errors.report_many_paths();
            }
            if errors.any() {
                return;
            }
        }
    }

    /// Runs some of the paths of one depth on the stages. What they spawn is appended in the memory.
    fn follow_in_stages(
        &mut self,
        staged: &StagedMethod,
        level: &SpawnedPaths,
        chunk: &[u32],
        FollowedPaths { all, radiance, .. }: &mut FollowedPaths,
    ) {
        let Following { tracer, memory, .. } = self;
        let depth = level.depths[chunk[0] as usize];
        let before = memory.queries.spawned.len();
        let exhausted = RuntimeErrors::default();
        let begun = tracer.begin_stages(staged, &exhausted, memory, chunk.len(), depth);
        let Some(mut run) = begun else { return };
        let epsilon = tracer.scene.compiled.epsilon;
        run.wave.load_spawned(run.frames, &staged.columns, level, chunk, epsilon);
        run.begin_rays();
        all.set_all(chunk.len());
        run.run(all);
        radiance.iter_mut().for_each(|channel| channel.resize(chunk.len(), 0.0));
        run.radiance_of(all, radiance);
        // A second evaluation spawns paths, too.
        let spawned = mem::take(&mut run.queries.spawned);
        if exhausted.any() {
            let paths: Vec<Path> = run.paths(all.paths().iter().copied()).collect();
            tracer.report_exhausted(&paths, depth, memory);
            memory.queries.spawned = spawned;
            return;
        }
        // Where a weight is not finite, the cause lies before.
        let is_lost = |path: &u32| {
            let index = chunk[*path as usize] as usize;
            let radiance = radiance.each_ref().map(|channel| channel[*path as usize]);
            !are_finite(&radiance) && are_finite(&level.weights(index))
        };
        let lost: Vec<u32> = match radiance.iter().all(|channel| all_finite(channel)) {
            true => Vec::new(),
            false => all.paths().iter().copied().filter(is_lost).collect(),
        };
        let weightless = spawned.lost_parents(before).into_iter();
        let weightless =
            weightless.filter(|path| are_finite(&level.weights(chunk[*path as usize] as usize)));
        let lost: Vec<Path> = run.paths(lost.into_iter().chain(weightless)).collect();
        lost.iter().for_each(|path| tracer.report_cause(path, depth, memory));
        memory.queries.spawned = spawned;
    }

    /// Calls the whole method for some of the paths of one depth. What they spawn is appended in the memory.
    fn follow_on_interpreter(
        &mut self,
        level: &SpawnedPaths,
        chunk: &[u32],
        FollowedPaths { radiance, .. }: &mut FollowedPaths,
    ) {
        let Following { tracer, memory, .. } = self;
        let PathTracer { scene, errors, .. } = **tracer;
        let depth = level.depths[chunk[0] as usize];
        radiance.iter_mut().for_each(Vec::clear);
        let epsilon = tracer.scene.compiled.epsilon;
        for (start, indices) in (0_u32..).step_by(RAYS_OF_CALL).zip(chunk.chunks(RAYS_OF_CALL)) {
            let path = |index: &u32| level.get(*index as usize).path(epsilon);
            let mut paths: Vec<Path> = indices.iter().map(path).collect();
            let all: Vec<u32> = (0..paths.len() as u32).collect();
            let before = memory.queries.spawned.len();
            let counts = tracer.call_integrator(&all, &paths, memory, depth);
            memory.queries.rays += counts;
            let parents = &mut memory.queries.spawned.parents[before..];
            parents.iter_mut().for_each(|parent| *parent += start);
            let lost = memory.queries.spawned.lost_parents(before).into_iter();
            for lane in lost.filter_map(|parent| parent.checked_sub(start)) {
                report_suspect(scene, errors, memory.rays[lane as usize].suspect);
            }
            for (lane, path) in paths.iter_mut().enumerate() {
                memory.add_radiance(scene, errors, lane, path);
                let channels = radiance.iter_mut().zip(path.radiance);
                channels.for_each(|(channel, light)| channel.push(light));
            }
        }
    }
}
