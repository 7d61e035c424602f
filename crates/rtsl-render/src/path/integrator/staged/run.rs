//! Runs the stages of an integrator for a wavefront.

use std::cell::RefCell;

use rtsl::{CallArguments, END, Instances, Method, ResumedBy, StageSurface};
use rtsl_bvh::{LANES, lanes_of};

use super::super::super::memory::BatchMemory;
use super::super::super::path_tracer::PathTracer;
use super::super::super::shading_batch::set_indices;
use super::super::super::shadow_rays::ShadowRay;
use super::super::super::wavefront::{NO_INSTANCE, Path};
use super::super::Integrator;
use super::super::host::{Further, NO_OBJECT, RayOfCall, SceneHost};
use super::super::tracing::IntegratorMemory;
use super::frames::{Blocks, CALL_PATHS, Frames};
use super::path_lists::PathLists;
use super::staged_integrator::StagedIntegrator;
use super::wave::Wave;
use crate::compiled::calls::Callee;
use crate::compiled::tracer::Tracer;
use crate::tiles::{CameraMemory, SampleStreams, TileSamples, camera_packet};

/// Paths on their way through the stages.
pub struct StagedPaths<'a> {
    pub tracer: PathTracer<'a>,
    pub integrator: &'a Integrator,
    pub staged: &'a StagedIntegrator,
    pub frames: &'a mut Frames,
    pub wave: &'a mut Wave,
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

/// A kernel works in place on the arrays of all paths if, of the vectors in which any path takes part, one lane of so
/// many takes part: copying costs more than lanes that are off. Kernels skip other vectors.
const MIN_OCCUPANCY: usize = 2;

/// The number of lanes of the vectors whose occupancy counts.
const VECTOR_LANES: u32 = 16;

impl StagedPaths<'_> {
    /// Loads the camera rays of samples; returns the paths of those whose pixels lie inside the image.
    pub fn load_samples(
        &mut self,
        camera: &mut CameraMemory<SampleStreams>,
        samples: &TileSamples,
    ) -> Vec<u32> {
        let scene = &self.tracer.scene.compiled;
        let tracer = Tracer { scene, errors: self.tracer.errors };
        let mut active = Vec::with_capacity(self.wave.count);
        for packet in 0..samples.packets() {
            let start = packet * LANES;
            let lanes = samples.lanes(packet, (scene.settings.width, scene.settings.height));
            let rays = camera_packet(&tracer, camera, samples, packet);
            self.wave.load_camera_rays(self.frames, &self.staged.columns, &rays, start);
            self.tracer.lost_by_camera(&rays.weights, lanes);
            camera.keep(rays);
            active.extend(lanes_of(lanes).map(|lane| (start + lane) as u32));
        }
        active
    }

    /// Runs loaded paths, of which these are active, to their ends.
    pub fn run(&mut self, active: &[u32]) {
        if self.staged.asks_host() || self.tracer.scene.has_alpha() {
            self.wave.begin_rays(self.frames, &self.staged.columns);
        }
        // The first stage reads the state of rays, which is not copied.
        self.call_in_place((0, 0), active);
        self.add_contributions();
        let [mut by_stage, mut before] = std::mem::take(&mut self.frames.by_stage);
        let mut by_group = std::mem::take(&mut self.frames.by_group);
        let stages = self.staged.program.stages().len();
        self.sort_by_stage(active, &mut by_stage);
        while !by_stage.below(stages).is_empty() && !self.tracer.errors.any() {
            by_stage.lists(stages).for_each(|(stage, paths)| self.answer(stage, paths));
            for (stage, paths) in by_stage.lists(stages) {
                self.sort_by_group(stage, paths, &mut by_group);
                let groups = by_group.lists(self.staged.group_count());
                groups.for_each(|(group, paths)| self.call((stage, group), paths));
            }
            self.add_contributions();
            std::mem::swap(&mut by_stage, &mut before);
            self.sort_by_stage(before.below(stages), &mut by_stage);
        }
        (self.frames.by_stage, self.frames.by_group) = ([by_stage, before], by_group);
    }

    /// Sorts paths by the stages that they wait for, those that have ended last.
    fn sort_by_stage(&self, paths: &[u32], by_stage: &mut PathLists) {
        let stages = self.staged.program.stages().len();
        let next = self.frames.paths.scratch.words(self.staged.columns.next);
        let stage = |path: u32| next[path as usize].min(stages as u32);
        const { assert!(END < 0) };
        by_stage.sort(paths, stages + 1, stage);
    }

    /// Sorts the paths of a stage by the groups of their surfaces.
    fn sort_by_group(&self, stage: usize, paths: &[u32], by_group: &mut PathLists) {
        let StagedIntegrator { program, columns, .. } = self.staged;
        let surface = program.stages()[stage].surface;
        let [objects, instances, elements] = columns.surface(surface);
        let scratch = &self.frames.paths.scratch;
        let objects = scratch.words(objects);
        let groups = self.staged.group_count();
        match surface {
            StageSurface::None => by_group.sort(paths, groups, |_| 0),
            StageSurface::Answer => by_group.sort(paths, groups, |path| {
                let object = objects[path as usize];
                if object == NO_OBJECT { 0 } else { self.staged.surface_of(object).group }
            }),
            StageSurface::Request => {
                let (instances, elements) = (scratch.words(instances), scratch.words(elements));
                by_group.sort(paths, groups, |path| {
                    let at = path as usize;
                    self.group_of(objects[at], instances[at], elements[at])
                });
            }
        }
    }

    /// Returns the group of a surface; 0 if the scene has no such surface.
    fn group_of(&self, object: u32, instance: u32, element: u32) -> u32 {
        let scene = self.tracer.scene;
        let Some(entry) = scene.objects.get(object as usize) else { return 0 };
        let instances = scene.compiled.geometry.instances.len();
        let is_placed = instance == NO_INSTANCE || (instance as usize) < instances;
        let has_element = scene.compiled.class(entry.class).index_of(object, element).is_some();
        let group = self.staged.surface_of(object).group;
        if is_placed && has_element { group } else { 0 }
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
            let RayOfCall { numbers, time, .. } = &mut self.wave.rays[*slot as usize];
            self.queries.shadow_rays.push(&ShadowRay {
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
        self.tracer.trace_shadow_rays(self.queries);
        let BatchMemory { shadow_rays, reached, .. } = &mut *self.queries;
        for index in reached {
            answers[shadow_rays.paths[*index as usize] as usize] = 0;
        }
        shadow_rays.clear();
    }

    /// Computes the radiance along the requested rays.
    fn trace(&mut self, slots: &[u32]) {
        let mut paths: Vec<Path> = Vec::with_capacity(slots.len());
        for slot in slots {
            let (origin, direction, [limit, _]) = self.requested(*slot);
            let epsilon = self.tracer.scene.compiled.epsilon;
            paths.push(self.wave.rays[*slot as usize].begin_trace(
                (origin, direction),
                limit,
                epsilon,
            ));
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

    /// Adds the contributions that nothing blocks.
    fn add_contributions(&mut self) {
        self.tracer.trace_shadow_rays(self.queries);
        let BatchMemory { shadow_rays, reached, .. } = &mut *self.queries;
        for index in reached {
            let index = *index as usize;
            self.wave.add(shadow_rays.paths[index], shadow_rays.color(index));
        }
        shadow_rays.clear();
    }

    /// Notes the contributions of a call for these paths.
    fn take_contributions(&mut self, place: Place<'_>, slots: &[u32]) {
        let StagedPaths { frames, wave, queries, staged, .. } = self;
        let Frames { paths, call, contributing, .. } = &mut **frames;
        let scratch = match place {
            Place::All { .. } => &paths.scratch,
            Place::Copied(_) => &call.scratch,
        };
        let columns = staged.columns.contribution.map(|array| scratch.floats(array));
        let is_lit =
            |lane: usize| [7, 8, 9].map(|channel: usize| columns[channel][lane]) != [0.0; 3];
        let BatchMemory { shadow_rays, .. } = &mut **queries;
        let first = shadow_rays.paths.len();
        match place {
            Place::All { .. } => {
                collect(slots.iter().copied(), is_lit, contributing);
                shadow_rays.paths.extend_from_slice(contributing);
            }
            Place::Copied(slots) => {
                collect(0..slots.len() as u32, is_lit, contributing);
                shadow_rays.paths.extend(contributing.iter().map(|lane| slots[*lane as usize]));
            }
        }
        shadow_rays.add(contributing, columns);
        let times = paths.scratch.floats(staged.columns.time);
        let added = &shadow_rays.paths[first..];
        shadow_rays.times.extend(added.iter().map(|path| times[*path as usize]));
        for path in added {
            let ray = wave.rays.get_mut(*path as usize);
            let sequence = ray.map(|ray| [ray.numbers.begin_call(), ray.numbers.sample]);
            shadow_rays.sequences.push(sequence.unwrap_or_default());
        }
    }

    /// Runs a stage for paths with surfaces of one group: in place where these are many of all paths, else on a copy of
    /// their data.
    fn call(&mut self, (stage, group): (usize, usize), slots: &[u32]) {
        if is_dense(slots, self.wave.count) {
            return self.call_in_place((stage, group), slots);
        }
        let (kernel, _) = self.staged.kernel(stage, group);
        let next = self.staged.columns.next;
        for slots in slots.chunks(CALL_PATHS) {
            self.frames.gather(kernel, slots);
            self.set_surfaces((stage, group), slots, false);
            self.call_kernel((stage, group), Place::Copied(slots));
            if kernel.contributes {
                self.take_contributions(Place::Copied(slots), slots);
            }
            self.frames.scatter(kernel, slots, next);
        }
    }

    /// Runs a stage on the arrays of all paths.
    fn call_in_place(&mut self, (stage, group): (usize, usize), slots: &[u32]) {
        let all = self.wave.count;
        let is_masked = slots.len() < all;
        if is_masked {
            self.frames.select(slots);
        }
        self.set_surfaces((stage, group), slots, true);
        let place = Place::All { count: all, is_masked };
        self.call_kernel((stage, group), place);
        if self.staged.kernel(stage, group).0.contributes {
            self.take_contributions(place, slots);
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
        let StagedPaths { tracer, integrator, frames, wave, queries, free, depth, .. } = self;
        let rays = &mut *wave.rays;
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

/// Collects the lanes for which a condition holds, without branches.
fn collect(
    lanes: impl ExactSizeIterator<Item = u32>,
    holds: impl Fn(usize) -> bool,
    collected: &mut Vec<u32>,
) {
    collected.clear();
    collected.resize(lanes.len() + 1, 0);
    let mut count = 0;
    for lane in lanes {
        collected[count] = lane;
        count += usize::from(holds(lane as usize));
    }
    collected.truncate(count);
}

/// True if a kernel for these of `all` paths works in place.
fn is_dense(slots: &[u32], all: usize) -> bool {
    if slots.len() * MIN_OCCUPANCY >= all {
        return true;
    }
    let mut vectors = 0;
    let mut last = u32::MAX;
    for slot in slots {
        vectors += usize::from(slot / VECTOR_LANES != last);
        last = slot / VECTOR_LANES;
    }
    slots.len() * MIN_OCCUPANCY >= vectors * VECTOR_LANES as usize
}
