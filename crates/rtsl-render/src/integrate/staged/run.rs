//! Runs the stages of an integrator for a wavefront.

use std::cell::RefCell;
use std::ops::Range;

use rtsl::{CallArguments, END, Instances, ResumedBy, SPAWN_FLOATS, StageSurface};
use rtsl_bvh::{LANES, LaneMask};

use super::frames::{Blocks, Frames, set_objects, take_objects};
use super::path_set::PathSet;
use super::path_sets::PathSets;
use super::staged_method::StagedMethod;
use super::wave::Wave;
use crate::compiled::calls::Callee;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::integrate::host::{NO_OBJECT, SceneHost};
use crate::integrate::integrator_memory::IntegratorMemory;
use crate::integrate::memory::ThreadMemory;
use crate::integrate::numbers::Purpose;
use crate::integrate::path_tracer::PathTracer;
use crate::integrate::wavefront::Path;
use crate::schedule::tile_samples::{TileSamples, packets_of};

/// Paths on their way through the stages.
pub struct StagedPaths<'a> {
    pub tracer: PathTracer<'a>,
    /// The record of stages that exceeded their loop budget.
    pub exhausted: &'a RuntimeErrors,
    pub staged: &'a StagedMethod,
    pub frames: &'a mut Frames,
    pub wave: &'a mut Wave,
    /// The memory of queries and searches.
    pub queries: &'a mut ThreadMemory,
    /// The memory of further levels of recursion.
    pub free: &'a RefCell<Vec<IntegratorMemory>>,
    /// The depth of the paths' rays.
    pub depth: u32,
    /// True if the rays of adjacent paths are coherent.
    pub are_together: bool,
}

impl StagedPaths<'_> {
    /// Computes the camera rays of samples of some tiles; returns the paths of those whose pixels lie inside the image.
    pub fn load_samples(&mut self, samples: &[TileSamples]) -> PathSet {
        let scene = &self.tracer.scene.compiled;
        let Blocks { state, scratch } = &mut self.frames.paths;
        let (camera, errors) = (self.tracer.scene.camera(), self.tracer.errors);
        camera.generate(scene, errors, packets_of(samples), state, scratch);
        let size = (scene.settings.width, scene.settings.height);
        let lanes = packets_of(samples).map(|(samples, packet)| samples.lanes(packet, size));
        let active: Vec<LaneMask> = lanes.collect();
        let weights = self.staged.columns.weights.map(|array| scratch.floats(array));
        for (start, lanes) in (0..).step_by(LANES).zip(&active) {
            camera.lost_rays(errors, weights.map(|it| &it[start..start + LANES]), *lanes);
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
        self.call(0, active);
        self.add_contributions();
        let mut running = std::mem::take(&mut self.frames.running);
        let mut by_stage = std::mem::take(&mut self.frames.by_stage);
        let mut by_kernel = std::mem::take(&mut self.frames.by_kernel);
        running.set_same(active);
        while self.sort_by_stage(&running, &mut by_stage) && !self.must_stop() {
            by_stage.sets().for_each(|(stage, paths)| self.answer(stage, paths));
            self.sort_by_kernel(&by_stage, &mut by_kernel);
            self.call_last_kernels(&mut by_kernel);
            if self.should_move(&by_kernel) {
                self.move_paths(&mut running, &mut by_kernel);
            }
            by_kernel.sets().for_each(|(kernel, paths)| self.call(kernel, paths));
            self.add_contributions();
        }
        self.return_results(&running);
        let frames = &mut *self.frames;
        (frames.running, frames.by_stage, frames.by_kernel) = (running, by_stage, by_kernel);
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
        by_stage.begin(stages);
        by_stage.sort(paths, next, 0..stages);
        by_stage.sets().next().is_some()
    }

    /// Sorts the paths of stages by the kernels of these for the groups of their surfaces.
    fn sort_by_kernel(&mut self, by_stage: &PathSets, by_kernel: &mut PathSets) {
        by_kernel.begin(self.staged.kernel_count());
        for (stage, paths) in by_stage.sets() {
            let kernels = self.staged.kernels_of(stage);
            let surface = self.staged.program.stages()[stage].surface;
            if kernels.len() == 1 {
                by_kernel.set(kernels.start, paths);
            } else if self.staged.finds_surfaces(stage) {
                let groups = self.frames.paths.scratch.words(self.staged.columns.group);
                by_kernel.sort(paths, groups, kernels);
            } else {
                let mut groups = std::mem::take(&mut self.frames.groups);
                self.find_groups(surface, paths, &mut groups);
                by_kernel.sort(paths, &groups, kernels);
                self.frames.groups = groups;
            }
        }
    }

    /// Runs the kernels after which all paths end, and takes these out of the sets: they need not be moved.
    fn call_last_kernels(&mut self, by_kernel: &mut PathSets) {
        for (kernel, paths) in by_kernel.sets() {
            if self.staged.ends_paths(kernel) {
                self.call(kernel, paths);
            }
        }
        by_kernel.retain(|kernel| !self.staged.ends_paths(kernel));
    }

    /// True if kernels take longer for the lanes without paths in the vectors of these sets than it takes to move the
    /// paths together.
    fn should_move(&self, by_kernel: &PathSets) -> bool {
        /// The time to move a word of a path, in the time of an operation on a vector.
        const MOVED_WORD: usize = 1;
        let width = self.width();
        let (mut paths, mut operations) = (0, 0);
        for (kernel, set) in by_kernel.sets() {
            let vectors = set.lanes_of_vectors(width) / width - set.len().div_ceil(width);
            operations += self.staged.operations_of(kernel) * vectors;
            paths += set.len();
        }
        operations > paths * self.staged.moved.read.len() * MOVED_WORD
    }

    fn move_paths(&mut self, running: &mut PathSet, by_kernel: &mut PathSets) {
        // Contributions know the lanes of their paths.
        self.add_contributions();
        let moved = &self.staged.moved;
        self.wave.lanes = self.frames.move_paths(moved, running, by_kernel);
    }

    fn return_results(&mut self, running: &PathSet) {
        self.frames.return_results(&self.staged.moved, running);
        self.wave.lanes = self.wave.count;
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
        let ThreadMemory { shadow_rays, reached, .. } = &mut *self.queries;
        let Frames { paths, moved, .. } = &mut *self.frames;
        let (blocks, paths) = match self.staged.moved.has_light {
            true => (paths, None),
            false => moved.loaded(paths),
        };
        for (array, colors) in self.staged.columns.lit.iter().zip(&shadow_rays.colors) {
            let sums = blocks.scratch.floats_mut(*array);
            for index in &*reached {
                let index = *index as usize;
                let lane = shadow_rays.paths[index] as usize;
                sums[paths.map_or(lane, |paths| paths[lane] as usize)] += colors[index];
            }
        }
        shadow_rays.clear();
    }

    /// Notes the contributions that a call for these paths has made at a place.
    fn take_contributions(&mut self, place: usize, paths: &PathSet) {
        let StagedPaths { frames, wave, queries, staged, .. } = self;
        let Frames { paths: Blocks { scratch, .. }, contributing, moved, .. } = &mut **frames;
        let columns = staged.columns.contributions[place].map(|array| scratch.floats(array));
        let [.., red, green, blue] = columns;
        let ThreadMemory { shadow_rays, .. } = &mut **queries;
        contributing.set_nonzero(paths, [red, green, blue]);
        shadow_rays.paths.extend_from_slice(contributing.paths());
        contributing.append([(scratch.floats(staged.columns.time), &mut shadow_rays.times)]);
        contributing.append(columns.into_iter().zip(shadow_rays.columns_mut()));
        if wave.rays.is_empty() {
            return shadow_rays.sequences.resize(shadow_rays.paths.len(), [0; 2]);
        }
        shadow_rays.sequences.extend(contributing.paths().iter().map(|lane| {
            let numbers = &mut wave.rays[moved.path_in(*lane)].numbers;
            [numbers.begin(Purpose::ShadowRay), numbers.sample]
        }));
    }

    /// Runs a kernel, which is for the surfaces of one group, for paths.
    fn call(&mut self, kernel: usize, paths: &PathSet) {
        self.call_kernel(self.staged, kernel, paths);
    }

    /// Runs the kernel with this index among those of the stages of any program.
    pub fn call_kernel(&mut self, staged: &StagedMethod, index: usize, paths: &PathSet) {
        let kernel = staged.kernel(index);
        self.set_surfaces(staged, index, paths);
        self.prepare_surfaces(kernel, paths);
        self.set_mask(paths);
        self.call_prepared(staged, index, paths);
        (0..kernel.contributions).for_each(|place| self.take_contributions(place, paths));
        (0..kernel.spawns).for_each(|place| self.take_spawned(place, paths));
    }

    /// Notes the paths that a call for these paths has spawned at a place.
    fn take_spawned(&mut self, place: usize, paths: &PathSet) {
        let StagedPaths { frames, wave, queries, staged, tracer, .. } = self;
        let Frames { paths: Blocks { scratch, .. }, contributing, importance, moved, .. } =
            &mut **frames;
        let columns = &staged.columns;
        let arrays = columns.spawns[place];
        let (floats, words) = arrays.split_at(SPAWN_FLOATS);
        let [ends @ .., red, green, blue, bound] = floats else { unreachable!("they are more") };
        let bounds = &scratch.floats(*bound)[..wave.lanes];
        let Range { start, end } = paths.range();
        wave.spawning.weigh(bounds, moved.paths(), start..end.min(wave.lanes), importance);
        let cutoff = tracer.scene.compiled.settings.cutoff;
        contributing.set_followed(paths, importance, cutoff);
        let spawned = &mut queries.spawned;
        let throughput = [red, green, blue].into_iter().zip(&mut spawned.throughput);
        let numbers = ends.iter().zip(&mut spawned.ends).chain(throughput);
        let numbers = numbers.chain([(&columns.time, &mut spawned.times)]);
        let numbers = numbers.map(|(array, to)| (scratch.floats(*array), to));
        contributing.append(numbers.chain([(&importance[..], &mut spawned.importance)]));
        let first = spawned.parents.len();
        contributing.append_words([
            (scratch.words(words[0]), &mut spawned.keys),
            (scratch.words(columns.sample), &mut spawned.samples),
            (scratch.words(words[1]), &mut spawned.depths),
        ]);
        spawned.depths[first..].iter_mut().for_each(|before| *before += self.depth + 1);
        match moved.paths() {
            Some(paths) => contributing.append_words([(paths, &mut spawned.parents)]),
            None => spawned.parents.extend_from_slice(contributing.paths()),
        }
    }

    /// Sets the mask of a call for these paths, if it needs one, and counts its lanes.
    pub fn set_mask(&mut self, paths: &PathSet) {
        if self.is_masked(paths) {
            paths.store_mask(&mut self.frames.mask, self.wave.lanes);
        }
        let all = paths.lanes_of_vectors(self.width());
        self.queries.lane_use.add_vectors(paths.len(), all);
    }

    /// True if there are other lanes than those of these paths.
    pub fn is_masked(&self, paths: &PathSet) -> bool {
        paths.len() < self.wave.lanes
    }

    pub fn width(&self) -> usize {
        self.tracer.scene.compiled.width as usize
    }

    /// Sets the index of each path's surface among those of its group, if the group has several.
    fn set_surfaces(&mut self, staged: &StagedMethod, kernel: usize, paths: &PathSet) {
        let (stage, objects) = (staged.stage_of(kernel), staged.objects_of(kernel));
        if objects.len() < 2 {
            return;
        }
        let Frames { paths: Blocks { scratch, .. }, surfaces, moved, .. } = &mut *self.frames;
        let surface = staged.program.stages()[stage].surface;
        if surface == StageSurface::None || staged.is_of_material() {
            let indices = &self.wave.objects;
            return set_objects(surfaces, paths, |lane| indices[moved.path_in(lane)]);
        }
        if staged.finds_surfaces(stage) {
            let indices = scratch.words(staged.columns.surface_index);
            return take_objects(surfaces, paths, indices, objects.len());
        }
        let [objects, _, elements] = staged.columns.surface(surface);
        let (objects, elements) = (scratch.words(objects), scratch.words(elements));
        set_objects(surfaces, paths, |lane| {
            let lane = lane as usize;
            staged.surface_of(objects[lane]).index_of(elements[lane])
        });
    }

    /// Calls a kernel once surfaces and mask are set.
    fn call_prepared(&mut self, staged: &StagedMethod, kernel: usize, paths: &PathSet) {
        let (kernel, objects) = (staged.kernel(kernel), staged.objects_of(kernel));
        let is_masked = self.is_masked(paths);
        let StagedPaths { tracer, exhausted, frames, wave, queries, free, depth, .. } = self;
        let rays = &mut *wave.rays;
        let Frames { paths: Blocks { state, scratch }, surfaces, mask, moved, .. } = &mut **frames;
        let host = &mut SceneHost {
            tracer: *tracer,
            rays,
            slots: moved.paths(),
            queries,
            free,
            depth: *depth,
            notes_suspects: false,
            is_of_stages: true,
        };
        let instances = match objects.len() {
            0 | 1 => Instances::Object(objects, 0),
            _ => Instances::Many(objects, surfaces),
        };
        let program = &staged.program;
        let (class, method) = (&program.program().class().name, program.method());
        // The method that ran for too long is found later.
        let callee = Callee { class, method, errors: exhausted };
        let (count, mask, accepted) = (wave.lanes, is_masked.then_some(&*mask), None);
        let call = CallArguments { state, scratch, count, mask, accepted, instances, host };
        callee.call(kernel.kernel.get(), call);
    }
}
