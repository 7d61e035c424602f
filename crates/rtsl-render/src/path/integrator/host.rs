//! The host of an integrator: it answers queries of single rays.

use std::cell::RefCell;

use rtsl::Query;
use rtsl::host::{Host, LaneColors, LaneFloats, LaneSet, RayLanes};
use rtsl_bvh::{LANES, LaneMask, RayPacket, lanes_of};
use rtsl_math::dot;

use super::super::memory::BatchMemory;
use super::super::path_tracer::PathTracer;
use super::super::shadow_rays::ShadowRay;
use super::super::wavefront::{Path, Wavefront};
use super::Integrator;
use super::numbers::PathNumbers;
use super::tracing::{IntegratorMemory, MAX_DEPTH};
use crate::compiled::tracer::Tracer;
use crate::statistics::RayCounts;
use crate::tiles::LaneContext;
use crate::whitted::{PacketColors, SpawnedRays, Workspace};

/// A ray of a call, with what the integrator has asked for it so far.
pub struct RayOfCall {
    pub numbers: PathNumbers,
    /// The time within the shutter.
    pub time: f32,
    /// The sum of the contributions that nothing blocked.
    pub lit: [f32; 3],
    /// The distance and the object of the first surface that was found; `None` if there was no search yet, or no hit.
    pub first_hit: Option<(f32, f32)>,
    /// The number of searches.
    searches: u32,
}

impl RayOfCall {
    /// Creates the state of a path's ray.
    pub fn new(path: &Path) -> RayOfCall {
        RayOfCall {
            numbers: PathNumbers::new(path.key, path.sample),
            time: path.time,
            lit: [0.0; 3],
            first_hit: None,
            searches: 0,
        }
    }

    /// Returns the number of surfaces that the path has met before the last one found.
    pub fn surfaces_before(&self) -> u32 {
        self.searches.saturating_sub(1)
    }
}

/// The host of a call of an integrator.
pub struct SceneHost<'a> {
    pub tracer: PathTracer<'a>,
    pub integrator: &'a Integrator,
    /// The rays of the call.
    pub rays: &'a mut [RayOfCall],
    /// The memory of queries.
    pub queries: &'a mut BatchMemory,
    /// Memory for the rays that `trace` traces.
    pub free: &'a RefCell<Vec<IntegratorMemory>>,
    /// The depth of the rays.
    pub depth: u32,
}

impl Host for SceneHost<'_> {
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        for lane in lanes.iter() {
            let ray = &mut self.rays[lanes.base as usize + lane];
            let path = Path {
                origin: [0, 1, 2].map(|axis| rays.origin[axis][lane]),
                direction: [0, 1, 2].map(|axis| rays.direction[axis][lane]),
                epsilon: self.tracer.scene.compiled.epsilon,
                distance: rays.limit[lane],
                limit: rays.limit[lane],
                time: ray.time,
                key: ray.numbers.begin_child(),
                sample: ray.numbers.sample,
                ..Path::NOWHERE
            };
            let color = self.integrate_further(path);
            (0..3).for_each(|channel| radiance[channel][lane] = color[channel]);
        }
    }

    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        let mut occluded = 0;
        for lane in lanes.iter() {
            let vector = |from: &[LaneFloats; 3]| [0, 1, 2].map(|axis| from[axis][lane]);
            let (origin, direction) = (vector(&rays.origin), vector(&rays.direction));
            let ray = lanes.base as usize + lane;
            if !self.is_visible(ray, (origin, direction), rays.limit[lane]) {
                occluded |= 1 << lane;
            }
        }
        occluded
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        let sampler = &self.tracer.scene.compiled.settings.sampler;
        for lane in lanes.iter() {
            values[lane] = self.rays[lanes.base as usize + lane].numbers.draw(sampler);
        }
    }

    fn query(&mut self, ray: u32, query: Query, operands: &[u32], results: &mut [u32]) {
        let ray = ray as usize;
        match query {
            Query::NearestHit => self.nearest_hit(ray, operands, results),
            Query::SurfaceProperties
            | Query::Emission
            | Query::LightEmission
            | Query::LightPdf
            | Query::Bsdf
            | Query::BsdfPdf
            | Query::SampleBsdf
            | Query::Shade => self.ask_surface(ray, query, operands, results),
            Query::SampleLight => self.sample_light(ray, operands, results),
            Query::SkyCount => results[0] = self.tracer.scene.lights.skies.len() as u32,
            Query::SkyEmission => self.sky_emission(ray, operands, results),
            Query::SkyPdf => self.sky_density(ray, operands, results),
            Query::Contribute => self.contribute(ray, operands),
            Query::Sample => {
                let sampler = &self.tracer.scene.compiled.settings.sampler;
                results[0] = self.rays[ray].numbers.single(sampler, operands[0]).to_bits();
            }
            Query::SamplePair => {
                let sampler = &self.tracer.scene.compiled.settings.sampler;
                let numbers = self.rays[ray].numbers.pair(sampler, operands[0]);
                store(results, &numbers);
            }
        }
    }
}

impl SceneHost<'_> {
    fn nearest_hit(&mut self, ray: usize, operands: &[u32], results: &mut [u32]) {
        let state = &mut self.rays[ray];
        let epsilon = number(operands, 6);
        let path = Path {
            origin: vector(operands, 0),
            direction: vector(operands, 3),
            epsilon: if epsilon > 0.0 { epsilon } else { self.tracer.scene.compiled.epsilon },
            distance: number(operands, 7),
            limit: number(operands, 7),
            time: state.time,
            key: state.numbers.begin_search(),
            sample: state.numbers.sample,
            ..Path::NOWHERE
        };
        let BatchMemory { wavefront, searcher, batch, rays, .. } = &mut *self.queries;
        begin(wavefront, path);
        searcher.are_together = false;
        rays.traced += u64::from(state.searches > 0);
        self.tracer.find_hits(wavefront, searcher, batch);
        if let Some((_, hit)) = wavefront.hits.first() {
            let distance = wavefront.paths[0].distance;
            results.copy_from_slice(&[
                1,
                hit.object,
                hit.instance,
                hit.element,
                distance.to_bits(),
            ]);
            if state.searches == 0 {
                let length = dot(path.direction, path.direction).sqrt();
                state.first_hit = Some((distance * length, hit.object as f32));
            }
        }
        state.searches = state.searches.saturating_add(1);
    }

    fn contribute(&mut self, ray: usize, operands: &[u32]) {
        let color = vector(operands, 7);
        if color == [0.0; 3] {
            return;
        }
        if self.is_visible(ray, (vector(operands, 0), vector(operands, 3)), number(operands, 6)) {
            let lit = &mut self.rays[ray].lit;
            (0..3).for_each(|channel| lit[channel] += color[channel]);
        }
    }

    /// True if nothing is on a ray before the distance.
    fn is_visible(
        &mut self,
        ray: usize,
        (origin, direction): ([f32; 3], [f32; 3]),
        distance: f32,
    ) -> bool {
        let RayOfCall { numbers, time, .. } = &mut self.rays[ray];
        let memory = &mut *self.queries;
        begin(&mut memory.wavefront, Path::NOWHERE);
        memory.wavefront.active.clear();
        memory.shadow_rays.push(ShadowRay {
            origin,
            direction,
            distance,
            time: *time,
            color: [1.0; 3],
            path: 0,
            key: numbers.begin_call(),
            sample: numbers.sample,
        });
        self.tracer.trace_shadow_rays(memory);
        memory.wavefront.paths[0].radiance[0] > 0.0
    }

    /// Returns the radiance along the ray of a path that a method has traced; black beyond the greatest depth.
    fn integrate_further(&mut self, path: Path) -> [f32; 3] {
        let SceneHost { tracer, integrator, free, depth, .. } = self;
        let further = Further { tracer, integrator, free };
        let (color, counts) = further.integrate(path, *depth + 1);
        self.queries.rays += counts;
        color
    }
}

/// The integration of further rays, those that `trace` traces.
pub struct Further<'a> {
    pub tracer: &'a PathTracer<'a>,
    pub integrator: &'a Integrator,
    pub free: &'a RefCell<Vec<IntegratorMemory>>,
}

impl Further<'_> {
    /// Returns the radiance along the ray of a path, and the number of rays traced.
    fn integrate(&self, path: Path, depth: u32) -> ([f32; 3], RayCounts) {
        if depth > MAX_DEPTH.min(self.tracer.scene.compiled.settings.max_depth) {
            return Default::default();
        }
        let taken = self.free.borrow_mut().pop();
        let mut memory =
            taken.unwrap_or_else(|| IntegratorMemory::new(self.tracer.scene, self.integrator));
        let mut wavefront = Wavefront::default();
        begin(&mut wavefront, path);
        let mut counts = self.tracer.integrate(self.integrator, &mut wavefront, &mut memory, depth);
        counts.traced += 1;
        self.free.borrow_mut().push(memory);
        (wavefront.paths[0].radiance, counts)
    }
}

impl SpawnedRays for Further<'_> {
    fn radiance(
        &self,
        _: &Tracer<'_>,
        workspace: &mut Workspace,
        rays: &RayPacket,
        lanes: LaneMask,
        context: &mut LaneContext,
        depth: u32,
    ) -> PacketColors {
        let mut colors = [[0.0; LANES]; 3];
        for lane in lanes_of(lanes) {
            let key = context.streams.keys()[lane];
            let path = Path::from_ray(rays, lane, key, context.streams.sample());
            let (color, mut counts) = self.integrate(path, depth);
            // The spawning kernel has counted this ray.
            counts.traced = counts.traced.saturating_sub(1);
            workspace.rays += counts;
            (0..3).for_each(|channel| colors[channel][lane] = color[channel]);
        }
        colors
    }
}

/// Makes a wavefront of one path, whose ray is not traced yet.
fn begin(wavefront: &mut Wavefront, path: Path) {
    wavefront.paths.clear();
    wavefront.paths.push(path);
    wavefront.features.clear();
    wavefront.active.clear();
    wavefront.active.push(0);
}

/// Returns the operand at an index as a number.
pub fn number(operands: &[u32], index: usize) -> f32 {
    f32::from_bits(operands[index])
}

/// Returns the three operands from an index on as a vector.
pub fn vector(operands: &[u32], first: usize) -> [f32; 3] {
    [0, 1, 2].map(|axis| number(operands, first + axis))
}

/// Stores the first results.
pub fn store(results: &mut [u32], values: &[f32]) {
    results.iter_mut().zip(values).for_each(|(result, value)| *result = value.to_bits());
}
