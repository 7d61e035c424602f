//! A scene for integrators: the inside of a glowing sphere.
//!
//! Every ray from the inside finds a diffuse surface, which reflects half of the light and emits one half of a unit. So
//! the radiance is the sum 1/2 + 1/4 + ... up to the greatest number of reflections, at most 1, in every direction.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;
use rtsl::Query;
use rtsl::host::{Host, LaneColors, LaneFloats, LaneSet, RayLanes};

use crate::random::Stream;

/// The share of light that the surface reflects, and the radiance that it emits.
pub const HALF: f32 = 0.5;

/// The least distance of a hit.
const EPSILON: f32 = 1e-4;

/// The scene, with the sampler's numbers of each ray of a call.
pub struct Furnace {
    stream: Stream,
    /// The count of numbers that each ray has taken by `rand()`.
    taken: Vec<u32>,
}

impl Furnace {
    /// Creates the scene for calls with so many rays.
    pub fn new(stream: Stream, rays: usize) -> Furnace {
        Furnace { stream, taken: vec![0; rays] }
    }

    /// Returns the number that a ray takes next.
    fn next(&mut self, ray: usize) -> f32 {
        self.taken[ray] += 1;
        self.stream.number(ray as u64, NUMBERS_OF_RAND + self.taken[ray])
    }

    fn sample(&self, ray: u32, dimension: u32) -> f32 {
        self.stream.number(ray.into(), dimension % NUMBERS_OF_RAND)
    }
}

/// The first dimension of the numbers that `rand()` takes.
const NUMBERS_OF_RAND: u32 = 1 << 20;

impl Host for Furnace {
    fn trace(&mut self, lanes: LaneSet, _: &RayLanes, radiance: &mut LaneColors) {
        lanes.iter().for_each(|lane| radiance.iter_mut().for_each(|channel| channel[lane] = 1.0));
    }

    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        let is_blocked = |lane: usize| {
            let vector =
                |it: &[LaneFloats; 3]| Vec3::from_array([0, 1, 2].map(|axis| it[axis][lane]));
            let distance = hit(vector(&rays.origin), vector(&rays.direction), EPSILON);
            distance.is_some_and(|distance| distance < rays.limit[lane])
        };
        lanes.iter().filter(|lane| is_blocked(*lane)).fold(0, |bits, lane| bits | 1 << lane)
    }

    fn query(&mut self, ray: u32, query: Query, operands: &[u32], results: &mut [u32]) {
        let floats: Vec<f32> = operands.iter().map(|bits| f32::from_bits(*bits)).collect();
        let vector = |first: usize| Vec3::from_slice(&floats[first..first + 3]);
        match query {
            Query::NearestHit => {
                let found = hit(vector(0), vector(3), floats[6].max(EPSILON));
                if let Some(distance) = found.filter(|distance| *distance < floats[7]) {
                    (results[0], results[4]) = (1, distance.to_bits());
                }
            }
            Query::SurfaceProperties => {
                let point = (vector(6) + floats[3] * vector(9)).normalize_or(Vec3::Z);
                let (dpdu, dpdv) = point.any_orthonormal_pair();
                let normals = [point, point, point].map(|it| it.to_array()).concat();
                let tangents = [dpdu, dpdv].map(|it| it.to_array()).concat();
                let coordinates = vec![0.0; 5];
                let footprint = vec![0.0; 2];
                let all = [normals, coordinates, tangents, footprint, vec![EPSILON]].concat();
                set(results, all);
            }
            Query::Emission => set(results, [HALF; 3]),
            Query::Shade => set(results, [HALF + HALF; 3]),
            Query::Bsdf => set(results, [HALF * FRAC_1_PI; 3]),
            Query::BsdfPdf => {
                let inward = -normal_at(&floats);
                set(results, [inward.dot(vector(14)).max(0.0) * FRAC_1_PI]);
            }
            Query::SampleBsdf => {
                let inward = -normal_at(&floats);
                let (direction, cosine) = cosine_direction(inward, floats[14], floats[15]);
                let value = [HALF * FRAC_1_PI; 3];
                let density = [cosine * FRAC_1_PI];
                let relative_index = [1.0];
                let direction = direction.to_array().into_iter();
                set(results, direction.chain(value).chain(density).chain(relative_index));
            }
            Query::Sample => set(results, [self.sample(ray, 3 * operands[0])]),
            Query::SamplePair => {
                let first = 3 * operands[0] + 1;
                set(results, [self.sample(ray, first), self.sample(ray, first + 1)]);
            }
            // There are no lights to sample and no sky.
            Query::LightEmission
            | Query::LightPdf
            | Query::SampleLight
            | Query::SkyCount
            | Query::SkyEmission
            | Query::SkyPdf
            | Query::Contribute
            | Query::Spawn
            | Query::SpawnPath
            | Query::OwnShade
            | Query::UnshadowedLight => {}
        }
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        for lane in lanes.iter() {
            values[lane] = self.next(lanes.base as usize + lane);
        }
    }
}

/// Returns the least parameter above `epsilon` at which a ray meets the unit sphere.
fn hit(origin: Vec3, direction: Vec3, epsilon: f32) -> Option<f32> {
    let square = direction.length_squared();
    let half = origin.dot(direction) / square;
    let root = half * half - (origin.length_squared() - 1.0) / square;
    let root = if root >= 0.0 { root.sqrt() } else { return None };
    [-half - root, -half + root].into_iter().find(|distance| *distance > epsilon)
}

/// The outward normal at the surface that a query is about.
fn normal_at(floats: &[f32]) -> Vec3 {
    let (origin, direction) = (Vec3::from_slice(&floats[6..9]), Vec3::from_slice(&floats[9..12]));
    (origin + floats[3] * direction).normalize_or(Vec3::Z)
}

/// Returns a direction around a unit vector with a density proportional to the cosine, and the cosine.
fn cosine_direction(axis: Vec3, first: f32, second: f32) -> (Vec3, f32) {
    let radius = first.sqrt();
    let (sine, cosine_of_turn) = libm::sincosf(TAU * second);
    let (x, y) = axis.any_orthonormal_pair();
    let cosine = (1.0 - first).max(1e-6).sqrt();
    (radius * (cosine_of_turn * x + sine * y) + cosine * axis, cosine)
}

fn set(results: &mut [u32], values: impl IntoIterator<Item = f32>) {
    results.iter_mut().zip(values).for_each(|(result, value)| *result = value.to_bits());
}
