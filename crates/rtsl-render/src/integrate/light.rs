//! Queries about lights.

use rtsl::host::{LaneSet, LaneWords};
use rtsl::{Query, QueryColumns};

use super::host::{SceneHost, number, store, vector};
use super::memory::ThreadMemory;
use super::numbers::Purpose;
use super::rows::get;
use super::wavefront::Path;
use crate::lights::Sky;

impl<'a> SceneHost<'a> {
    /// Samples a light for the point of each lane.
    pub fn sample_lights(
        &mut self,
        lanes: LaneSet,
        operands: &[LaneWords],
        results: &mut [LaneWords],
    ) {
        if self.tracer.scene.lights.is_empty() {
            return;
        }
        let count = lanes.active.count_ones() as usize;
        for (place, lane) in lanes.iter().enumerate() {
            let ray = self.ray_of(lanes, lane);
            let state = &mut self.rays[ray];
            let key = state.numbers.begin(Purpose::LightSample);
            let batch = &mut *self.queries.batch;
            batch.surfaces.set_vector(QueryColumns::POINT, place, vector(operands, 0, lane));
            batch.surfaces.set_vector(
                QueryColumns::GEOMETRIC_NORMAL,
                place,
                vector(operands, 3, lane),
            );
            batch.surfaces.set_vector(
                QueryColumns::SHADING_NORMAL,
                place,
                vector(operands, 6, lane),
            );
            batch.surfaces.column_mut(QueryColumns::OFFSET)[place] = number(operands, 9, lane);
            batch.light_seeds[place] = number(operands, 10, lane);
            batch.side[place] = 1.0;
            batch.surfaces.column_mut(QueryColumns::TIME)[place] = state.time;
            batch.keys[place] = key;
            batch.samples[place] = state.numbers.sample;
        }
        let ThreadMemory { batch, light, .. } = &mut *self.queries;
        batch.count = count;
        light.sample_lights(self.tracer.scene, self.tracer.errors, batch);
        for (place, lane) in lanes.iter().enumerate() {
            let color = get(&batch.light.color, place);
            if color == [0.0; 3] {
                continue;
            }
            results[0][lane] = 1;
            store(&mut results[1..], lane, &get(&batch.light.direction, place));
            store(&mut results[4..], lane, &[batch.light.distance[place]]);
            store(&mut results[5..], lane, &color);
            store(&mut results[8..], lane, &[batch.light.density[place]]);
        }
    }

    /// Answers queries about environment lights, one light after another.
    pub fn ask_skies(
        &mut self,
        lanes: LaneSet,
        query: Query,
        operands: &[LaneWords],
        results: &mut [LaneWords],
    ) {
        let mut left = lanes.active;
        while left != 0 {
            let index = operands[0][left.trailing_zeros() as usize];
            let same = lanes.iter().filter(|lane| operands[0][*lane] == index);
            let active = same.fold(0, |set, lane| set | 1 << lane);
            left &= !active;
            let Some(sky) = self.tracer.scene.lights.skies.get(index as usize) else { continue };
            let lanes = LaneSet { active: active & lanes.active, ..lanes };
            if query == Query::SkyEmission {
                self.sky_emission(sky, lanes, operands, results);
            } else {
                self.sky_density(sky, lanes, operands, results);
            }
        }
    }

    /// The radiance of an environment light along rays.
    fn sky_emission(
        &mut self,
        sky: &'a Sky,
        lanes: LaneSet,
        operands: &[LaneWords],
        results: &mut [LaneWords],
    ) {
        self.load_left(lanes, |lane| Path {
            origin: vector(operands, 1, lane),
            direction: vector(operands, 4, lane),
            ..Path::NOWHERE
        });
        let batch = &mut *self.queries.batch;
        sky.compute_radiance(self.tracer.scene, self.tracer.errors, batch);
        for (place, lane) in lanes.iter().enumerate() {
            let channel =
                |channel: usize| batch.surfaces.column(QueryColumns::RADIANCE + channel)[place];
            store(results, lane, &[0, 1, 2].map(channel));
        }
    }

    /// The density with which light samples at points choose directions of an environment light.
    fn sky_density(
        &mut self,
        sky: &'a Sky,
        lanes: LaneSet,
        operands: &[LaneWords],
        results: &mut [LaneWords],
    ) {
        self.load_left(lanes, |lane| Path {
            origin: vector(operands, 1, lane),
            geometric_normal: vector(operands, 4, lane),
            shading_normal: vector(operands, 7, lane),
            direction: vector(operands, 10, lane),
            ..Path::NOWHERE
        });
        let batch = &mut *self.queries.batch;
        if sky.compute_densities(self.tracer.scene, self.tracer.errors, batch) {
            for (place, lane) in lanes.iter().enumerate() {
                store(results, lane, &[batch.surfaces.column(QueryColumns::DENSITY)[place]]);
            }
        }
    }

    /// Loads paths whose rays leave the scene, with random numbers of their own.
    fn load_left(&mut self, lanes: LaneSet, path: impl Fn(usize) -> Path) {
        let mut paths = Vec::new();
        for lane in lanes.iter() {
            let ray = self.ray_of(lanes, lane);
            let state = &mut self.rays[ray];
            let key = state.numbers.begin(Purpose::Sky);
            let (time, sample) = (state.time, state.numbers.sample);
            paths.push(Path { time, key, sample, ..path(lane) });
        }
        let indices: Vec<u32> = (0..paths.len() as u32).collect();
        self.queries.batch.load_left(&paths, &indices, 0);
    }
}
