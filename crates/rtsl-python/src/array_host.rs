//! The host of calls for arrays.

use pyo3::prelude::*;
use rtsl::host::{
    Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, PlainHost, PlainLight,
    RayLanes,
};
use rtsl_math::sampling::{hash, unit_float};

/// The answers that a call of Python asks for: radiance of rays, whether they are occluded, ambient light, lights
/// (direction, distance, color, density), and the seed of random numbers.
#[derive(FromPyObject)]
pub struct HostAnswers([f32; 3], bool, [f32; 3], Vec<([f32; 3], f32, [f32; 3], f32)>, u64);

/// A host that answers every ray alike, with random numbers by lane.
#[derive(Clone, Debug)]
pub struct ArrayHost {
    plain: PlainHost,
    seed: u32,
    /// The lane of the whole call that is lane 0 of this one.
    first: usize,
    /// The numbers that each lane has drawn.
    drawn: Vec<u32>,
}

impl ArrayHost {
    /// Creates the host; without answers nothing is there.
    pub fn new(answers: Option<HostAnswers>) -> ArrayHost {
        let Some(HostAnswers(trace, occluded, ambient, lights, seed)) = answers else {
            return ArrayHost { plain: PlainHost::default(), seed: 0, first: 0, drawn: Vec::new() };
        };
        let light =
            |(direction, distance, color, pdf)| PlainLight { direction, distance, color, pdf };
        let lights = lights.into_iter().map(light).collect();
        let plain = PlainHost { trace, occluded, ambient, rand: 0.0, lights };
        let seed = hash(seed as u32, (seed >> 32) as u32);
        ArrayHost { plain, seed, first: 0, drawn: Vec::new() }
    }

    /// Prepares for a call with `count` lanes from `first` on.
    pub fn begin(&mut self, first: usize, count: usize) {
        self.first = first;
        self.drawn.clear();
        self.drawn.resize(count, 0);
    }
}

impl Host for ArrayHost {
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        self.plain.trace(lanes, rays, radiance);
    }

    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        self.plain.occluded(lanes, rays)
    }

    fn light_count(&mut self) -> u32 {
        self.plain.light_count()
    }

    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        self.plain.light_sample(lanes, index, query, light)
    }

    fn ambient(&mut self) -> [f32; 3] {
        self.plain.ambient()
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        for lane in lanes.iter() {
            let of_call = lanes.base as usize + lane;
            let Some(drawn) = self.drawn.get_mut(of_call) else { continue };
            let key = hash(self.seed, (self.first + of_call) as u32);
            values[lane] = unit_float(hash(key, *drawn));
            *drawn += 1;
        }
    }
}
