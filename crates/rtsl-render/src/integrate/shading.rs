//! Calls of `shade` for surfaces, and of what shades surfaces of materials without it.
//!
//! The method of a material that traces is a function of its own for each surface, with its own random numbers: it is
//! split like an integrator, or runs on the interpreter. Its rays are integrated one level deeper.

use std::ops::Range;

use rtsl::host::{LaneSet, LaneWords};
use rtsl::{Instances, LaneBlock, LaneIndices, SURFACE_SCALARS, new_state};
use rtsl_math::sampling::NUMBERS_OF_SHAPES;

use super::host::{Further, RayOfCall, SceneHost, store};
use super::integrator_memory::IntegratorMemory;
use super::memory::ThreadMemory;
use super::numbers::{PathNumbers, Purpose};
use super::path_tracer::PathTracer;
use super::rows::{BATCH_LANES, all_finite, are_finite};
use super::shaded_surface::ShadedSurface;
use super::shading_batch::{RayOfSurface, ShadingBatch, set_indices};
use super::shading_methods::{ShadingMethod, ShadingMethods};
use super::shadow_rays::{ShadowRay, ShadowRays};
use super::spawned_paths::SpawnedPaths;
use super::staged::{Blocks, Columns, PathSet, StagedMethod, StagedPaths};
use super::suspect::Suspect;
use super::wavefront::PathHit;
use crate::compiled::calls::Callee;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::variables::vector;
use crate::integrate::host::vector as operand_vector;
use crate::statistics::RayCounts;

/// A request for the light of a shaded surface. The operands of its query are in columns, of which it has a place.
#[derive(Clone, Copy, Debug)]
pub struct ShadingRequest {
    /// The index of the surface in the columns.
    pub place: u32,
    /// The index of the method that shades it, among those of the scene.
    method: u32,
    /// The group of the surface.
    group: u32,
    hit: PathHit,
    /// The ray that found it.
    ray: RayOfShading,
}

/// The ray whose surface is shaded, with the random sequence of the call.
#[derive(Clone, Copy, Debug)]
pub struct RayOfShading {
    /// The depth of the ray of the integrator.
    pub depth: u32,
    /// The number of surfaces that its path has met before.
    pub before: u32,
    /// The time within the shutter.
    pub time: f32,
    /// The key of the random sequence of the call.
    pub key: u32,
    /// The index of the sample.
    pub sample: u32,
    /// A bound of the weight of the light in the pixel.
    pub importance: f32,
    /// The weight of the radiance of the path.
    pub throughput: [f32; 3],
    /// The factor of the light that the method defers.
    pub weight: [f32; 3],
    /// True if methods whose values are not finite are noted.
    pub notes_suspects: bool,
}

/// Light that methods which shade surfaces have deferred. The paths are the places of their surfaces.
#[derive(Debug, Default)]
pub struct DeferredLight {
    /// The contributions of lights.
    pub contributions: ShadowRays,
    /// The paths of rays.
    pub spawned: SpawnedPaths,
    /// Methods whose values were not finite.
    pub suspects: Vec<(u32, Suspect)>,
}

/// The columns with the operands of queries for the light of shaded surfaces.
pub type ShadingOperands<'a> = [&'a [u32]; SURFACE_SCALARS];

impl ShadingRequest {
    /// Returns the request of a ray for the surface at a place; `None` if the scene has no such surface, or it is black.
    pub fn new(
        scene: &RenderScene,
        methods: &ShadingMethods,
        operands: &ShadingOperands<'_>,
        place: usize,
        ray: RayOfShading,
    ) -> Option<ShadingRequest> {
        let [object, instance, element] = [0, 1, 2].map(|index: usize| operands[index][place]);
        let hit = scene.hit_of(object, instance, element)?;
        let group = scene.objects[hit.object as usize].group;
        let method = methods.of_group(group)? as u32;
        Some(ShadingRequest { place: place as u32, method, group, hit, ray })
    }

    /// The number of surfaces that the light's path has met before.
    fn depth(&self) -> u32 {
        self.ray.depth + self.ray.before
    }

    fn ray_of_surface(&self) -> RayOfSurface {
        let RayOfShading { time, key, sample, .. } = self.ray;
        RayOfSurface { time, key, sample }
    }

    /// Returns the state of the call for a host, with this surface.
    fn ray_of_call(&self, surface: ShadedSurface) -> RayOfCall {
        let RayOfShading { time, key, sample, importance, throughput, weight, .. } = self.ray;
        let surface = Some(surface);
        let ray = RayOfCall::new(key, sample, time);
        RayOfCall { importance, throughput, weight, surface, ..ray }
    }
}

impl SceneHost<'_> {
    /// Answers queries for the light of shaded surfaces.
    pub fn shade(&mut self, lanes: LaneSet, operands: &[LaneWords], results: &mut [LaneWords]) {
        let methods = &self.tracer.scene.shading_methods;
        let weight = |_| [1.0; 3];
        self.shade_by(methods, lanes, operands, &weight, results);
    }

    /// Answers queries for the own colours of shaded surfaces, and takes the light that their methods defer.
    pub fn own_shade(&mut self, lanes: LaneSet, operands: &[LaneWords], results: &mut [LaneWords]) {
        let methods = &self.tracer.scene.own_shades;
        let weight = |lane| operand_vector(operands, SURFACE_SCALARS, lane);
        let mut light = self.shade_by(methods, lanes, operands, &weight, results);
        for (lane, suspect) in &light.suspects {
            let ray = self.ray_of(lanes, *lane as usize);
            self.rays[ray].suspect.get_or_insert(*suspect);
        }
        for index in 0..light.contributions.len() {
            let lane = light.contributions.paths[index];
            let ray = self.ray_of(lanes, lane as usize);
            let PathNumbers { sample, .. } = self.rays[ray].numbers;
            let key = self.rays[ray].numbers.begin(Purpose::ShadowRay);
            if !are_finite(&light.contributions.color(index)) {
                let object = operands[0][lane as usize];
                self.rays[ray].suspect.get_or_insert(self.shading_suspect(object));
            }
            let path = lanes.base + lane;
            let contribution = light.contributions.ray(index);
            self.queries.shadow_rays.push(&ShadowRay { path, key, sample, ..contribution });
        }
        for lane in light.spawned.lost_parents(0) {
            let ray = self.ray_of(lanes, lane as usize);
            let suspect = self.shading_suspect(operands[0][lane as usize]);
            self.rays[ray].suspect.get_or_insert(suspect);
        }
        let slots = self.slots;
        let ray_of = |lane: u32| {
            let index = lanes.base + lane;
            slots.map_or(index, |slots| slots[index as usize])
        };
        self.queries.spawned.append(&mut light.spawned, ray_of);
    }

    /// Shades surfaces by some methods, given the factor of the light that they defer by lane.
    fn shade_by(
        &mut self,
        methods: &ShadingMethods,
        lanes: LaneSet,
        operands: &[LaneWords],
        weight: &dyn Fn(usize) -> [f32; 3],
        results: &mut [LaneWords],
    ) -> DeferredLight {
        let operands: ShadingOperands<'_> = std::array::from_fn(|index| &operands[index][..]);
        let mut requests = Vec::new();
        for lane in lanes.iter() {
            let ray = self.ray_of(lanes, lane);
            let ray = &mut self.rays[ray];
            let ray = RayOfShading {
                key: ray.numbers.begin(Purpose::Shade),
                depth: self.depth,
                before: ray.surfaces_before(),
                time: ray.time,
                sample: ray.numbers.sample,
                importance: ray.importance,
                throughput: ray.throughput,
                weight: weight(lane),
                notes_suspects: self.notes_suspects,
            };
            let scene = self.tracer.scene;
            requests.extend(ShadingRequest::new(scene, methods, &operands, lane, ray));
        }
        let further = Further { tracer: &self.tracer, free: self.free };
        let mut deferred = DeferredLight::default();
        let mut keep = |place: usize, color: [f32; 3]| store(results, place, &color);
        self.queries.rays +=
            further.shade(methods, &operands, &mut requests, &mut deferred, &mut keep);
        deferred
    }
}

impl Further<'_> {
    /// Shades surfaces, and returns the number of rays traced. `store` is called with the place and the light of each.
    pub fn shade(
        &self,
        methods: &ShadingMethods,
        operands: &ShadingOperands<'_>,
        requests: &mut [ShadingRequest],
        deferred: &mut DeferredLight,
        store: &mut dyn FnMut(usize, [f32; 3]),
    ) -> RayCounts {
        // The order of places keeps what is adjacent in memory adjacent in calls.
        requests.sort_unstable_by_key(|it| (it.method, it.depth(), it.group, it.place));
        let mut counts = RayCounts::default();
        let mut colors = Vec::new();
        let call = |request: &ShadingRequest| (request.method, request.depth());
        let is_of_call = |one: &ShadingRequest, other: &ShadingRequest| call(one) == call(other);
        for requests in requests.chunk_by(is_of_call) {
            colors.clear();
            colors.resize(requests.len(), [0.0; 3]);
            let method = methods.method(requests[0].method as usize);
            counts += self.call(method, operands, requests, &mut colors, deferred);
            for (request, color) in requests.iter().zip(&colors) {
                store(request.place as usize, *color);
            }
        }
        counts
    }

    /// Calls one method for surfaces that are sorted by group, at one depth.
    fn call(
        &self,
        method: &ShadingMethod,
        operands: &ShadingOperands<'_>,
        requests: &[ShadingRequest],
        colors: &mut [[f32; 3]],
        deferred: &mut DeferredLight,
    ) -> RayCounts {
        let call = ShadingCall { tracer: *self.tracer, method, operands, requests };
        self.with_memory(|memory| {
            match method.staged() {
                Some(staged) => call.run_stages(staged, memory, colors),
                None => call.interpret(memory, colors),
            }
            call.take_deferred(memory, deferred);
            memory.take_ray_counts()
        })
    }
}

/// A call of a method for surfaces of one depth, which are sorted by group.
#[derive(Clone, Copy)]
struct ShadingCall<'a> {
    tracer: PathTracer<'a>,
    method: &'a ShadingMethod,
    operands: &'a ShadingOperands<'a>,
    requests: &'a [ShadingRequest],
}

impl ShadingCall<'_> {
    /// Runs the method's stages.
    fn run_stages(
        &self,
        staged: &StagedMethod,
        memory: &mut IntegratorMemory,
        colors: &mut [[f32; 3]],
    ) {
        let count = self.requests.len();
        let exhausted = RuntimeErrors::default();
        let begun = self.tracer.begin_stages(staged, &exhausted, memory, count, self.depth());
        let Some(mut run) = begun else { return };
        self.load(staged, &mut run);
        let all = PathSet::all(count);
        match self.method.adds_to_path {
            // It is one stage, whose contributions wait for those of the paths.
            true => run.call_kernel(staged, 0, &all),
            false => run.run(&all),
        }
        run.light(self.method.color(), colors);
        if !all_finite(colors.as_flattened()) {
            let by_lights = |index: usize| run.wave.rays.get(index).is_some_and(|it| it.is_spoilt);
            let is_spoilt = |index: usize| run.wave.spawning.is_spoilt[index] || by_lights(index);
            for (index, color) in colors.iter().enumerate() {
                self.report_lost(is_spoilt(index), *color);
            }
        }
        if exhausted.any() {
            self.find_exhausted(memory);
        }
    }

    /// Loads the surfaces as paths of the stages.
    fn load(&self, staged: &StagedMethod, run: &mut StagedPaths<'_>) {
        let count = self.requests.len();
        let Blocks { state, scratch } = &mut run.frames.paths;
        let in_stages = |array: usize| staged.program.class_array(array);
        self.arrays().for_each(|it| scratch.words_mut(in_stages(it))[..count].fill(0));
        let color = self.method.color();
        (color..color + 3).for_each(|component| state.words_mut(component)[..count].fill(0));
        let Columns { time, key, sample, shaded, weights, shade_weights, .. } = staged.columns;
        let needs_rays = self.tracer.scene.needs_rays(staged);
        for surfaces in self.batches() {
            let batch = &mut *run.queries.batch;
            self.prepare(&surfaces, batch);
            let copy = |from: &[u32], to: &mut [u32]| {
                to[surfaces.clone()].copy_from_slice(&from[..surfaces.len()]);
            };
            for component in staged.first_reads() {
                copy(batch.state.words(*component), state.words_mut(*component));
            }
            if self.method.shares_scratch() {
                let kept = &batch.surfaces.block;
                self.arrays().for_each(|it| copy(kept.words(it), scratch.words_mut(in_stages(it))));
            }
            for (array, numbers) in shaded.into_iter().zip(ShadedSurface::columns(batch)) {
                let column = &mut scratch.floats_mut(array)[surfaces.clone()];
                column.iter_mut().zip(numbers).for_each(|(to, number)| *to = number);
            }
            if needs_rays {
                run.wave.rays.extend(self.rays(&surfaces, batch));
            }
        }
        let rays = || self.requests.iter().map(|request| request.ray);
        let times = scratch.floats_mut(time).iter_mut().zip(rays());
        times.for_each(|(to, ray)| *to = ray.time);
        scratch.words_mut(key).iter_mut().zip(rays()).for_each(|(to, ray)| *to = ray.key);
        scratch.words_mut(sample).iter_mut().zip(rays()).for_each(|(to, ray)| *to = ray.sample);
        for channel in 0..3 {
            let factors = scratch.floats_mut(shade_weights[channel]).iter_mut().zip(rays());
            factors.for_each(|(to, ray)| *to = ray.weight[channel]);
            let of_paths = scratch.floats_mut(weights[channel]).iter_mut().zip(rays());
            of_paths.for_each(|(to, ray)| *to = ray.throughput[channel]);
        }
        let bounds = run.wave.spawning.importance.iter_mut().zip(rays());
        bounds.for_each(|(to, ray)| *to = ray.importance);
        run.wave.objects.extend(self.objects(0..count));
    }

    /// Takes the light that calls have deferred.
    fn take_deferred(&self, memory: &mut IntegratorMemory, to: &mut DeferredLight) {
        let ThreadMemory { spawned, shadow_rays, suspects, .. } = &mut *memory.queries;
        let place = |index: u32| self.requests[index as usize].place;
        to.suspects.extend(suspects.drain(..).map(|(index, suspect)| (place(index), suspect)));
        to.spawned.append(spawned, place);
        for index in 0..shadow_rays.len() {
            let ray = shadow_rays.ray(index);
            to.contributions.push(&ShadowRay { path: place(ray.path), ..ray });
        }
        shadow_rays.clear();
    }

    /// Evaluates surfaces again until a method exceeds its loop budget, and reports that: the one that is shaded if no
    /// other is found.
    #[cold]
    fn find_exhausted(&self, memory: &mut IntegratorMemory) {
        for requests in self.requests.chunks(1) {
            if self.tracer.errors.any() {
                return;
            }
            ShadingCall { requests, ..*self }.interpret(memory, &mut [[0.0; 3]]);
        }
        if !self.tracer.errors.any() {
            self.tracer.errors.report(self.callee().class, self.method.method);
        }
    }

    /// Runs the whole method on the interpreter.
    fn interpret(&self, memory: &mut IntegratorMemory, colors: &mut [[f32; 3]]) {
        // It was linked for the stages, or when the scene was prepared.
        let Ok(kernel) = self.method.interpreted() else { return };
        let mut scratch = LaneBlock::new(self.arrays().len(), BATCH_LANES);
        let mut objects = LaneIndices::new(BATCH_LANES);
        for surfaces in self.batches() {
            let batch = &mut *memory.queries.batch;
            self.prepare(&surfaces, batch);
            for array in self.arrays() {
                let to = scratch.words_mut(array);
                match self.method.shares_scratch() {
                    true => to.copy_from_slice(batch.surfaces.block.words(array)),
                    false => to.fill(0),
                }
            }
            let mut rays: Vec<RayOfCall> = self.rays(&surfaces, batch).collect();
            // Queries of the method use the batch again.
            let mut state = std::mem::replace(&mut batch.state, new_state(BATCH_LANES));
            set_indices(&mut objects, self.objects(surfaces.clone()));
            let IntegratorMemory { queries, free, .. } = &mut *memory;
            let host = &mut SceneHost {
                tracer: self.tracer,
                rays: &mut rays,
                slots: None,
                queries,
                free,
                depth: self.depth(),
                notes_suspects: self.requests[0].ray.notes_suspects && self.method.defers,
                is_of_stages: false,
            };
            let instances = Instances::Many(&self.method.objects, &objects);
            let (count, callee) = (surfaces.len(), self.callee());
            let before = (host.queries.shadow_rays.len(), host.queries.spawned.len());
            callee.call_for_first(kernel, count, instances, &mut state, &mut scratch, host);
            if self.method.adds_to_path {
                let rays = &mut host.queries.shadow_rays.paths[before.0..];
                rays.iter_mut().for_each(|path| *path += surfaces.start as u32);
            } else {
                host.add_contributions();
            }
            let parents = &mut host.queries.spawned.parents[before.1..];
            parents.iter_mut().for_each(|parent| *parent += surfaces.start as u32);
            for (index, ray) in (surfaces.start as u32..).zip(&rays) {
                memory.queries.suspects.extend(ray.suspect.map(|suspect| (index, suspect)));
            }
            for (lane, color) in colors[surfaces].iter_mut().enumerate() {
                let own = vector(&state, self.method.color(), lane);
                let lit = rays[lane].lit;
                *color = [0, 1, 2].map(|channel| 0.0 + (own[channel] + lit[channel]));
                self.report_lost(rays[lane].is_spoilt, *color);
            }
        }
    }

    /// Returns the surfaces that are prepared together, of one group each.
    fn batches(&self) -> Vec<Range<usize>> {
        let mut batches = Vec::new();
        let mut start = 0;
        for group in self.requests.chunk_by(|one, other| one.group == other.group) {
            for batch in group.chunks(BATCH_LANES) {
                batches.push(start..start + batch.len());
                start += batch.len();
            }
        }
        batches
    }

    /// Computes the properties of surfaces, as inputs of the method.
    fn prepare(&self, surfaces: &Range<usize>, batch: &mut ShadingBatch) {
        let requests = &self.requests[surfaces.clone()];
        batch.load_operands(
            requests.iter().map(|request| request.hit),
            |index, lane| self.operands[index][requests[lane].place as usize],
            |lane| requests[lane].ray_of_surface(),
            NUMBERS_OF_SHAPES,
        );
        let Some(group) = self.tracer.groups.get(requests[0].group as usize) else { return };
        group.prepare_surfaces(self.tracer.scene, self.tracer.errors, batch);
        batch.set_depths(requests.iter().map(|it| (it.ray.depth, it.ray.before)));
    }

    /// Returns what a host knows of the calls for the surfaces of a prepared batch.
    fn rays(
        &self,
        surfaces: &Range<usize>,
        batch: &ShadingBatch,
    ) -> impl Iterator<Item = RayOfCall> {
        let requests = self.requests[surfaces.clone()].iter().enumerate();
        let weighs_light = self.method.adds_to_path;
        requests.map(move |(lane, request)| {
            let ray = request.ray_of_call(ShadedSurface::of_lane(batch, lane));
            RayOfCall { weighs_light, ..ray }
        })
    }

    /// Returns the index of the object that shades each surface.
    fn objects(&self, surfaces: Range<usize>) -> impl Iterator<Item = u32> {
        let scene = self.tracer.scene;
        self.requests[surfaces].iter().map(|it| self.method.object_of(scene, &it.hit))
    }

    /// The scratch arrays of the class.
    fn arrays(&self) -> Range<usize> {
        0..self.method.program.layout().scratch_arrays as usize
    }

    /// The depth of the rays that found the surfaces.
    fn depth(&self) -> u32 {
        self.requests[0].depth()
    }

    fn callee(&self) -> Callee<'_> {
        let (program, method) = (&self.method.program, self.method.method);
        Callee { class: &program.class().name, method, errors: self.tracer.errors }
    }

    /// Reports the method if its colour is not finite, though all light that it received is.
    fn report_lost(&self, is_spoilt: bool, color: [f32; 3]) {
        // Who asks for what a method defers, finds out itself.
        let reports = self.tracer.finds_causes && !self.method.defers;
        if reports && !is_spoilt && !are_finite(&color) {
            self.callee().report_not_finite(1);
        }
    }
}
