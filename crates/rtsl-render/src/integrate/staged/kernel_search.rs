//! Searches by kernels that test each ray against all objects of a scene.

use rtsl::host::NoHost;
use rtsl::{CallArguments, Instances, Objects, ResumedBy, StageKernel};

use super::answers::WORDS;
use super::columns::Columns;
use super::frames::{Blocks, CALL_RAYS, Frames};
use super::path_set::PathSet;
use super::run::StagedPaths;
use crate::compiled::calls::Callee;
use crate::integrate::host::{Ray, first_hit};
use crate::integrate::memory::ThreadMemory;
use crate::integrate::path_tracer::PathTracer;

/// The operands of a request for visibility.
const ENDS: usize = ResumedBy::Occluded.request().len();

impl StagedPaths<'_> {
    /// Notes the searches of paths that the stages before have made.
    pub fn note_stage_searches(&mut self, paths: &PathSet) {
        if !self.wave.first_hits.is_empty() {
            self.note_first_hits(paths.paths());
        }
        if self.is_anyone_told_of_searches() {
            self.tell_of_searches(paths.paths());
        }
    }

    /// Counts the searches that the stages of these paths have made.
    pub fn count_stage_searches(&mut self, paths: &PathSet) {
        let Columns { searches, shadow_rays, .. } = self.staged.columns;
        let scratch = &self.frames.paths.scratch;
        let [searches, shadow_rays] =
            [searches, shadow_rays].map(|array| paths.sum(scratch.words(array), u64::from));
        let rays = &mut self.queries.rays;
        rays.traced += searches;
        rays.shadow += shadow_rays;
    }

    /// Answers searches of paths, and counts them.
    pub fn search_by_kernel(&mut self, kernel: &StageKernel, objects: &Objects, paths: &PathSet) {
        self.set_mask(paths);
        let is_masked = self.is_masked(paths);
        self.call_search(kernel, objects, CalledRays::All { is_masked });
        if !self.wave.first_hits.is_empty() {
            self.note_first_hits(paths.paths());
        }
        self.note_searches(paths.paths());
    }

    /// Traces the waiting shadow rays, and notes those that nothing blocks.
    pub fn trace_shadow_rays(&mut self) {
        let staged = self.staged;
        let Some((kernel, objects)) = staged.any_search().zip(staged.searched_objects()) else {
            let PathTracer { scene, errors, .. } = self.tracer;
            return self.queries.trace_shadow_rays(scene, errors);
        };
        let count = self.queries.shadow_rays.len();
        self.queries.rays.shadow += count as u64;
        self.queries.reached.clear();
        for start in (0..count).step_by(CALL_RAYS) {
            let end = count.min(start + CALL_RAYS);
            let ThreadMemory { shadow_rays, .. } = &*self.queries;
            let scratch = &mut self.frames.shadow_rays.scratch;
            let columns = shadow_rays.ends.iter().chain([&shadow_rays.times]);
            let arrays = staged.columns.requests[..ENDS].iter().chain([&staged.columns.time]);
            for (column, array) in columns.zip(arrays) {
                let to = scratch.floats_mut(*array);
                to[..end - start].copy_from_slice(&column[start..end]);
            }
            let lanes = (end - start).next_multiple_of(self.width());
            self.queries.lane_use.add_vectors(end - start, lanes);
            let rays = CalledRays::Shadow(end - start);
            self.call_search(kernel, objects, rays);
            let answers = self.frames.shadow_rays.scratch.words(staged.columns.answers[0]);
            let free = (start as u32..).zip(&answers[..end - start]);
            let free = free.filter(|(_, is_occluded)| **is_occluded == 0);
            self.queries.reached.extend(free.map(|(index, _)| index));
        }
    }

    fn call_search(&mut self, kernel: &StageKernel, objects: &Objects, rays: CalledRays) {
        let StagedPaths { exhausted, frames, wave, staged, .. } = self;
        let Frames { paths, shadow_rays, mask, .. } = &mut **frames;
        let (Blocks { state, scratch }, count, mask) = match rays {
            CalledRays::All { is_masked } => (paths, wave.lanes, is_masked.then_some(&*mask)),
            CalledRays::Shadow(count) => (shadow_rays, count, None),
        };
        let class = &staged.program.program().class().name;
        // The method that ran for too long is found later.
        let callee = Callee { class, method: staged.program.method(), errors: exhausted };
        let instances = Instances::Object(objects, 0);
        let (accepted, host) = (None, &mut NoHost);
        let arguments = CallArguments { state, scratch, count, mask, accepted, instances, host };
        callee.call(kernel.kernel.get(), arguments);
    }

    /// Notes the distances and the objects of the first hits of these paths.
    fn note_first_hits(&mut self, slots: &[u32]) {
        let scratch = &self.frames.paths.scratch;
        let [found, object, _, _, distance] = ANSWERS.map(|it| self.staged.columns.answers[it]);
        let (found, objects) = (scratch.words(found), scratch.words(object));
        let distances = scratch.floats(distance);
        for slot in slots {
            let at = *slot as usize;
            if self.searches_of(*slot) == 1 && found[at] != 0 {
                let (Ray { direction, .. }, _) = self.requested(*slot);
                let hit = first_hit(direction, distances[at], objects[at]);
                self.wave.first_hits[self.frames.path_in(*slot)] = Some(hit);
            }
        }
    }
}

/// The indices of the answers to a search.
const ANSWERS: [usize; WORDS] = [0, 1, 2, 3, 4];

/// The rays of a call.
#[derive(Clone, Copy)]
enum CalledRays {
    /// Those of the paths of the wavefront, or of those that the mask selects.
    All { is_masked: bool },
    /// So many in the arrays of shadow rays.
    Shadow(usize),
}
