//! Answers to the requests of paths other than searches.

use std::array;

use rtsl::{LaneBlock, MAX_ANSWERS, ResumedBy, SURFACE_SCALARS};

use super::columns::Columns;
use super::frames::{Blocks, Frames};
use super::path_set::PathSet;
use super::run::StagedPaths;
use super::staged_method::StagedMethod;
use super::wave::ray_components;
use crate::compiled::variables::variables;
use crate::integrate::host::{Further, Ray, is_traced};
use crate::integrate::light_sample::{
    LIGHT_SCALARS, LightAtPoint, LightPoint, report_light, sample_for_shade,
};
use crate::integrate::memory::ThreadMemory;
use crate::integrate::numbers::Purpose;
use crate::integrate::path_tracer::PathTracer;
use crate::integrate::rows::are_finite;
use crate::integrate::shaded_surface::ShadedSurface;
use crate::integrate::shading::{DeferredLight, RayOfShading, ShadingRequest};
use crate::integrate::shading_texts::ShadingCalls;
use crate::integrate::shadow_rays::ShadowRays;

/// The number of operands of a request for a ray: its origin and direction.
const ENDS: usize = 6;

/// The number of columns with the point, the offset and the geometric normal of a shaded surface, which come first.
const SHADED: usize = 7;

/// The port of the index of a light in requests for samples.
const LIGHT_INDEX: usize = ResumedBy::LightSample.request()[0] as usize;

/// The arrays with rays.
struct RayColumns {
    /// Origin and direction.
    ends: [usize; ENDS],
    /// The greatest parameter.
    limit: usize,
    /// The time within the shutter.
    time: usize,
}

/// The arrays of paths that request rays.
#[derive(Clone, Copy)]
pub struct Requested<'a> {
    scratch: &'a LaneBlock,
    columns: &'a Columns,
    /// The surfaces that the paths shade and their rays leave, if the paths are of a material.
    shaded: Option<[&'a [f32]; SHADED]>,
}

impl<'a> Requested<'a> {
    pub fn of(scratch: &'a LaneBlock, staged: &'a StagedMethod) -> Requested<'a> {
        let columns = &staged.columns;
        let shaded = staged.is_of_material();
        let shaded = shaded.then(|| array::from_fn(|it| scratch.floats(columns.shaded[it])));
        Requested { scratch, columns, shaded }
    }

    /// Appends shadow rays of some paths to columns that have none yet.
    fn append_rays(
        &self,
        slots: &[u32],
        ray: &RayColumns,
        calls: &mut ShadingCalls,
        to: &mut ShadowRays,
    ) {
        let [ends @ .., limits] = &mut to.ends;
        self.append_ends(slots, &ray.ends, calls, ends);
        let gather = |array: usize| {
            let column = self.scratch.floats(array);
            slots.iter().map(|slot| column[*slot as usize])
        };
        limits.extend(gather(ray.limit));
        to.times.extend(gather(ray.time));
        to.colors.iter_mut().for_each(|column| column.resize(slots.len(), 1.0));
        to.paths.extend_from_slice(slots);
        to.sequences.resize(slots.len(), [0; 2]);
    }

    /// Appends the origins and directions of the rays of some paths to columns that have none yet.
    fn append_ends(
        &self,
        slots: &[u32],
        of: &[usize; ENDS],
        calls: &mut ShadingCalls,
        ends: &mut [Vec<f32>; ENDS],
    ) {
        for (column, array) in ends.iter_mut().zip(of) {
            let numbers = self.scratch.floats(*array);
            column.extend(slots.iter().map(|slot| numbers[*slot as usize]));
        }
        self.leave_surfaces(slots, calls, ends);
    }

    /// Moves the origins of rays of some paths off the surfaces that these shade.
    pub fn leave_surfaces(
        &self,
        slots: &[u32],
        calls: &mut ShadingCalls,
        ends: &mut [Vec<f32>; ENDS],
    ) {
        let Some(shaded) = &self.shaded else { return };
        let (origins, directions) = ends.split_at_mut(3);
        let [x, y, z] = [0, 1, 2].map(|axis| origins[axis].clone());
        let ray = |index: usize| {
            let direction = [0, 1, 2].map(|axis: usize| directions[axis][index]);
            (surface_of(shaded, slots[index]), [x[index], y[index], z[index]], direction)
        };
        calls.leave_all(slots.len(), ray, |index, origin| {
            (0..3).for_each(|axis| origins[axis][index] = origin[axis]);
        });
    }

    /// Returns the surface that a path shades; `None` if no path shades any.
    pub fn shaded(&self, slot: u32) -> Option<ShadedSurface> {
        Some(surface_of(self.shaded.as_ref()?, slot))
    }

    /// Loads the rays of some paths as paths of other stages, without their keys.
    fn load(
        &self,
        slots: &[u32],
        epsilon: f32,
        calls: &mut ShadingCalls,
        frames: &mut Frames,
        columns: &Columns,
    ) {
        let Blocks { state, scratch } = &mut frames.paths;
        let v = variables();
        let mut ends: [Vec<f32>; ENDS] = Default::default();
        let of = array::from_fn(|index| self.columns.requests[index]);
        self.append_ends(slots, &of, calls, &mut ends);
        for (component, ..) in ray_components() {
            state.floats_mut(component)[..slots.len()].fill(0.0);
        }
        for axis in 0..3 {
            state.floats_mut(v.ray_origin + axis)[..slots.len()].copy_from_slice(&ends[axis]);
            state.floats_mut(v.ray_direction + axis)[..slots.len()]
                .copy_from_slice(&ends[3 + axis]);
        }
        state.floats_mut(v.epsilon)[..slots.len()].fill(epsilon);
        let gather = |from: &[u32], to: &mut [u32]| {
            to.iter_mut().zip(slots).for_each(|(to, slot)| *to = from[*slot as usize]);
        };
        let limits = self.scratch.words(self.columns.requests[ENDS]);
        gather(limits, state.words_mut(v.hit_distance));
        let times = self.scratch.words(self.columns.time);
        gather(times, state.words_mut(v.time_seed));
        gather(times, scratch.words_mut(columns.time));
        gather(self.scratch.words(self.columns.sample), scratch.words_mut(columns.sample));
    }
}

impl StagedPaths<'_> {
    /// Returns the ray along which a path searches, and the least distance of hits.
    pub fn requested(&self, slot: u32) -> (Ray, f32) {
        let requests = &self.staged.columns.requests;
        let scratch = &self.frames.paths.scratch;
        let number = |index: usize| scratch.floats(requests[index])[slot as usize];
        let (origin, direction) = ([0, 1, 2].map(number), [3, 4, 5].map(number));
        (Ray { origin, direction, limit: number(7) }, number(6))
    }

    /// Finds out which of the requested rays are blocked.
    pub fn find_occluded(&mut self, slots: &[u32]) {
        let Columns { requests, time, .. } = self.staged.columns;
        let ends = array::from_fn(|index| requests[index]);
        let ray = RayColumns { ends, limit: requests[ENDS], time };
        let requested = Requested::of(&self.frames.paths.scratch, self.staged);
        let ThreadMemory { shadow_rays, shading_calls, .. } = &mut *self.queries;
        requested.append_rays(slots, &ray, shading_calls, shadow_rays);
        self.count_shadow_rays(slots);
        self.trace_shadow_rays();
        let answers = self.frames.paths.scratch.words_mut(self.staged.columns.answers[0]);
        slots.iter().for_each(|slot| answers[*slot as usize] = u32::MAX);
        let ThreadMemory { shadow_rays, reached, .. } = &mut *self.queries;
        for index in reached {
            answers[shadow_rays.paths[*index as usize] as usize] = 0;
        }
        shadow_rays.clear();
    }

    /// Begins the random sequences of the shadow rays that these paths request, which alpha textures need.
    fn count_shadow_rays(&mut self, slots: &[u32]) {
        if self.tracer.scene.has_alpha() {
            let sequences = &mut self.queries.shadow_rays.sequences;
            for (slot, sequence) in slots.iter().zip(sequences) {
                let numbers = &mut self.wave.rays[self.frames.path_in(*slot)].numbers;
                *sequence = [numbers.begin(Purpose::ShadowRay), numbers.sample];
            }
        }
    }

    /// Computes the radiance along the requested rays.
    pub fn trace(&mut self, slots: &[u32]) {
        let depth = self.depth + 1;
        let (traced, keys, importance) = self.begin_children(slots);
        let further = Further { tracer: &self.tracer, free: self.free };
        let mut colors = vec![[0.0; 3]; traced.len()];
        if let Some(staged) = &self.tracer.scene.integrator.staged
            && self.tracer.scene.is_traced_at(depth)
            && !traced.is_empty()
        {
            let requested = Requested::of(&self.frames.paths.scratch, self.staged);
            let epsilon = self.tracer.scene.compiled.epsilon;
            let calls = &mut self.queries.shading_calls;
            let counts = further.with_memory(|memory| {
                let load = |run: &mut StagedPaths<'_>| {
                    requested.load(&traced, epsilon, calls, run.frames, &staged.columns);
                    let own_keys = run.frames.paths.scratch.words_mut(staged.columns.key);
                    own_keys[..keys.len()].copy_from_slice(&keys);
                    run.wave.spawning.importance.copy_from_slice(&importance);
                };
                let mut counts = self.tracer.run_loaded(staged, load, memory, depth, &mut colors);
                counts.traced += traced.len() as u64;
                counts
            });
            self.queries.rays += counts;
        }
        self.store_colors(slots, &traced, &colors);
        for (slot, color) in traced.iter().zip(&colors) {
            let is_spoilt = color.iter().any(|channel| !channel.is_finite());
            self.wave.spawning.is_spoilt[self.frames.path_in(*slot)] |= is_spoilt;
        }
    }

    /// Begins the paths of requested rays: returns the paths that spawn those of enough weight, and the keys and the
    /// bounds of weights of these.
    fn begin_children(&mut self, slots: &[u32]) -> (Vec<u32>, Vec<u32>, Vec<f32>) {
        let cutoff = self.tracer.scene.compiled.settings.cutoff;
        let StagedPaths { frames, wave, staged, .. } = self;
        let scratch = &frames.paths.scratch;
        let weights = scratch.floats(staged.columns.requests[ENDS + 1]);
        let keys = scratch.words(staged.columns.key);
        let (mut traced, mut keys_of, mut bounds) = (Vec::new(), Vec::new(), Vec::new());
        for slot in slots {
            let (at, path) = (*slot as usize, frames.path_in(*slot));
            let key = wave.spawning.begin_child(path, keys[at]);
            let importance = wave.spawning.importance[path] * weights[at];
            if is_traced(importance, cutoff) {
                traced.push(*slot);
                keys_of.push(key);
                bounds.push(importance);
            }
        }
        (traced, keys_of, bounds)
    }

    /// Shades the requested surfaces.
    pub fn shade(&mut self, slots: &[u32]) {
        let StagedPaths { frames, wave, staged, tracer, .. } = self;
        let scratch = &frames.paths.scratch;
        let Columns { time, key, sample, .. } = staged.columns;
        let (times, keys, samples) =
            (scratch.floats(time), scratch.words(key), scratch.words(sample));
        let searches = scratch.words(staged.columns.searches);
        let operands = operands::<SURFACE_SCALARS>(frames, &staged.columns, ResumedBy::Shade);
        let mut requests: Vec<ShadingRequest> = Vec::with_capacity(slots.len());
        for slot in slots {
            let (at, path) = (*slot as usize, frames.path_in(*slot));
            let key = match wave.rays.get_mut(path) {
                Some(ray) => ray.numbers.begin(Purpose::Shade),
                None => wave.spawning.begin_shade(path, keys[at]),
            };
            let ray = RayOfShading {
                key,
                time: times[at],
                sample: samples[at],
                importance: wave.spawning.importance[path],
                depth: self.depth,
                before: searches[at].saturating_sub(1),
                throughput: [1.0; 3],
                weight: [1.0; 3],
                notes_suspects: false,
            };
            let methods = &tracer.scene.shading_methods;
            requests.extend(ShadingRequest::new(tracer.scene, methods, &operands, at, ray));
        }
        let further = Further { tracer, free: self.free };
        let (mut places, mut colors) = (Vec::new(), Vec::new());
        let mut store = |place: usize, color: [f32; 3]| {
            places.push(place as u32);
            colors.push(color);
        };
        // These methods wait for all their light.
        let (methods, deferred) = (&tracer.scene.shading_methods, &mut DeferredLight::default());
        self.queries.rays += further.shade(methods, &operands, &mut requests, deferred, &mut store);
        self.store_colors(slots, &places, &colors);
    }

    /// Samples the requested lights.
    pub fn sample_lights(&mut self, paths: &PathSet) {
        match self.tracer.scene.light_stage() {
            Some(lights) => {
                self.call_kernel(lights, 0, paths);
                self.find_reached(paths.paths());
            }
            None => self.ask_for_lights(paths.paths()),
        }
    }

    /// Finds out which samples of lights reach the points that request them.
    fn find_reached(&mut self, slots: &[u32]) {
        let Columns { answers, shadow_limit, requests, time, .. } = self.staged.columns;
        let mut lit = std::mem::take(&mut self.frames.lit);
        let found = self.frames.paths.scratch.words(answers[0]);
        lit.clear();
        lit.extend(slots.iter().copied().filter(|slot| found[*slot as usize] != 0));
        let requested = Requested::of(&self.frames.paths.scratch, self.staged);
        let [ox, oy, oz, ..] = requests;
        let [_, dx, dy, dz, ..] = answers;
        let ray = RayColumns { ends: [ox, oy, oz, dx, dy, dz], limit: shadow_limit, time };
        let ThreadMemory { shadow_rays, shading_calls, .. } = &mut *self.queries;
        requested.append_rays(&lit, &ray, shading_calls, shadow_rays);
        self.count_shadow_rays(&lit);
        self.trace_shadow_rays();
        let PathTracer { scene, errors, finds_causes, .. } = self.tracer;
        let Frames { paths: Blocks { scratch, .. }, moved, .. } = &mut *self.frames;
        slots.iter().for_each(|slot| scratch.words_mut(answers[0])[*slot as usize] = 0);
        let ThreadMemory { shadow_rays, reached, .. } = &mut *self.queries;
        for index in reached {
            let slot = shadow_rays.paths[*index as usize];
            scratch.words_mut(answers[0])[slot as usize] = u32::MAX;
            let color = [5, 6, 7].map(|channel| scratch.floats(answers[channel])[slot as usize]);
            if !are_finite(&color) {
                self.wave.spawning.is_spoilt[moved.path_in(slot)] = true;
                let index = self.staged.columns.requests[LIGHT_INDEX];
                if finds_causes {
                    report_light(scene, errors, scratch.words(index)[slot as usize]);
                }
            }
        }
        shadow_rays.clear();
        self.frames.lit = lit;
    }

    /// Asks the host for the requested lights.
    fn ask_for_lights(&mut self, slots: &[u32]) {
        let operands =
            operands::<LIGHT_SCALARS>(self.frames, &self.staged.columns, ResumedBy::LightSample);
        let point = |slot: &u32| {
            let path = self.frames.path_in(*slot) as u32;
            LightPoint::new(path, &operands.map(|column| column[*slot as usize]))
        };
        let points: Vec<LightPoint> = slots.iter().map(point).collect();
        let PathTracer { scene, errors, finds_causes, .. } = self.tracer;
        let rays = &mut self.wave.rays;
        let samples = sample_for_shade(scene, errors, finds_causes, &points, rays, self.queries);
        let words: Vec<[u32; MAX_ANSWERS]> = samples.iter().map(LightAtPoint::answer).collect();
        for (index, array) in self.staged.columns.answers.iter().enumerate() {
            let answers = self.frames.paths.scratch.words_mut(*array);
            slots
                .iter()
                .zip(&words)
                .for_each(|(slot, words)| answers[*slot as usize] = words[index]);
        }
    }

    /// Answers requests of paths with the colours of some of them; the others get black.
    fn store_colors(&mut self, slots: &[u32], places: &[u32], colors: &[[f32; 3]]) {
        for (channel, array) in self.staged.columns.answers[..3].iter().enumerate() {
            let answers = self.frames.paths.scratch.floats_mut(*array);
            if places.len() < slots.len() {
                slots.iter().for_each(|slot| answers[*slot as usize] = 0.0);
            }
            for (slot, color) in places.iter().zip(colors) {
                answers[*slot as usize] = color[channel];
            }
        }
    }
}

/// Returns the surface of a path, as far as rays that leave it need to know.
fn surface_of(columns: &[&[f32]; SHADED], slot: u32) -> ShadedSurface {
    let [x, y, z, offset, normal @ ..] = columns.map(|column| column[slot as usize]);
    ShadedSurface::new([x, y, z], offset, normal, normal)
}

/// Returns the columns of the operands of requests for an event.
fn operands<'a, const COUNT: usize>(
    frames: &'a Frames,
    columns: &Columns,
    event: ResumedBy,
) -> [&'a [u32]; COUNT] {
    let (scratch, ports) = (&frames.paths.scratch, event.request());
    array::from_fn(|index| scratch.words(columns.requests[ports[index] as usize]))
}
