//! Queries about lights.

use rtsl_math::SIMD_LANES;

use super::super::lights::Sky;
use super::super::memory::BatchMemory;
use super::super::rows::{get, set};
use super::super::wavefront::Path;
use super::host::{SceneHost, number, store, vector};
use crate::compiled::variables::{variables, vector as vector_of};

impl<'a> SceneHost<'a> {
    /// Samples a light for a point.
    pub fn sample_light(&mut self, ray: usize, operands: &[u32], results: &mut [u32]) {
        if self.tracer.scene.lights.is_empty() {
            return;
        }
        let state = &mut self.rays[ray];
        let key = state.numbers.begin_call();
        let BatchMemory { batch, light, .. } = &mut *self.queries;
        batch.count = 1;
        // Lights are sampled for a vector of points, of which this is one.
        for lane in 0..SIMD_LANES {
            set(&mut batch.point, lane, vector(operands, 0));
            set(&mut batch.geometric_normal, lane, vector(operands, 3));
            set(&mut batch.shading_normal, lane, vector(operands, 6));
            batch.offset[lane] = number(operands, 9);
            batch.light_seeds[lane] = number(operands, 10);
            batch.side[lane] = 1.0;
            batch.time[lane] = state.time;
            batch.keys[lane] = key;
            batch.samples[lane] = state.numbers.sample;
        }
        self.tracer.sample_lights(batch, light);
        let color = get(&batch.light.color, 0);
        if color == [0.0; 3] {
            return;
        }
        results[0] = 1;
        store(&mut results[1..], &get(&batch.light.direction, 0));
        store(&mut results[4..], &[batch.light.distance[0]]);
        store(&mut results[5..], &color);
        store(&mut results[8..], &[batch.light.density[0]]);
    }

    /// The radiance of an environment light along a ray.
    pub fn sky_emission(&mut self, ray: usize, operands: &[u32], results: &mut [u32]) {
        let path =
            Path { origin: vector(operands, 1), direction: vector(operands, 4), ..Path::NOWHERE };
        let Some(sky) = self.prepare_sky(ray, operands[0], path) else { return };
        let batch = &mut *self.queries.batch;
        self.tracer.compute_sky(sky, batch);
        store(results, &vector_of(&batch.state, variables().emission_color, 0));
    }

    /// The density with which light samples at a point choose a direction of an environment light.
    pub fn sky_density(&mut self, ray: usize, operands: &[u32], results: &mut [u32]) {
        let path = Path {
            origin: vector(operands, 1),
            geometric_normal: vector(operands, 4),
            shading_normal: vector(operands, 7),
            direction: vector(operands, 10),
            ..Path::NOWHERE
        };
        let Some(sky) = self.prepare_sky(ray, operands[0], path) else { return };
        let batch = &mut *self.queries.batch;
        if self.tracer.compute_sky_densities(sky, batch) {
            store(results, &[batch.light_density[0]]);
        }
    }

    /// Loads a path whose ray leaves the scene, with random numbers of its own.
    fn prepare_sky(&mut self, ray: usize, index: u32, path: Path) -> Option<&'a Sky> {
        let state = &mut self.rays[ray];
        let sky = self.tracer.scene.lights.skies.get(index as usize)?;
        let key = state.numbers.begin_call();
        let path = Path { time: state.time, key, sample: state.numbers.sample, ..path };
        self.queries.batch.load_left(&[path], &[0], 0);
        Some(sky)
    }
}
