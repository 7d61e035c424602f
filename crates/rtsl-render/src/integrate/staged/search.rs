//! Searches for the nearest hits of the rays that paths request.

use rtsl::{RayType, ResumedBy};
use rtsl_bvh::{HitId, LANES, LaneMask, RAYS_OF_STREAM, RayPacket, Search};

use super::answers::{AnsweredHit, WORDS};
use super::columns::Columns;
use super::frames::{Blocks, Frames};
use super::path_set::PathSet;
use super::requests::Requested;
use super::run::StagedPaths;
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::placed_objects::HitObject;
use crate::compiled::tracer::Tracer;
use crate::integrate::host::{Ray, first_hit};
use crate::integrate::memory::ThreadMemory;
use crate::integrate::numbers::count_after;
use crate::integrate::path_tracer::PathTracer;
use crate::integrate::searcher::Searcher;
use crate::integrate::wavefront::{NO_INSTANCE, Path, PathHit};

/// The number of operands of a search.
const REQUEST: usize = ResumedBy::NearestHit.request().len();

/// The index among them of the least distance of hits; 0 means that of the scene.
const EPSILON: usize = 6;

impl StagedPaths<'_> {
    /// Finds the nearest hits of the requested rays.
    pub fn search(&mut self, paths: &PathSet) {
        let are_together = std::mem::take(&mut self.are_together);
        let scene = self.tracer.scene;
        let staged = self.staged;
        if staged.program.searches_at_end() {
            return self.note_stage_searches(paths);
        }
        if let Some((kernel, objects)) = staged.nearest_search().zip(staged.searched_objects()) {
            return self.search_by_kernel(kernel, objects, paths);
        }
        let slots = paths.paths();
        self.collect_requests(paths);
        self.leave_surfaces(slots);
        let starts = 0..slots.len();
        if !are_together && scene.compiled.geometry.suits_stream(slots.len()) {
            starts.step_by(RAYS_OF_STREAM).for_each(|start| self.search_stream(start, slots));
        } else {
            starts.step_by(LANES).for_each(|start| self.search_packet(start, slots));
        }
        if !self.frames.cut.is_empty() {
            self.search_past_alpha();
        }
        self.count_searches(slots);
    }

    /// Copies the requested rays to adjacent lanes, each with its least distance of hits.
    fn collect_requests(&mut self, paths: &PathSet) {
        let Columns { requests, time, .. } = &self.staged.columns;
        let Frames { paths: Blocks { scratch, .. }, requests: collected, .. } = &mut *self.frames;
        collected.iter_mut().for_each(Vec::clear);
        let columns = requests[..REQUEST].iter().chain([time]).map(|array| scratch.floats(*array));
        paths.append(columns.zip(collected));
        let epsilon_of_scene = self.tracer.scene.compiled.epsilon;
        for epsilon in &mut self.frames.requests[EPSILON] {
            *epsilon = if *epsilon > 0.0 { *epsilon } else { epsilon_of_scene };
        }
    }

    /// Moves the origins of collected rays off the surfaces that materials shade.
    fn leave_surfaces(&mut self, slots: &[u32]) {
        let Frames { paths: Blocks { scratch, .. }, requests, .. } = &mut *self.frames;
        let requested = Requested::of(scratch, self.staged);
        if let Some(ends) = requests.first_chunk_mut() {
            requested.leave_surfaces(slots, &mut self.queries.shading_calls, ends);
        }
    }

    /// Finds the hits of a packet of collected rays, whose first is `start`.
    fn search_packet(&mut self, start: usize, slots: &[u32]) {
        let slots = &slots[start..slots.len().min(start + LANES)];
        let Searcher { memory, packet, .. } = &mut self.queries.searcher;
        let RayPacket { origin, direction, epsilon, limit, time } = &mut **packet;
        let lanes = origin.iter_mut().chain(direction).chain([epsilon, limit, time]);
        for (lanes, column) in lanes.zip(&self.frames.requests) {
            lanes[..slots.len()].copy_from_slice(&column[start..start + slots.len()]);
        }
        let lanes = LaneMask::MAX >> (LANES - slots.len());
        let tracer = Tracer { scene: &self.tracer.scene.compiled, errors: self.tracer.errors };
        let found = tracer.nearest(memory, packet, lanes);
        let hits = found.lanes(lanes);
        let hit = |lane: usize| {
            let is_hit = hits >> lane & 1 != 0;
            let answer = || answered_hit(tracer.scene, found.distance[lane], found.id[lane]);
            is_hit.then(answer).flatten()
        };
        self.frames.answers.set(slots.len(), hit);
        self.note_cut_hits(slots);
        self.store_answers(slots);
    }

    /// Finds the hits of a stream of collected rays, whose first is `start`.
    fn search_stream(&mut self, start: usize, slots: &[u32]) {
        let end = slots.len().min(start + RAYS_OF_STREAM);
        let Searcher { memory, stream, .. } = &mut self.queries.searcher;
        let requests = self.frames.requests.each_ref().map(|column| &column[start..end]);
        let [ends @ .., epsilon, limits, times] = requests;
        stream.load(ends, |ray| epsilon[ray], limits, times);
        let tracer = Tracer { scene: &self.tracer.scene.compiled, errors: self.tracer.errors };
        tracer.search_stream(memory, stream, Search::Closest);
        let hit = |place: usize| {
            let (distance, id) = stream.hit(place)?;
            answered_hit(tracer.scene, distance, id)
        };
        self.frames.answers.set(end - start, hit);
        self.note_cut_hits(&slots[start..end]);
        self.store_answers(&slots[start..end]);
    }

    /// Notes the answered hits of objects with alpha textures.
    fn note_cut_hits(&mut self, slots: &[u32]) {
        let scene = self.tracer.scene;
        if !scene.has_alpha() {
            return;
        }
        let Frames { answers, cut, .. } = &mut *self.frames;
        let is_cut = |[object, ..]: &AnsweredHit| {
            scene.groups[scene.objects[*object as usize].group as usize].alpha.is_some()
        };
        let hits = slots.iter().enumerate().filter_map(|(ray, slot)| {
            let hit = answers.hit(ray).filter(is_cut)?;
            Some((*slot, hit))
        });
        cut.extend(hits);
    }

    /// Finds the hits behind those noted surfaces that let rays pass.
    fn search_past_alpha(&mut self) {
        let epsilon_of_scene = self.tracer.scene.compiled.epsilon;
        let cut = std::mem::take(&mut self.frames.cut);
        let mut paths = std::mem::take(&mut self.queries.wavefront.paths);
        paths.clear();
        for (slot, [.., distance]) in &cut {
            let (mut ray, epsilon) = self.requested(*slot);
            let state = &self.wave.rays[self.frames.path_in(*slot)];
            let calls = &mut self.queries.shading_calls;
            ray.origin = calls.leave(state.surface.as_ref(), ray.origin, ray.direction);
            let path = state.search_path(&ray, epsilon, epsilon_of_scene);
            paths.push(Path { distance: f32::from_bits(*distance), ..path });
        }
        let ThreadMemory { wavefront, searcher, batch, .. } = &mut *self.queries;
        wavefront.paths = paths;
        wavefront.features.reset(0, None);
        wavefront.active.clear();
        wavefront.left.clear();
        wavefront.hits.clear();
        for (path, (_, [object, instance, element, _])) in (0..).zip(&cut) {
            let (object, instance, element) = (*object, *instance, *element);
            wavefront.hits.push(PathHit { path, object, element, instance });
        }
        searcher.are_together = false;
        let PathTracer { scene, errors, .. } = self.tracer;
        searcher.pass_transparent(scene, errors, wavefront, batch);
        let mut hits = vec![None; cut.len()];
        for hit in &wavefront.hits {
            let bits = wavefront.paths[hit.path as usize].distance.to_bits();
            hits[hit.path as usize] = Some([hit.object, hit.instance, hit.element, bits]);
        }
        self.frames.answers.set(cut.len(), |ray| hits[ray]);
        let slots: Vec<u32> = cut.iter().map(|(slot, _)| *slot).collect();
        self.store_answers(&slots);
        self.frames.cut = cut;
        self.frames.cut.clear();
    }

    /// Stores the answers to the searches of paths.
    fn store_answers(&mut self, slots: &[u32]) {
        let Frames { paths: Blocks { scratch, .. }, answers, .. } = &mut *self.frames;
        // Samples of lights, for which stages may wait too, have more answers.
        let read = self.staged.read_answers().iter().filter(|(word, _)| *word < WORDS);
        for (word, array) in read {
            answers.store(*word, slots, scratch.words_mut(*array));
        }
        if self.wave.first_hits.is_empty() {
            return;
        }
        for (ray, slot) in slots.iter().enumerate() {
            if self.searches_of(*slot) == 0 {
                let (Ray { direction, .. }, _) = self.requested(*slot);
                let hit = self.frames.answers.hit(ray).map(|[object, .., distance]| {
                    first_hit(direction, f32::from_bits(distance), object)
                });
                self.wave.first_hits[self.frames.path_in(*slot)] = hit;
            }
        }
    }

    /// Returns the number of searches of a path.
    pub fn searches_of(&self, slot: u32) -> u32 {
        self.frames.paths.scratch.words(self.staged.columns.searches)[slot as usize]
    }

    /// Counts a search of each path, and tells the stages.
    fn count_searches(&mut self, slots: &[u32]) {
        let scratch = &mut self.frames.paths.scratch;
        for slot in slots {
            let searches = &mut scratch.words_mut(self.staged.columns.searches)[*slot as usize];
            *searches = searches.wrapping_add(1);
            let counted = count_after(*searches);
            for array in self.staged.read_counts() {
                scratch.words_mut(*array)[*slot as usize] = counted;
            }
        }
        self.note_searches(slots);
    }

    /// Counts the searches of paths, and tells hosts and stages of them.
    pub fn note_searches(&mut self, slots: &[u32]) {
        self.queries.rays.traced += slots.len() as u64;
        self.tell_of_searches(slots);
    }

    /// True if hosts or stages have to know of searches.
    pub fn is_anyone_told_of_searches(&self) -> bool {
        self.staged.shades()
            || !self.wave.rays.is_empty()
            || self.staged.reads_depths()
            || self.staged.reads_ray_types()
    }

    /// Tells hosts and stages of searches that are counted.
    pub fn tell_of_searches(&mut self, slots: &[u32]) {
        let Frames { paths: Blocks { scratch, .. }, moved, .. } = &mut *self.frames;
        let array = self.staged.columns.searches;
        let rays = &mut self.wave.rays;
        if self.staged.shades() {
            let searches = scratch.words(array);
            for slot in slots {
                let path = moved.path_in(*slot);
                self.wave.spawning.begin_search(path, searches[*slot as usize]);
            }
        }
        if !rays.is_empty() {
            slots.iter().for_each(|slot| rays[moved.path_in(*slot)].count_search());
        }
        let mut set = |column: usize, number: fn(u32, u32) -> f32| {
            for slot in slots {
                let before = scratch.words(array)[*slot as usize].saturating_sub(1);
                scratch.floats_mut(column)[*slot as usize] = number(self.depth, before);
            }
        };
        if self.staged.reads_depths() {
            set(self.staged.columns.depth, |depth, before| (depth + before) as f32);
        }
        if self.staged.reads_ray_types() {
            set(self.staged.columns.ray_type, |depth, before| RayType::of(depth, before).value());
        }
    }

    /// Takes the first rays of paths out of the number of rays that were traced.
    pub fn discount_first_searches(&mut self, active: &PathSet) {
        if self.staged.is_of_material() {
            return;
        }
        let searches = self.frames.paths.scratch.words(self.staged.columns.searches);
        let first = active.sum(searches, |searches| u64::from(searches > 0));
        self.queries.rays.traced -= first;
    }
}

/// Returns the answer for a hit at a distance.
#[inline(always)]
fn answered_hit(scene: &CompiledScene, distance: f32, id: HitId) -> Option<AnsweredHit> {
    let hit = HitObject::of(&scene.geometry, &scene.items, id)?;
    let instance = hit.instance.unwrap_or(NO_INSTANCE);
    Some([hit.member.object, instance, hit.element, distance.to_bits()])
}
