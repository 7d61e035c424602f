//! Runs the stages of an integrator for a wavefront.

use std::cell::RefCell;

use rtsl::{CallArguments, END, Instances, Method, ResumedBy, StageSurface};

use super::super::super::memory::BatchMemory;
use super::super::super::path_tracer::PathTracer;
use super::super::super::shading_batch::set_indices;
use super::super::super::shadow_rays::ShadowRay;
use super::super::super::wavefront::{NO_INSTANCE, Path};
use super::super::Integrator;
use super::super::host::{Further, NO_OBJECT, RayOfCall, SceneHost};
use super::super::tracing::{IntegratorMemory, ray_components};
use super::columns::Columns;
use super::frames::{Blocks, CALL_PATHS, Frames};
use super::staged_integrator::StagedIntegrator;
use crate::compiled::calls::Callee;
use crate::compiled::variables::variables;

/// Paths on their way through the stages.
pub struct StagedPaths<'a> {
    pub tracer: PathTracer<'a>,
    pub integrator: &'a Integrator,
    pub staged: &'a StagedIntegrator,
    pub frames: &'a mut Frames,
    pub rays: &'a mut Vec<RayOfCall>,
    /// The memory of queries and searches.
    pub queries: &'a mut BatchMemory,
    /// The memory of further levels of recursion.
    pub free: &'a RefCell<Vec<IntegratorMemory>>,
    /// The depth of the paths' rays.
    pub depth: u32,
    /// True if the rays of adjacent paths are coherent.
    pub are_together: bool,
}

/// The arrays on which a kernel works.
#[derive(Clone, Copy)]
enum Place<'a> {
    /// Those of all paths, of which some may be masked.
    All { count: usize, is_masked: bool },
    /// A copy for these paths.
    Copied(&'a [u32]),
}

/// A kernel works in place on the arrays of all paths if one of so many takes part: copying costs more than lanes that
/// are off.
const MIN_OCCUPANCY: usize = 2;

impl StagedPaths<'_> {
    /// Runs the paths to their ends. Their colours are then in the state of the frames, and their contributions in the
    /// rays.
    pub fn run(&mut self, paths: &[Path], active: &[u32]) {
        self.begin(paths, active);
        let mut alive: Vec<u32> = (0..active.len() as u32).collect();
        self.call((0, 0), &alive);
        let mut by_stage = vec![Vec::new(); self.staged.program.stages().len()];
        let mut by_group = vec![Vec::new(); self.staged.group_count()];
        while !self.tracer.errors.any() {
            self.add_contributions();
            self.sort_by_stage(&mut alive, &mut by_stage);
            if alive.is_empty() {
                return;
            }
            for (stage, slots) in by_stage.iter().enumerate().filter(|(_, it)| !it.is_empty()) {
                self.answer(stage, slots);
            }
            for (stage, slots) in by_stage.iter().enumerate().filter(|(_, it)| !it.is_empty()) {
                self.sort_by_group(stage, slots, &mut by_group);
                let groups = by_group.iter().enumerate().filter(|(_, it)| !it.is_empty());
                groups.for_each(|(group, slots)| self.call((stage, group), slots));
            }
        }
    }

    /// Loads the paths with these indices.
    fn begin(&mut self, paths: &[Path], active: &[u32]) {
        let StagedPaths { frames, rays, staged, .. } = self;
        let active = active.iter().map(|index| &paths[*index as usize]);
        rays.clear();
        rays.extend(active.clone().map(RayOfCall::new));
        let Columns { time, key, sample, lights, .. } = staged.columns;
        let scratch = &mut frames.paths.scratch;
        let mut set = |array: usize, word: fn(&Path) -> u32| {
            let words = scratch.words_mut(array).iter_mut();
            words.zip(active.clone()).for_each(|(to, path)| *to = word(path));
        };
        set(time, |path| path.time.to_bits());
        set(key, |path| path.key);
        set(sample, |path| path.sample);
        set(lights, |_| 0);
        let state = &mut frames.paths.state;
        for (component, value) in ray_components() {
            let floats = state.floats_mut(component).iter_mut();
            floats.zip(active.clone()).for_each(|(to, path)| *to = value(path));
        }
        state.floats_mut(variables().ray_depth)[..rays.len()].fill(self.depth as f32);
    }

    /// Removes paths that have ended, and sorts the others by the stage that they wait for.
    fn sort_by_stage(&self, alive: &mut Vec<u32>, by_stage: &mut [Vec<u32>]) {
        by_stage.iter_mut().for_each(Vec::clear);
        let next = self.frames.paths.scratch.words(self.staged.columns.next);
        alive.retain(|slot| {
            let next = next[*slot as usize].cast_signed();
            if next != END {
                by_stage[next as usize].push(*slot);
            }
            next != END
        });
    }

    /// Sorts the paths of a stage by the groups of their surfaces.
    fn sort_by_group(&self, stage: usize, slots: &[u32], by_group: &mut [Vec<u32>]) {
        by_group.iter_mut().for_each(Vec::clear);
        let StagedIntegrator { program, columns, .. } = self.staged;
        let surface = program.stages()[stage].surface;
        let [objects, instances, elements] = columns.surface(surface);
        let scratch = &self.frames.paths.scratch;
        let objects = scratch.words(objects);
        match surface {
            StageSurface::None => by_group[0].extend_from_slice(slots),
            StageSurface::Answer => {
                for slot in slots {
                    let object = objects[*slot as usize];
                    let is_hit = object != NO_OBJECT;
                    let group = if is_hit { self.staged.surface_of(object).group } else { 0 };
                    by_group[group as usize].push(*slot);
                }
            }
            StageSurface::Request => {
                let (instances, elements) = (scratch.words(instances), scratch.words(elements));
                for slot in slots {
                    let at = *slot as usize;
                    let group = self.group_of(objects[at], instances[at], elements[at]);
                    by_group[group].push(*slot);
                }
            }
        }
    }

    /// Returns the group of a surface; 0 if the scene has no such surface.
    fn group_of(&self, object: u32, instance: u32, element: u32) -> usize {
        let scene = self.tracer.scene;
        let Some(entry) = scene.objects.get(object as usize) else { return 0 };
        let instances = scene.compiled.geometry.instances.len();
        let is_placed = instance == NO_INSTANCE || (instance as usize) < instances;
        let has_element = scene.compiled.class(entry.class).index_of(object, element).is_some();
        let group = self.staged.surface_of(object).group;
        if is_placed && has_element { group as usize } else { 0 }
    }

    /// Answers what paths wait for, before they run a stage.
    fn answer(&mut self, stage: usize, slots: &[u32]) {
        match self.staged.program.stages()[stage].resumed_by {
            ResumedBy::Start | ResumedBy::Dispatch => {}
            ResumedBy::NearestHit => self.search(slots),
            ResumedBy::Occluded => self.find_occluded(slots),
            ResumedBy::Trace => self.trace(slots),
        }
    }

    /// Returns the origin and the direction of a requested ray, and its last two operands.
    pub fn requested(&self, slot: u32) -> ([f32; 3], [f32; 3], [f32; 2]) {
        let requests = &self.staged.columns.requests;
        let scratch = &self.frames.paths.scratch;
        let number = |index: usize| scratch.floats(requests[index])[slot as usize];
        ([0, 1, 2].map(number), [3, 4, 5].map(number), [6, 7].map(number))
    }

    /// Finds out which of the requested rays are blocked.
    fn find_occluded(&mut self, slots: &[u32]) {
        for slot in slots {
            let (origin, direction, [distance, _]) = self.requested(*slot);
            let RayOfCall { numbers, time, .. } = &mut self.rays[*slot as usize];
            self.queries.shadow_rays.push(ShadowRay {
                origin,
                direction,
                distance,
                time: *time,
                color: [0.0; 3],
                path: *slot,
                key: numbers.begin_call(),
                sample: numbers.sample,
            });
        }
        let answers = self.frames.paths.scratch.words_mut(self.staged.columns.answers[0]);
        slots.iter().for_each(|slot| answers[*slot as usize] = u32::MAX);
        let reached = &mut |ray: &ShadowRay| answers[ray.path as usize] = 0;
        self.tracer.trace_shadow_rays(self.queries, reached);
    }

    /// Computes the radiance along the requested rays.
    fn trace(&mut self, slots: &[u32]) {
        let mut paths: Vec<Path> = Vec::with_capacity(slots.len());
        for slot in slots {
            let (origin, direction, [limit, _]) = self.requested(*slot);
            let epsilon = self.tracer.scene.compiled.epsilon;
            paths.push(self.rays[*slot as usize].begin_trace((origin, direction), limit, epsilon));
        }
        let StagedPaths { tracer, integrator, free, .. } = self;
        let further = Further { tracer, integrator, free };
        self.queries.rays += further.integrate(&mut paths, self.depth + 1);
        for (channel, array) in self.staged.columns.answers[..3].iter().enumerate() {
            let answers = self.frames.paths.scratch.floats_mut(*array);
            for (slot, path) in slots.iter().zip(&paths) {
                answers[*slot as usize] = path.radiance[channel];
            }
        }
    }

    fn add_contributions(&mut self) {
        let rays = &mut *self.rays;
        self.tracer.trace_shadow_rays(self.queries, &mut |ray: &ShadowRay| {
            rays[ray.path as usize].add_contribution(ray.color);
        });
    }

    /// Runs a stage for paths with surfaces of one group: in place where these are many of all paths, else on a copy of
    /// their data.
    fn call(&mut self, (stage, group): (usize, usize), slots: &[u32]) {
        let all = self.rays.len();
        if slots.len() * MIN_OCCUPANCY >= all {
            let is_masked = slots.len() < all;
            if is_masked {
                self.frames.select(slots);
            }
            self.set_surfaces((stage, group), slots, true);
            return self.call_kernel((stage, group), Place::All { count: all, is_masked });
        }
        let next = self.staged.columns.next;
        let (kernel, _) = self.staged.kernel(stage, group);
        for slots in slots.chunks(CALL_PATHS) {
            self.frames.gather(kernel, slots);
            self.set_surfaces((stage, group), slots, false);
            self.call_kernel((stage, group), Place::Copied(slots));
            self.frames.scatter(kernel, slots, next);
        }
    }

    /// Sets the index of each path's surface among those of its group, if the group has several.
    fn set_surfaces(&mut self, (stage, group): (usize, usize), slots: &[u32], in_place: bool) {
        let (_, objects) = self.staged.kernel(stage, group);
        if objects.len() < 2 {
            return;
        }
        let surface = self.staged.program.stages()[stage].surface;
        let [array, ..] = self.staged.columns.surface(surface);
        let found = self.frames.paths.scratch.words(array);
        let staged = self.staged;
        let index = |slot: &u32| staged.surface_of(found[*slot as usize]).index;
        if !in_place {
            return set_indices(&mut self.frames.surfaces, slots.iter().map(index));
        }
        // Kernels need valid indices for all paths.
        let indices = self.frames.surfaces.as_mut_slice();
        indices.fill(0);
        slots.iter().for_each(|slot| indices[*slot as usize] = index(slot));
    }

    fn call_kernel(&mut self, (stage, group): (usize, usize), place: Place<'_>) {
        let (kernel, objects) = self.staged.kernel(stage, group);
        let StagedPaths { tracer, integrator, frames, rays, queries, free, depth, .. } = self;
        let Frames { paths, call, surfaces, mask, .. } = &mut **frames;
        let (Blocks { state, scratch }, count, mask, slots) = match place {
            Place::All { count, is_masked } => (paths, count, is_masked.then_some(&*mask), None),
            Place::Copied(slots) => (call, slots.len(), None, Some(slots)),
        };
        let mut host =
            SceneHost { tracer: *tracer, integrator, rays, slots, queries, free, depth: *depth };
        let host = &mut host;
        let instances = match objects.len() {
            0 | 1 => Instances::Object(objects, 0),
            _ => Instances::Many(objects, surfaces),
        };
        let callee =
            Callee { class: integrator.name(), method: Method::Radiance, errors: tracer.errors };
        let accepted = None;
        let call = CallArguments { state, scratch, count, mask, accepted, instances, host };
        callee.call(&kernel.kernel, call);
    }
}
