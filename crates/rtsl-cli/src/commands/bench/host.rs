//! The host of benchmarked kernels.

use rtsl::COLOR_COMPONENTS;
use rtsl::host::{
    Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, MAX_LANES, RayLanes,
};

/// The number of light samples.
const LIGHTS: u32 = 2;
/// One of this many rays is occluded.
const BLOCKED_RAYS: u32 = 4;
/// Unit vectors towards lights; each ray gets a random one.
const DIRECTIONS: [[f32; 3]; 8] = [
    [0.0, 0.6, 0.8],
    [0.6, 0.0, -0.8],
    [-0.8, 0.6, 0.0],
    [0.8, -0.6, 0.0],
    [0.0, -0.8, -0.6],
    [-0.6, 0.0, 0.8],
    [0.28, 0.96, 0.0],
    [0.0, 0.28, -0.96],
];
const DISTANCE: f32 = 3.0;
const DENSITY: f32 = 0.5;

/// Answers requests without a scene: grey radiance, two lights that reach most points, random numbers by a hash of the
/// ray. It takes little time compared with the kernels.
#[derive(Clone, Copy, Debug, Default)]
pub struct BenchHost;

impl Host for BenchHost {
    fn trace(&mut self, _: LaneSet, _: &RayLanes, radiance: &mut LaneColors) {
        *radiance = [[0.5; MAX_LANES]; COLOR_COMPONENTS as usize];
    }

    fn occluded(&mut self, lanes: LaneSet, _: &RayLanes) -> u32 {
        let is_blocked = |lane: &usize| hash(lanes, *lane).is_multiple_of(BLOCKED_RAYS);
        lanes.iter().filter(is_blocked).fold(0, |blocked, lane| blocked | 1 << lane)
    }

    fn light_count(&mut self) -> u32 {
        LIGHTS
    }

    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        _: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        for lane in lanes.iter() {
            let direction = DIRECTIONS[(hash(lanes, lane) >> (8 + index)) as usize % 8];
            for (component, lanes) in direction.into_iter().zip(&mut light.direction) {
                lanes[lane] = component;
            }
        }
        light.distance = [DISTANCE; MAX_LANES];
        light.color = [[1.0; MAX_LANES]; COLOR_COMPONENTS as usize];
        light.pdf = [DENSITY; MAX_LANES];
        lanes.active & !self.occluded(lanes, &RayLanes::default())
    }

    fn ambient(&mut self) -> [f32; COLOR_COMPONENTS as usize] {
        [0.1; COLOR_COMPONENTS as usize]
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        for lane in lanes.iter() {
            values[lane] = (hash(lanes, lane) >> 8) as f32 / (1 << 24) as f32;
        }
    }
}

fn hash(lanes: LaneSet, lane: usize) -> u32 {
    let mixed = (lanes.base + lane as u32 + 1).wrapping_mul(0x9e37_79b9);
    (mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b)
}
