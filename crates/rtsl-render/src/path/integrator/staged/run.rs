//! Runs the stages of an integrator for a wavefront.

use std::cell::RefCell;

use rtsl::{CallArguments, END, Instances, LaneBlock, Method, ResumedBy, StageSurface};

use super::super::super::memory::BatchMemory;
use super::super::super::path_tracer::PathTracer;
use super::super::super::shading_batch::set_indices;
use super::super::super::shadow_rays::ShadowRay;
use super::super::super::wavefront::{NO_INSTANCE, Path};
use super::super::Integrator;
use super::super::host::{Further, NO_OBJECT, RayOfCall, SceneHost};
use super::super::tracing::{IntegratorMemory, set_ray};
use super::columns::Columns;
use super::frames::{CALL_PATHS, Frames};
use super::staged_integrator::StagedIntegrator;
use crate::compiled::calls::Callee;

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

/// The paths that have arrived at one stage with surfaces of one group.
struct Arrived {
    stage: usize,
    group: usize,
    slots: Vec<u32>,
}

impl StagedPaths<'_> {
    /// Runs the paths to their ends. Their colours are then in the state of the frames, and their contributions in the
    /// rays.
    pub fn run(&mut self, paths: &[Path]) {
        self.begin(paths);
        let all: Vec<u32> = (0..paths.len() as u32).collect();
        self.call(&Arrived { stage: 0, group: 0, slots: all.clone() });
        let mut alive = all;
        while !self.tracer.errors.any() {
            self.add_contributions();
            let next = self.frames.paths.scratch.words(self.staged.columns.next);
            alive.retain(|slot| next[*slot as usize].cast_signed() != END);
            if alive.is_empty() {
                return;
            }
            let by_stage = self.by_stage(&alive);
            for (stage, slots) in by_stage.iter().enumerate().filter(|(_, it)| !it.is_empty()) {
                self.answer(stage, slots);
            }
            for (stage, slots) in by_stage.iter().enumerate().filter(|(_, it)| !it.is_empty()) {
                for arrived in self.by_group(stage, slots) {
                    self.call(&arrived);
                }
            }
        }
    }

    fn begin(&mut self, paths: &[Path]) {
        let StagedPaths { frames, rays, staged, .. } = self;
        rays.clear();
        rays.extend(paths.iter().map(RayOfCall::new));
        let Columns { time, key, sample, lights, .. } = staged.columns;
        let scratch = &mut frames.paths.scratch;
        let mut set = |array: usize, word: fn(&Path) -> u32| {
            let words = scratch.words_mut(array).iter_mut();
            words.zip(paths).for_each(|(to, path)| *to = word(path));
        };
        set(time, |path| path.time.to_bits());
        set(key, |path| path.key);
        set(sample, |path| path.sample);
        set(lights, |_| 0);
        for (slot, path) in paths.iter().enumerate() {
            set_ray(&mut frames.paths.state, slot, path, self.depth);
        }
    }

    /// Returns the paths that wait for each stage, in order.
    fn by_stage(&self, alive: &[u32]) -> Vec<Vec<u32>> {
        let StagedIntegrator { program, columns, .. } = self.staged;
        let next = self.frames.paths.scratch.words(columns.next);
        let mut by_stage = vec![Vec::new(); program.stages().len()];
        alive.iter().for_each(|slot| by_stage[next[*slot as usize] as usize].push(*slot));
        by_stage
    }

    /// Returns the paths of a stage by the groups of their surfaces.
    fn by_group(&self, stage: usize, slots: &[u32]) -> Vec<Arrived> {
        let description = &self.staged.program.stages()[stage];
        if description.surface == StageSurface::None {
            return vec![Arrived { stage, group: 0, slots: slots.to_vec() }];
        }
        let [objects, instances, elements] = self.staged.columns.surface(description.surface);
        let scratch = &self.frames.paths.scratch;
        let (objects, instances) = (scratch.words(objects), scratch.words(instances));
        let elements = scratch.words(elements);
        let mut by_group = vec![Vec::new(); self.staged.group_count()];
        for slot in slots {
            let at = *slot as usize;
            by_group[self.group_of(objects[at], instances[at], elements[at])].push(*slot);
        }
        let groups = by_group.into_iter().enumerate().filter(|(_, slots)| !slots.is_empty());
        groups.map(|(group, slots)| Arrived { stage, group, slots }).collect()
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
    fn requested(&self, slot: u32) -> ([f32; 3], [f32; 3], [f32; 2]) {
        let requests = &self.staged.columns.requests;
        let scratch = &self.frames.paths.scratch;
        let number = |index: usize| scratch.floats(requests[index])[slot as usize];
        ([0, 1, 2].map(number), [3, 4, 5].map(number), [6, 7].map(number))
    }

    /// Finds the nearest hits of the requested rays.
    fn search(&mut self, slots: &[u32]) {
        let mut paths = std::mem::take(&mut self.queries.wavefront.paths);
        paths.clear();
        for slot in slots {
            let (origin, direction, [epsilon, limit]) = self.requested(*slot);
            let epsilon_of_scene = self.tracer.scene.compiled.epsilon;
            let ray = &mut self.rays[*slot as usize];
            let is_first = ray.first_search();
            self.queries.rays.traced += u64::from(!is_first);
            paths.push(ray.begin_search((origin, direction), (epsilon, limit), epsilon_of_scene));
        }
        let BatchMemory { wavefront, searcher, batch, .. } = &mut *self.queries;
        wavefront.paths = paths;
        wavefront.features.clear();
        wavefront.active.clear();
        wavefront.active.extend(0..slots.len() as u32);
        searcher.are_together = std::mem::take(&mut self.are_together);
        self.tracer.find_hits(wavefront, searcher, batch);
        self.store_hits(slots);
    }

    fn store_hits(&mut self, slots: &[u32]) {
        let Columns { answers, depth, lights, .. } = &self.staged.columns;
        let wavefront = &self.queries.wavefront;
        let scratch = &mut self.frames.paths.scratch;
        let mut store = |path: u32, words: [u32; 5]| {
            let slot = slots[path as usize] as usize;
            for (array, word) in answers.iter().zip(words) {
                scratch.words_mut(*array)[slot] = word;
            }
        };
        for path in &wavefront.left {
            store(*path, [0, NO_OBJECT, NO_INSTANCE, 0, 0]);
            let ray = &mut self.rays[slots[*path as usize] as usize];
            ray.end_search(wavefront.paths[*path as usize].direction, None);
        }
        for (_, hit) in &wavefront.hits {
            let Path { distance, direction, .. } = wavefront.paths[hit.path as usize];
            let bits = distance.to_bits();
            store(hit.path, [u32::MAX, hit.object, hit.instance, hit.element, bits]);
            let ray = &mut self.rays[slots[hit.path as usize] as usize];
            ray.end_search(direction, Some((distance, hit.object)));
        }
        let counts = self.frames.paths.scratch.words_mut(*lights);
        for slot in slots {
            counts[*slot as usize] = self.rays[*slot as usize].numbers.lights();
        }
        let depths = self.frames.paths.scratch.floats_mut(*depth);
        for slot in slots {
            let before = self.rays[*slot as usize].surfaces_before();
            depths[*slot as usize] = (self.depth + before) as f32;
        }
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

    /// Runs a stage.
    fn call(&mut self, arrived: &Arrived) {
        let are_all = arrived.slots.len() == self.rays.len();
        if are_all {
            self.set_surfaces(arrived, &arrived.slots);
            return self.call_kernel(arrived, &arrived.slots, true);
        }
        let next = self.staged.columns.next;
        let (kernel, _) = self.staged.kernel(arrived.stage, arrived.group);
        for slots in arrived.slots.chunks(CALL_PATHS) {
            self.frames.gather(kernel, slots);
            self.set_surfaces(arrived, slots);
            self.call_kernel(arrived, slots, false);
            self.frames.scatter(kernel, slots, next);
        }
    }

    /// Sets the index of each path's surface among those of its group, if the group has several.
    fn set_surfaces(&mut self, arrived: &Arrived, slots: &[u32]) {
        let (_, objects) = self.staged.kernel(arrived.stage, arrived.group);
        if objects.len() < 2 {
            return;
        }
        let description = &self.staged.program.stages()[arrived.stage];
        let [array, ..] = self.staged.columns.surface(description.surface);
        let found = self.frames.paths.scratch.words(array);
        let staged = self.staged;
        let indices = slots.iter().map(|slot| staged.surface_of(found[*slot as usize]).index);
        set_indices(&mut self.frames.surfaces, indices);
    }

    fn call_kernel(&mut self, arrived: &Arrived, slots: &[u32], are_all: bool) {
        let (kernel, objects) = self.staged.kernel(arrived.stage, arrived.group);
        let StagedPaths { tracer, integrator, frames, rays, queries, free, depth, .. } = self;
        let Frames { paths, call, surfaces, .. } = &mut **frames;
        let blocks = if are_all { paths } else { call };
        let (state, scratch): (&mut LaneBlock, &mut LaneBlock) =
            (&mut blocks.state, &mut blocks.scratch);
        let mut host = SceneHost {
            tracer: *tracer,
            integrator,
            rays,
            slots: (!are_all).then_some(slots),
            queries,
            free,
            depth: *depth,
        };
        let instances = match objects.len() {
            0 | 1 => Instances::Object(objects, 0),
            _ => Instances::Many(objects, surfaces),
        };
        let callee =
            Callee { class: integrator.name(), method: Method::Radiance, errors: tracer.errors };
        callee.call(
            &kernel.kernel,
            CallArguments {
                state,
                scratch,
                count: slots.len(),
                mask: None,
                accepted: None,
                instances,
                host: &mut host,
            },
        );
    }
}
