//! Samples of a light that a material names by its index, each with a shadow ray.

use rtsl::host::{LaneFloats, LaneSet, LaneWords, LightLanes, LightQueryLanes};
use rtsl::{MAX_ANSWERS, QueryColumns, ResumedBy};

use super::host::{Ray, RayOfCall, SceneHost};
use super::memory::ThreadMemory;
use super::numbers::Purpose;
use super::path_tracer::PathTracer;
use super::rows::{BATCH_LANES, are_finite, get};
use super::shading_batch::ShadingBatch;
use super::shading_texts::Cone;
use super::shadow_rays::ShadowRay;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::lights::Weights;

/// The number of operands of a request.
pub const LIGHT_SCALARS: usize = ResumedBy::LightSample.request().len();

/// A point for which light is requested.
#[derive(Clone, Copy, Debug)]
pub struct LightPoint {
    /// The index of the ray that found the point.
    ray: u32,
    /// The index of the light.
    light: u32,
    /// The point, in world space.
    point: [f32; 3],
    cone: Cone,
}

/// Light that reaches a point.
#[derive(Clone, Copy, Debug)]
pub struct LightAtPoint {
    /// The unit vector towards the light.
    direction: [f32; 3],
    distance: f32,
    /// The radiance, or the whole contribution where the density is 0.
    color: [f32; 3],
    /// The density per solid angle; 0 for a delta light.
    density: f32,
}

impl LightPoint {
    /// Returns the point of a request with these operands: the light, point, axis and cosine.
    pub fn new(ray: u32, operands: &[u32; LIGHT_SCALARS]) -> LightPoint {
        let number = |index: usize| f32::from_bits(operands[index]);
        LightPoint {
            ray,
            light: operands[0],
            point: [1, 2, 3].map(number),
            cone: Cone { axis: [4, 5, 6].map(number), cosine: number(7) },
        }
    }

    fn of_lane(ray: u32, light: u32, query: &LightQueryLanes, lane: usize) -> LightPoint {
        let vector = |from: &[LaneFloats; 3]| [0, 1, 2].map(|axis: usize| from[axis][lane]);
        let (point, axis) = (vector(&query.point), vector(&query.normal));
        LightPoint { ray, light, point, cone: Cone { axis, cosine: query.cosine[lane] } }
    }
}

impl LightAtPoint {
    /// Returns the sample of a lane of a batch.
    fn of_batch(batch: &ShadingBatch, lane: usize) -> LightAtPoint {
        LightAtPoint {
            direction: get(&batch.light.direction, lane),
            distance: batch.light.reach[lane],
            color: get(&batch.light.color, lane),
            density: batch.light.density[lane],
        }
    }

    /// Returns the answer to a request: whether there is light, then the light.
    pub fn answer(light: &Option<LightAtPoint>) -> [u32; MAX_ANSWERS] {
        let Some(light) = light else { return [0; MAX_ANSWERS] };
        let LightAtPoint { direction: [x, y, z], distance, color: [r, g, b], density } = *light;
        let [x, y, z, distance, r, g, b, density] =
            [x, y, z, distance, r, g, b, density].map(f32::to_bits);
        [u32::MAX, x, y, z, distance, r, g, b, density]
    }

    fn store(&self, light: &mut LightLanes, lane: usize) {
        for axis in 0..3 {
            light.direction[axis][lane] = self.direction[axis];
            light.color[axis][lane] = self.color[axis];
        }
        light.distance[lane] = self.distance;
        light.pdf[lane] = self.density;
    }
}

impl SceneHost<'_> {
    /// Answers requests for a light. Returns the lanes that it reaches.
    pub fn sample_light(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        let point = |lane: usize| {
            let ray = self.ray_of(lanes, lane) as u32;
            LightPoint::of_lane(ray, index, query, lane)
        };
        let points: Vec<LightPoint> = lanes.iter().map(point).collect();
        let PathTracer { scene, errors, finds_causes, .. } = self.tracer;
        let samples =
            sample_for_shade(scene, errors, finds_causes, &points, self.rays, self.queries);
        let mut reached = 0;
        for (lane, sample) in lanes.iter().zip(samples) {
            let Some(sample) = sample else { continue };
            sample.store(light, lane);
            reached |= 1 << lane;
        }
        reached
    }

    /// Samples lights by their indices, whether anything blocks them or not.
    pub fn sample_unshadowed(
        &mut self,
        lanes: LaneSet,
        operands: &[LaneWords],
        results: &mut [LaneWords],
    ) {
        let PathTracer { scene, errors, .. } = self.tracer;
        if scene.lights.is_empty() {
            return;
        }
        let point = |lane: usize| {
            let operands = std::array::from_fn(|index| operands[index][lane]);
            LightPoint::new(self.ray_of(lanes, lane) as u32, &operands)
        };
        let points: Vec<LightPoint> = lanes.iter().map(point).collect();
        let samples = load_samples(scene, errors, &points, self.rays, self.queries);
        let batch = &self.queries.batch;
        for (place, (lane, sample)) in lanes.iter().zip(samples).enumerate() {
            let Some(sample) = sample else { continue };
            let limit = batch.light.distance[place].to_bits();
            let [_, light @ ..] = LightAtPoint::answer(&Some(sample));
            let words = [1].into_iter().chain(light).chain([limit]);
            results.iter_mut().zip(words).for_each(|(result, word)| result[lane] = word);
        }
    }
}

/// Samples lights for points; returns the light that reaches each of them. Lights whose samples are not finite are
/// reported if causes are.
pub fn sample_for_shade(
    scene: &RenderScene,
    errors: &RuntimeErrors,
    finds_causes: bool,
    points: &[LightPoint],
    rays: &mut [RayOfCall],
    queries: &mut ThreadMemory,
) -> Vec<Option<LightAtPoint>> {
    let mut answers = vec![None; points.len()];
    if scene.lights.is_empty() {
        return answers;
    }
    let batches = points.chunks(BATCH_LANES).zip(answers.chunks_mut(BATCH_LANES));
    for (points, answers) in batches {
        let samples = load_samples(scene, errors, points, rays, queries);
        let ThreadMemory { batch, shadow_rays, shading_calls, .. } = &mut *queries;
        for (place, (point, sample)) in points.iter().zip(&samples).enumerate() {
            let Some(LightAtPoint { direction, .. }) = *sample else { continue };
            let ray = &mut rays[point.ray as usize];
            let origin = shading_calls.leave(ray.surface.as_ref(), point.point, direction);
            let limit = batch.light.distance[place];
            let shadow_ray = ray.shadow_ray(&Ray { origin, direction, limit });
            shadow_rays.push(&ShadowRay { path: place as u32, ..shadow_ray });
        }
        queries.trace_shadow_rays(scene, errors);
        let ThreadMemory { shadow_rays, reached, .. } = &mut *queries;
        for index in reached {
            let place = shadow_rays.paths[*index as usize] as usize;
            let Some(sample) = samples[place] else { continue };
            answers[place] = Some(sample);
            let color = sample.color;
            if !are_finite(&color) {
                rays[points[place].ray as usize].note_light(color);
                if finds_causes {
                    report_light(scene, errors, points[place].light);
                }
            }
        }
        shadow_rays.clear();
    }
    answers
}

/// Reports a light whose samples are not finite.
pub fn report_light(scene: &RenderScene, errors: &RuntimeErrors, entry: u32) {
    let (class, method) = scene.lights.sampled_method(entry, &scene.materials);
    errors.report_not_finite(class, method, 1);
}

/// Loads points as a batch, for which they are not too many, and samples their lights. Returns the samples that are not
/// black, and come from within the cones.
fn load_samples(
    scene: &RenderScene,
    errors: &RuntimeErrors,
    points: &[LightPoint],
    rays: &mut [RayOfCall],
    queries: &mut ThreadMemory,
) -> Vec<Option<LightAtPoint>> {
    let ThreadMemory { batch, light, shading_calls, .. } = &mut *queries;
    batch.count = points.len();
    let surface = |point: &LightPoint| rays[point.ray as usize].surface;
    let normal = |point| surface(point).map_or([0.0; 3], |surface| surface.normal());
    let sides = shading_calls.lit_sides(points.iter().map(|point| (normal(point), point.cone)));
    for (place, (point, side)) in points.iter().zip(sides).enumerate() {
        let ray = &mut rays[point.ray as usize];
        let up = [[0.0, 0.0, 1.0]; 2];
        let normals = ray.surface.map_or(up, |surface| surface.lit_normals(*side));
        batch.surfaces.set_vector(QueryColumns::POINT, place, point.point);
        batch.surfaces.set_vector(QueryColumns::GEOMETRIC_NORMAL, place, normals[0]);
        batch.surfaces.set_vector(QueryColumns::SHADING_NORMAL, place, normals[1]);
        batch.surfaces.column_mut(QueryColumns::OFFSET)[place] =
            ray.surface.map_or(0.0, |surface| surface.offset);
        batch.side[place] = 1.0;
        batch.surfaces.column_mut(QueryColumns::TIME)[place] = ray.time;
        batch.samples[place] = ray.numbers.sample;
        batch.keys[place] = ray.numbers.begin(Purpose::LightSample);
    }
    let count = scene.lights.entries.len() as u32;
    let chosen: Vec<u32> = points.iter().map(|point| point.light.min(count - 1)).collect();
    light.sample_chosen(scene, errors, batch, &chosen, Weights::Left);
    let samples = (0..points.len()).map(|place| LightAtPoint::of_batch(batch, place));
    let lit = shading_calls.are_in_cones(
        samples
            .clone()
            .zip(points)
            .map(|(sample, point)| (sample.direction, sample.color, point.cone)),
    );
    let lit = lit.zip(points).map(|(is_in_cone, point)| is_in_cone && point.light < count);
    samples.zip(lit).map(|(sample, is_lit)| is_lit.then_some(sample)).collect()
}
