//! The host of an integrator: it answers queries, for one ray or for several rays together.

use std::cell::RefCell;

use rtsl::Query;
use rtsl::host::{
    Host, LaneColors, LaneFloats, LaneSet, LaneWords, LightLanes, LightQueryLanes, MAX_LANES,
    RayLanes,
};
use rtsl_math::dot;

use super::integrator_memory::IntegratorMemory;
use super::memory::ThreadMemory;
use super::numbers::{PathNumbers, Purpose};
use super::path_tracer::PathTracer;
use super::rows::are_finite;
use super::shaded_surface::ShadedSurface;
use super::shadow_rays::ShadowRay;
use super::spawned_paths::{MAX_SPAWNED, SpawnedPath, greatest_weight};
use super::suspect::Suspect;
use super::wavefront::{NO_INSTANCE, Path, Wavefront};
use crate::compiled::CompiledScene;
use crate::statistics::RayCounts;

/// The object of a surface that no ray found.
pub const NO_OBJECT: u32 = u32::MAX;

/// A ray that a method traces, spawns or asks about, in world space.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// The origin.
    pub origin: [f32; 3],
    /// The direction, of any length.
    pub direction: [f32; 3],
    /// The greatest ray parameter of a hit.
    pub limit: f32,
}

impl Ray {
    /// Returns the ray of a lane.
    fn of_lane(rays: &RayLanes, lane: usize) -> Ray {
        let vector = |from: &[LaneFloats; 3]| [0, 1, 2].map(|axis: usize| from[axis][lane]);
        Ray {
            origin: vector(&rays.origin),
            direction: vector(&rays.direction),
            limit: rays.limit[lane],
        }
    }

    /// Returns the ray that the first operands of a lane describe.
    fn of_operands(operands: &[LaneWords], lane: usize) -> Ray {
        Ray {
            origin: vector(operands, 0, lane),
            direction: vector(operands, 3, lane),
            limit: number(operands, 6, lane),
        }
    }
}

/// A ray of a call, with what the integrator has asked for it so far.
#[derive(Clone, Debug)]
pub struct RayOfCall {
    pub numbers: PathNumbers,
    /// The time within the shutter.
    pub time: f32,
    /// The sum of the contributions that nothing blocked.
    pub lit: [f32; 3],
    /// The distance and the object of the first surface that was found; `None` if there was no search yet, or no hit.
    pub first_hit: Option<(f32, f32)>,
    /// The number of searches.
    pub searches: u32,
    /// The first method whose values were not finite.
    pub suspect: Option<Suspect>,
    /// The surface that a material shades; its rays leave it.
    pub surface: Option<ShadedSurface>,
    /// The weight of its radiance.
    pub throughput: [f32; 3],
    /// The factor of the light that a method defers which shades a surface for the ray; else 1.
    pub weight: [f32; 3],
    /// True if light of lights is multiplied by this factor, too.
    pub weighs_light: bool,
    /// A bound of the weight of its radiance in the pixel.
    pub importance: f32,
    /// True if it received light that was not finite, whose cause was reported.
    pub is_spoilt: bool,
}

impl RayOfCall {
    /// Creates the state of the ray of a path with this key, sample and time.
    pub fn new(key: u32, sample: u32, time: f32) -> RayOfCall {
        RayOfCall {
            numbers: PathNumbers::new(key, sample),
            time,
            lit: [0.0; 3],
            first_hit: None,
            searches: 0,
            suspect: None,
            surface: None,
            throughput: [1.0; 3],
            weight: [1.0; 3],
            weighs_light: false,
            importance: 1.0,
            is_spoilt: false,
        }
    }

    /// Creates the state of the ray of a path.
    pub fn of_path(path: &Path) -> RayOfCall {
        RayOfCall {
            importance: path.importance,
            throughput: path.throughput,
            ..RayOfCall::new(path.key, path.sample, path.time)
        }
    }

    /// Returns the number of surfaces that the path has met before the last one found.
    pub fn surfaces_before(&self) -> u32 {
        self.searches.saturating_sub(1)
    }

    /// Counts a search.
    pub fn count_search(&mut self) {
        self.numbers.begin_search();
        self.searches = self.searches.saturating_add(1);
    }

    /// Adds a contribution that nothing blocks.
    pub fn add_contribution(&mut self, color: [f32; 3]) {
        (0..3).for_each(|channel| self.lit[channel] += color[channel]);
    }

    /// Notes light that a ray received.
    pub fn note_light(&mut self, color: [f32; 3]) {
        self.is_spoilt |= !are_finite(&color);
    }

    /// Returns the path of a ray that `trace` traces, given the weight of its radiance and the least distance of hits;
    /// `None` if the weight in the pixel is below the cutoff.
    pub fn begin_trace(
        &mut self,
        ray: &Ray,
        weight: f32,
        epsilon: f32,
        cutoff: f32,
    ) -> Option<Path> {
        let Ray { origin, direction, limit } = *ray;
        let key = self.numbers.begin_child();
        let importance = self.importance * weight;
        is_traced(importance, cutoff).then_some(Path {
            origin,
            direction,
            epsilon,
            distance: limit,
            limit,
            time: self.time,
            key,
            sample: self.numbers.sample,
            importance,
            ..Path::NOWHERE
        })
    }

    /// Returns the path of a ray that a method spawns with this weight, given the index and the depth of its parent.
    pub fn spawn(&mut self, ray: &Ray, weight: [f32; 3], parent: u32, depth: u32) -> SpawnedPath {
        let Ray { origin, direction, limit } = *ray;
        let weight = [0, 1, 2].map(|channel: usize| self.weight[channel] * weight[channel]);
        SpawnedPath {
            parent,
            depth: depth + 1,
            origin,
            direction,
            limit,
            throughput: [0, 1, 2].map(|channel| self.throughput[channel] * weight[channel]),
            importance: self.importance * greatest_weight(weight),
            key: self.numbers.begin_child(),
            time: self.time,
            sample: self.numbers.sample,
        }
    }

    /// Returns a ray that asks whether anything is on it, with 0 as its path.
    pub fn shadow_ray(&mut self, ray: &Ray) -> ShadowRay {
        let Ray { origin, direction, limit: distance } = *ray;
        ShadowRay {
            origin,
            direction,
            distance,
            time: self.time,
            color: [1.0; 3],
            path: 0,
            key: self.numbers.begin(Purpose::ShadowRay),
            sample: self.numbers.sample,
        }
    }

    /// Returns the path of a search along a ray, given the least distance of hits: 0 means that of the scene.
    pub fn search_path(&self, ray: &Ray, epsilon: f32, epsilon_of_scene: f32) -> Path {
        let Ray { origin, direction, limit } = *ray;
        Path {
            origin,
            direction,
            epsilon: if epsilon > 0.0 { epsilon } else { epsilon_of_scene },
            distance: limit,
            limit,
            time: self.time,
            key: self.numbers.key_of_search(),
            sample: self.numbers.sample,
            ..Path::NOWHERE
        }
    }

    /// Notes what the first search has found: the distance and the object of a hit.
    pub fn note_first_hit(&mut self, direction: [f32; 3], hit: Option<(f32, u32)>) {
        self.first_hit = hit.map(|(parameter, object)| first_hit(direction, parameter, object));
    }
}

/// True unless the weight of a ray's radiance in the pixel is below the cutoff. NaN is not.
pub fn is_traced(importance: f32, cutoff: f32) -> bool {
    let is_left_out = importance < cutoff;
    !is_left_out
}

/// True if a spawned path is followed, which the cutoff and weights of 0 prevent.
pub fn is_followed(importance: f32, cutoff: f32) -> bool {
    is_traced(importance, cutoff) && importance != 0.0
}

/// Returns distance and object of a surface that a ray with this direction hits at a parameter.
pub fn first_hit(direction: [f32; 3], parameter: f32, object: u32) -> (f32, f32) {
    (parameter * dot(direction, direction).sqrt(), object as f32)
}

/// The host of a call of an integrator.
pub struct SceneHost<'a> {
    pub tracer: PathTracer<'a>,
    /// The rays.
    pub rays: &'a mut [RayOfCall],
    /// The index of the ray of each lane of the call; `None` if they are in order.
    pub slots: Option<&'a [u32]>,
    /// The memory of queries.
    pub queries: &'a mut ThreadMemory,
    /// Memory for the rays that `trace` traces.
    pub free: &'a RefCell<Vec<IntegratorMemory>>,
    /// The depth of the rays.
    pub depth: u32,
    /// True if methods whose values are not finite are noted: stages do not ask for all values.
    pub notes_suspects: bool,
    /// True if stages ask, whose contributions begin off surfaces already.
    pub is_of_stages: bool,
}

impl Host for SceneHost<'_> {
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        for lane in lanes.iter() {
            let index = self.ray_of(lanes, lane);
            let CompiledScene { epsilon, settings, .. } = &self.tracer.scene.compiled;
            let (ray, weight) = (self.leaving(index, Ray::of_lane(rays, lane)), rays.weight[lane]);
            let path = self.rays[index].begin_trace(&ray, weight, *epsilon, settings.cutoff);
            let color = path.map_or([0.0; 3], |path| self.integrate_further(path));
            self.rays[index].note_light(color);
            (0..3).for_each(|channel| radiance[channel][lane] = color[channel]);
        }
    }

    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        let mut occluded = 0;
        for lane in lanes.iter() {
            let index = self.ray_of(lanes, lane);
            let ray = self.leaving(index, Ray::of_lane(rays, lane));
            if !self.is_visible(index, &ray) {
                occluded |= 1 << lane;
            }
        }
        occluded
    }

    fn light_count(&mut self) -> u32 {
        self.tracer.scene.lights.entries.len() as u32
    }

    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        self.sample_light(lanes, index, query, light)
    }

    fn ambient(&mut self) -> [f32; 3] {
        self.tracer.scene.compiled.ambient
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        let SceneHost { rays, slots, queries, .. } = self;
        let draw = |lane: usize| rays[ray_of(*slots, lanes, lane)].numbers.draw();
        let numbers = queries.drawn_numbers.singles(lanes, draw);
        numbers.for_each(|(lane, number)| values[lane] = number);
    }

    fn query(&mut self, ray: u32, query: Query, operands: &[u32], results: &mut [u32]) {
        let lanes = LaneSet { base: ray, active: 1 };
        let operands: Vec<LaneWords> = operands.iter().map(|bits| [*bits; MAX_LANES]).collect();
        let mut answers = vec![[0; MAX_LANES]; results.len()];
        self.query_lanes(lanes, query, &operands, &mut answers);
        results.iter_mut().zip(&answers).for_each(|(result, answer)| *result = answer[0]);
    }

    fn query_lanes(
        &mut self,
        lanes: LaneSet,
        query: Query,
        operands: &[LaneWords],
        results: &mut [LaneWords],
    ) {
        match query {
            Query::NearestHit => self.nearest_hits(lanes, operands, results),
            Query::SurfaceProperties
            | Query::Emission
            | Query::LightEmission
            | Query::LightPdf
            | Query::Bsdf
            | Query::BsdfPdf
            | Query::SampleBsdf
            | Query::Shade
            | Query::OwnShade => self.ask_surfaces(lanes, query, operands, results),
            Query::SampleLight => self.sample_lights(lanes, operands, results),
            Query::SkyCount => results[0].fill(self.tracer.scene.lights.skies.len() as u32),
            Query::SkyEmission | Query::SkyPdf => self.ask_skies(lanes, query, operands, results),
            Query::Contribute => self.contribute(lanes, operands),
            Query::Sample | Query::SamplePair => self.sample(lanes, operands, results),
            Query::Spawn => self.spawn(lanes, operands),
            Query::SpawnPath => self.spawn_paths(lanes, operands),
            Query::UnshadowedLight => self.sample_unshadowed(lanes, operands, results),
        }
        if self.notes_suspects {
            self.note_suspects(lanes, query, operands, results);
        }
    }
}

impl SceneHost<'_> {
    /// Returns the index of a lane's ray.
    pub fn ray_of(&self, lanes: LaneSet, lane: usize) -> usize {
        ray_of(self.slots, lanes, lane)
    }

    /// Returns a ray that begins off the surface that a material shades for the ray with an index.
    fn leaving(&mut self, index: usize, ray: Ray) -> Ray {
        let Ray { origin, direction, limit } = ray;
        let surface = self.rays[index].surface.as_ref();
        let origin = self.queries.shading_calls.leave(surface, origin, direction);
        Ray { origin, direction, limit }
    }

    fn nearest_hits(&mut self, lanes: LaneSet, operands: &[LaneWords], results: &mut [LaneWords]) {
        for lane in lanes.iter() {
            let index = self.ray_of(lanes, lane);
            let (origin, direction) = (vector(operands, 0, lane), vector(operands, 3, lane));
            let (epsilon, limit) = (number(operands, 6, lane), number(operands, 7, lane));
            let ray = self.leaving(index, Ray { origin, direction, limit });
            let state = &mut self.rays[index];
            let path = state.search_path(&ray, epsilon, self.tracer.scene.compiled.epsilon);
            let ThreadMemory { wavefront, searcher, batch, rays, .. } = &mut *self.queries;
            begin(wavefront, path);
            searcher.are_together = false;
            rays.traced += u64::from(state.searches > 0 || state.surface.is_some());
            searcher.find_hits(self.tracer.scene, self.tracer.errors, wavefront, batch);
            let distance = wavefront.paths[0].distance;
            let hit = wavefront.hits.first();
            self.tracer.scene.note_hit(hit.map(|hit| (hit.object, distance)));
            if state.searches == 0 {
                state.note_first_hit(path.direction, hit.map(|hit| (distance, hit.object)));
            }
            state.count_search();
            let answer = match hit {
                Some(hit) => [1, hit.object, hit.instance, hit.element, distance.to_bits()],
                None => [0, NO_OBJECT, NO_INSTANCE, 0, 0],
            };
            results.iter_mut().zip(answer).for_each(|(result, bits)| result[lane] = bits);
        }
    }

    /// Notes contributions, which are added if nothing blocks them once their rays are traced.
    fn contribute(&mut self, lanes: LaneSet, operands: &[LaneWords]) {
        for lane in lanes.iter() {
            let index = self.ray_of(lanes, lane);
            let mut ray = Ray::of_operands(operands, lane);
            let mut color = vector(operands, 7, lane);
            if !self.is_of_stages {
                ray = self.leaving(index, ray);
                let RayOfCall { weighs_light, weight, .. } = &self.rays[index];
                if *weighs_light {
                    (0..3).for_each(|channel| color[channel] *= weight[channel]);
                }
            }
            if color == [0.0; 3] {
                continue;
            }
            let Ray { origin, direction, limit } = ray;
            let RayOfCall { numbers, time, .. } = &mut self.rays[index];
            self.queries.shadow_rays.push(&ShadowRay {
                origin,
                direction,
                distance: limit,
                time: *time,
                color,
                path: lanes.base + lane as u32,
                key: numbers.begin(Purpose::ShadowRay),
                sample: numbers.sample,
            });
        }
    }

    /// Notes the paths of rays that a method spawns.
    fn spawn(&mut self, lanes: LaneSet, operands: &[LaneWords]) {
        for lane in lanes.iter() {
            let index = self.ray_of(lanes, lane);
            let ray = self.leaving(index, Ray::of_operands(operands, lane));
            let weight = vector(operands, 7, lane);
            let path = self.rays[index].spawn(&ray, weight, index as u32, self.depth);
            self.follow(&path);
        }
    }

    /// Notes paths that stages have made of rays.
    fn spawn_paths(&mut self, lanes: LaneSet, operands: &[LaneWords]) {
        for lane in lanes.iter() {
            let index = self.ray_of(lanes, lane);
            let RayOfCall { importance, time, numbers, .. } = &self.rays[index];
            let Ray { origin, direction, limit } = Ray::of_operands(operands, lane);
            let path = SpawnedPath {
                parent: index as u32,
                depth: self.depth + 1 + operands[12][lane],
                origin,
                direction,
                limit,
                throughput: vector(operands, 7, lane),
                importance: importance * number(operands, 10, lane),
                key: operands[11][lane],
                time: *time,
                sample: numbers.sample,
            };
            self.follow(&path);
        }
    }

    fn follow(&mut self, path: &SpawnedPath) {
        if !is_followed(path.importance, self.tracer.scene.compiled.settings.cutoff) {
            return;
        }
        match self.queries.spawned.len() < MAX_SPAWNED {
            true => self.queries.spawned.push(path),
            false => self.tracer.errors.report_many_paths(),
        }
    }

    /// Answers queries about one number of the paths, or about two.
    fn sample(&mut self, lanes: LaneSet, operands: &[LaneWords], results: &mut [LaneWords]) {
        let SceneHost { rays, slots, queries, .. } = self;
        let numbers = |lane: usize| &rays[ray_of(*slots, lanes, lane)].numbers;
        if let [number] = results {
            let place = |lane: usize| numbers(lane).single(operands[0][lane]);
            let singles = queries.drawn_numbers.singles(lanes, place);
            singles.for_each(|(lane, single)| number[lane] = single.to_bits());
        } else {
            let place = |lane: usize| numbers(lane).pair(operands[0][lane]);
            let pairs = queries.drawn_numbers.pairs(lanes, place);
            pairs.for_each(|(lane, pair)| store(results, lane, &pair));
        }
    }

    /// True if nothing is on a ray before its limit, about which the ray of this index asks.
    fn is_visible(&mut self, index: usize, ray: &Ray) -> bool {
        let shadow_ray = self.rays[index].shadow_ray(ray);
        let memory = &mut *self.queries;
        // Contributions wait for their turn.
        let waiting = std::mem::take(&mut memory.shadow_rays);
        memory.shadow_rays.push(&shadow_ray);
        memory.trace_shadow_rays(self.tracer.scene, self.tracer.errors);
        memory.shadow_rays = waiting;
        !memory.reached.is_empty()
    }

    /// Adds the contributions that nothing blocks.
    pub fn add_contributions(&mut self) {
        self.queries.trace_shadow_rays(self.tracer.scene, self.tracer.errors);
        let ThreadMemory { shadow_rays, reached, .. } = &mut *self.queries;
        for index in reached {
            let index = *index as usize;
            let ray = &mut self.rays[shadow_rays.paths[index] as usize];
            ray.add_contribution(shadow_rays.color(index));
        }
        shadow_rays.clear();
    }

    /// Returns the radiance along the ray of a path that a method has traced; black beyond the greatest depth.
    fn integrate_further(&mut self, path: Path) -> [f32; 3] {
        let SceneHost { tracer, free, depth, .. } = self;
        let further = Further { tracer, free };
        let mut radiance = [[0.0; 3]];
        let counts = further.integrate(&[path], *depth + 1, &mut radiance);
        self.queries.rays += counts;
        radiance[0]
    }
}

/// The integration of further rays, those that `trace` traces.
pub struct Further<'a> {
    pub tracer: &'a PathTracer<'a>,
    pub free: &'a RefCell<Vec<IntegratorMemory>>,
}

impl Further<'_> {
    /// Computes the radiance along the rays of paths, whose depth is given, and returns the number of rays traced. Beyond
    /// the greatest depth `radiance` keeps its values.
    pub fn integrate(&self, paths: &[Path], depth: u32, radiance: &mut [[f32; 3]]) -> RayCounts {
        if paths.is_empty() || !self.tracer.scene.is_traced_at(depth) {
            return RayCounts::default();
        }
        self.with_memory(|memory| {
            let mut counts = self.tracer.integrate_further(paths, memory, depth, radiance);
            counts.traced += paths.len() as u64;
            counts
        })
    }

    /// Calls `work` with memory for a further level.
    pub fn with_memory(&self, work: impl FnOnce(&mut IntegratorMemory) -> RayCounts) -> RayCounts {
        let taken = self.free.borrow_mut().pop();
        let mut memory = taken.unwrap_or_else(|| IntegratorMemory::new(self.tracer.scene));
        let counts = work(&mut memory);
        self.free.borrow_mut().push(memory);
        counts
    }
}

/// Returns the index of a lane's ray, given those of the lanes of a call unless they are in order.
fn ray_of(slots: Option<&[u32]>, lanes: LaneSet, lane: usize) -> usize {
    let index = lanes.base as usize + lane;
    slots.map_or(index, |slots| slots[index] as usize)
}

/// Makes a wavefront of one path, whose ray is not traced yet.
fn begin(wavefront: &mut Wavefront, path: Path) {
    wavefront.paths.clear();
    wavefront.paths.push(path);
    wavefront.features.reset(0, None);
    wavefront.active.clear();
    wavefront.active.push(0);
}

/// Returns a lane of the operand at an index as a number.
pub fn number(operands: &[LaneWords], index: usize, lane: usize) -> f32 {
    f32::from_bits(operands[index][lane])
}

/// Returns a lane of the three operands from an index on as a vector.
pub fn vector(operands: &[LaneWords], first: usize, lane: usize) -> [f32; 3] {
    [0, 1, 2].map(|axis| number(operands, first + axis, lane))
}

/// Stores the first results of a lane.
pub fn store(results: &mut [LaneWords], lane: usize, values: &[f32]) {
    results.iter_mut().zip(values).for_each(|(result, value)| result[lane] = value.to_bits());
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Weights of rays that follow each other are multiplied. One that is no number is not too little.
    #[test]
    fn rays_of_little_weight_are_left_out() {
        let ray = Ray { origin: [0.0; 3], direction: [0.0, 0.0, 1.0], limit: f32::INFINITY };
        let begin = |path: &Path, weight: f32| {
            RayOfCall::of_path(path).begin_trace(&ray, weight, 1e-4, 0.125)
        };
        let first = begin(&Path::NOWHERE, 0.25).unwrap();
        assert_eq!(first.importance, 0.25);
        assert!(begin(&first, 0.5).is_some() && begin(&first, 0.499).is_none());
        assert!(begin(&first, f32::NAN).is_some());
    }
}
