//! Runs the stages of an integrator for a wavefront.

use std::cell::RefCell;

use rtsl::{CallArguments, END, Instances, ResumedBy, StageSurface};
use rtsl_bvh::{LANES, LaneMask};

use super::super::super::memory::BatchMemory;
use super::super::super::path_tracer::PathTracer;
use super::super::super::wavefront::Path;
use super::super::host::{NO_OBJECT, SceneHost};
use super::super::numbers::Purpose;
use super::super::tracing::IntegratorMemory;
use super::frames::{Blocks, CALL_PATHS, Frames, set_objects, take_objects};
use super::path_set::PathSet;
use super::path_sets::PathSets;
use super::staged_method::StagedMethod;
use super::wave::Wave;
use crate::compiled::calls::Callee;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::tiles::{TileSamples, packets_of};

/// Paths on their way through the stages.
pub struct StagedPaths<'a> {
    pub tracer: PathTracer<'a>,
    /// The record of stages that exceeded their loop budget.
    pub exhausted: &'a RuntimeErrors,
    pub staged: &'a StagedMethod,
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
pub enum Place<'a> {
    /// Those of all paths, of which these take part.
    All { paths: &'a PathSet, count: usize, is_masked: bool },
    /// A copy for these paths.
    Copied(&'a [u32]),
}

impl StagedPaths<'_> {
    /// Computes the camera rays of samples of some tiles; returns the paths of those whose pixels lie inside the image.
    pub fn load_samples(&mut self, samples: &[TileSamples]) -> PathSet {
        let scene = &self.tracer.scene.compiled;
        let Blocks { state, scratch } = &mut self.frames.paths;
        let of_scene = (scene, self.tracer.errors);
        self.tracer.scene.camera().generate(of_scene, packets_of(samples), (state, scratch));
        let size = (scene.settings.width, scene.settings.height);
        let lanes = packets_of(samples).map(|(samples, packet)| samples.lanes(packet, size));
        let active: Vec<LaneMask> = lanes.collect();
        let weights = self.staged.columns.weights.map(|array| scratch.floats(array));
        for (start, lanes) in (0..).step_by(LANES).zip(&active) {
            self.tracer.lost_by_camera(weights.map(|it| &it[start..start + LANES]), *lanes);
        }
        PathSet::of_packets(&active)
    }

    /// Begins what hosts know of the loaded paths, if any host has to.
    pub fn begin_rays(&mut self) {
        if self.tracer.scene.needs_rays(self.staged) {
            self.wave.begin_rays(self.frames, &self.staged.columns);
        }
    }

    /// Runs loaded paths, of which these are active, to their ends.
    pub fn run(&mut self, active: &PathSet) {
        // The first stage reads the state of rays, which is not copied.
        self.call_in_place(self.staged, (0, 0), active);
        self.add_contributions();
        let mut by_stage = std::mem::take(&mut self.frames.by_stage);
        let mut by_group = std::mem::take(&mut self.frames.by_group);
        while self.sort_by_stage(active, &mut by_stage) && !self.must_stop() {
            by_stage.sets().for_each(|(stage, paths)| self.answer(stage, paths));
            for (stage, paths) in by_stage.sets() {
                self.call_by_group(stage, paths, &mut by_group);
            }
            self.add_contributions();
        }
        (self.frames.by_stage, self.frames.by_group) = (by_stage, by_group);
        if self.staged.program.searches_at_end() {
            self.count_stage_searches(active);
        }
        self.discount_first_searches(active);
    }

    /// Returns these paths as they were loaded, without their weights.
    pub fn paths(&self, paths: impl Iterator<Item = u32>) -> impl Iterator<Item = Path> {
        paths.map(|path| self.wave.path(self.frames, &self.staged.columns, path))
    }

    fn must_stop(&self) -> bool {
        self.tracer.errors.any() || self.exhausted.any()
    }

    /// Sorts paths by the stages that they wait for; false if all have ended.
    fn sort_by_stage(&self, paths: &PathSet, by_stage: &mut PathSets) -> bool {
        let stages = self.staged.program.stages().len();
        let next = self.frames.paths.scratch.words(self.staged.columns.next);
        // The mark of paths that have ended is above all stages.
        const { assert!(END < 0) };
        by_stage.sort(paths, next, stages);
        by_stage.sets().next().is_some()
    }

    /// Runs a stage for paths, group by group of their surfaces.
    fn call_by_group(&mut self, stage: usize, paths: &PathSet, by_group: &mut PathSets) {
        let surface = self.staged.program.stages()[stage].surface;
        if surface == StageSurface::None || self.staged.is_of_material() {
            return self.call((stage, 0), paths);
        }
        if self.staged.finds_surfaces(stage) {
            let groups = self.frames.paths.scratch.words(self.staged.columns.group);
            by_group.sort(paths, groups, self.staged.group_count());
            return by_group.sets().for_each(|(group, paths)| self.call((stage, group), paths));
        }
        let mut groups = std::mem::take(&mut self.frames.groups);
        self.find_groups(surface, paths, &mut groups);
        by_group.sort(paths, &groups, self.staged.group_count());
        self.frames.groups = groups;
        by_group.sets().for_each(|(group, paths)| self.call((stage, group), paths));
    }

    /// Finds the groups of the surfaces of paths.
    fn find_groups(&self, surface: StageSurface, paths: &PathSet, groups: &mut [u32]) {
        let [objects, instances, elements] = self.staged.columns.surface(surface);
        let scratch = &self.frames.paths.scratch;
        let objects = scratch.words(objects);
        if surface == StageSurface::Answer {
            for path in paths.paths() {
                let object = objects[*path as usize];
                let is_found = object != NO_OBJECT;
                let group = if is_found { self.staged.surface_of(object).group } else { 0 };
                groups[*path as usize] = group;
            }
            return;
        }
        let (instances, elements) = (scratch.words(instances), scratch.words(elements));
        for path in paths.paths() {
            let at = *path as usize;
            groups[at] = self.group_of(objects[at], instances[at], elements[at]);
        }
    }

    /// Returns the group of a surface; 0 if the scene has no such surface.
    fn group_of(&self, object: u32, instance: u32, element: u32) -> u32 {
        let hit = self.tracer.scene.hit_of(object, instance, element);
        hit.map_or(0, |hit| self.staged.surface_of(hit.object).group)
    }

    /// Answers what paths wait for, before they run a stage.
    fn answer(&mut self, stage: usize, paths: &PathSet) {
        match self.staged.program.stages()[stage].resumed_by {
            ResumedBy::Start | ResumedBy::Dispatch => {}
            ResumedBy::NearestHit => self.search(paths),
            ResumedBy::Occluded => self.find_occluded(paths.paths()),
            ResumedBy::Trace => self.trace(paths.paths()),
            ResumedBy::Shade => self.shade(paths.paths()),
            ResumedBy::LightSample => self.sample_lights(paths),
        }
    }

    /// Adds the contributions that nothing blocks.
    fn add_contributions(&mut self) {
        if self.queries.shadow_rays.len() == 0 {
            return;
        }
        self.trace_shadow_rays();
        let BatchMemory { shadow_rays, reached, .. } = &mut *self.queries;
        let scratch = &mut self.frames.paths.scratch;
        for (array, colors) in self.staged.columns.lit.iter().zip(&shadow_rays.colors) {
            let sums = scratch.floats_mut(*array);
            for index in &*reached {
                let index = *index as usize;
                sums[shadow_rays.paths[index] as usize] += colors[index];
            }
        }
        shadow_rays.clear();
    }

    /// Notes the contributions of a call for these paths.
    fn take_contributions(&mut self, place: Place<'_>) {
        let StagedPaths { frames, wave, queries, staged, .. } = self;
        let Frames { paths, call, called, contributing, .. } = &mut **frames;
        let scratch = match place {
            Place::All { .. } => &paths.scratch,
            Place::Copied(_) => &call.scratch,
        };
        let columns = staged.columns.contribution.map(|array| scratch.floats(array));
        let [.., red, green, blue] = columns;
        let BatchMemory { shadow_rays, .. } = &mut **queries;
        let first = shadow_rays.paths.len();
        let times = paths.scratch.floats(staged.columns.time);
        match place {
            Place::All { paths: all, .. } => {
                contributing.set_nonzero(all, [red, green, blue]);
                shadow_rays.paths.extend_from_slice(contributing.paths());
                contributing.append([(times, &mut shadow_rays.times)]);
            }
            Place::Copied(slots) => {
                called.set_all(slots.len());
                contributing.set_nonzero(called, [red, green, blue]);
                contributing.append_words(slots, &mut shadow_rays.paths);
                let added = &shadow_rays.paths[first..];
                shadow_rays.times.extend(added.iter().map(|path| times[*path as usize]));
            }
        }
        contributing.append(columns.into_iter().zip(shadow_rays.columns_mut()));
        for path in &shadow_rays.paths[first..] {
            let ray = wave.rays.get_mut(*path as usize);
            let sequence =
                ray.map(|ray| [ray.numbers.begin(Purpose::ShadowRay), ray.numbers.sample]);
            shadow_rays.sequences.push(sequence.unwrap_or_default());
        }
    }

    /// Runs a stage for paths with surfaces of one group: in place where these are half of the lanes of vectors, for
    /// copying costs more than lanes that are off, else on a copy of their data.
    fn call(&mut self, (stage, group): (usize, usize), paths: &PathSet) {
        self.call_stage(self.staged, (stage, group), paths);
    }

    /// The same for a stage of any program.
    pub fn call_stage(
        &mut self,
        staged: &StagedMethod,
        (stage, group): (usize, usize),
        paths: &PathSet,
    ) {
        if paths.is_dense() {
            return self.call_in_place(staged, (stage, group), paths);
        }
        let (kernel, _) = staged.kernel(stage, group);
        let next = staged.columns.next;
        for slots in paths.paths().chunks(CALL_PATHS) {
            self.frames.gather(kernel, slots);
            self.prepare_surfaces(kernel, Place::Copied(slots), slots);
            self.set_surfaces(staged, (stage, group), Place::Copied(slots));
            self.count_lanes(slots.len(), slots.len().next_multiple_of(self.width()));
            self.call_kernel(staged, (stage, group), Place::Copied(slots));
            if kernel.contributes {
                self.take_contributions(Place::Copied(slots));
            }
            self.frames.scatter(kernel, slots, next);
        }
    }

    /// Runs a stage on the arrays of all paths.
    fn call_in_place(
        &mut self,
        staged: &StagedMethod,
        (stage, group): (usize, usize),
        paths: &PathSet,
    ) {
        let count = self.wave.count;
        let is_masked = paths.len() < count;
        if is_masked {
            paths.store_mask(&mut self.frames.mask);
        }
        let (kernel, _) = staged.kernel(stage, group);
        let place = Place::All { paths, count, is_masked };
        self.set_surfaces(staged, (stage, group), place);
        self.count_lanes(paths.len(), paths.lanes_of_vectors(self.width()));
        if kernel.prepared.is_some() {
            self.prepare_surfaces(kernel, place, paths.paths());
        }
        self.call_kernel(staged, (stage, group), place);
        if kernel.contributes {
            self.take_contributions(place);
        }
    }

    pub fn width(&self) -> usize {
        self.tracer.scene.compiled.width as usize
    }

    pub fn count_lanes(&mut self, on: usize, all: usize) {
        self.queries.lane_use.add_vectors(on, all);
    }

    /// Sets the index of each path's surface among those of its group, if the group has several.
    fn set_surfaces(
        &mut self,
        staged: &StagedMethod,
        (stage, group): (usize, usize),
        place: Place<'_>,
    ) {
        let (_, objects) = staged.kernel(stage, group);
        if objects.len() < 2 {
            return;
        }
        let Frames { paths, surfaces, .. } = &mut *self.frames;
        let scratch = &paths.scratch;
        let surface = staged.program.stages()[stage].surface;
        if surface == StageSurface::None || staged.is_of_material() {
            let indices = &self.wave.objects;
            return set_objects(surfaces, place, |slot| indices[slot]);
        }
        if staged.finds_surfaces(stage) {
            let indices = scratch.words(staged.columns.surface_index);
            return take_objects(surfaces, place, (indices, objects.len()));
        }
        let [objects, _, elements] = staged.columns.surface(surface);
        let (objects, elements) = (scratch.words(objects), scratch.words(elements));
        let index = |slot: usize| staged.surface_of(objects[slot]).index_of(elements[slot]);
        set_objects(surfaces, place, index);
    }

    fn call_kernel(
        &mut self,
        staged: &StagedMethod,
        (stage, group): (usize, usize),
        place: Place<'_>,
    ) {
        let (kernel, objects) = staged.kernel(stage, group);
        let StagedPaths { tracer, exhausted, frames, wave, queries, free, depth, .. } = self;
        let rays = &mut *wave.rays;
        let Frames { paths, call, surfaces, mask, .. } = &mut **frames;
        let (Blocks { state, scratch }, count, mask, slots) = match place {
            Place::All { count, is_masked, .. } => {
                (paths, count, is_masked.then_some(&*mask), None)
            }
            Place::Copied(slots) => (call, slots.len(), None, Some(slots)),
        };
        let host = &mut SceneHost {
            tracer: *tracer,
            rays,
            slots,
            queries,
            free,
            depth: *depth,
            notes_suspects: false,
        };
        let instances = match objects.len() {
            0 | 1 => Instances::Object(objects, 0),
            _ => Instances::Many(objects, surfaces),
        };
        let program = &staged.program;
        let (class, method) = (&program.program().class().name, program.method());
        // The method that ran for too long is found later.
        let callee = Callee { class, method, errors: exhausted };
        let accepted = None;
        let call = CallArguments { state, scratch, count, mask, accepted, instances, host };
        callee.call(kernel.kernel.get(), call);
    }
}
