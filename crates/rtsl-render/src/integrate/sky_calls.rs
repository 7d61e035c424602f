//! Calls of environment lights for rays that leave the scene.

use rtsl::{Instances, Kernel, Method, QueryColumns};

use super::path_tracer::PathTracer;
use super::rows::BATCH_LANES;
use super::shading_batch::{ShadingBatch, selection_probabilities};
use super::wavefront::Path;
use crate::compiled::calls::Callee;
use crate::lights::Sky;

impl PathTracer<'_> {
    /// Computes the radiance of an environment light along the rays of a batch, in the column for it.
    pub fn compute_sky(&self, sky: &Sky, batch: &mut ShadingBatch) {
        self.call_sky(sky, Method::Emission, &sky.emission, batch);
    }

    /// Computes the densities with which light samples at the origins of a batch's rays choose their directions, in the
    /// column for them. Returns false if the light is never sampled.
    pub fn compute_sky_densities(&self, sky: &Sky, batch: &mut ShadingBatch) -> bool {
        let Some((kernel, entry)) = &sky.density else { return false };
        self.call_sky(sky, Method::EvaluatePdf, kernel, batch);
        let lights = &self.scene.lights;
        let way = lights.way_to_entry(*entry);
        let ShadingBatch { count, surfaces, selection, .. } = batch;
        let origin = |lane: usize| surfaces.vector(QueryColumns::ORIGIN, lane);
        let selector = lights.selector(&self.scene.engine);
        let parts = selection_probabilities(selection, selector, *count, |it| (way, origin(it)));
        let densities = surfaces.column_mut(QueryColumns::DENSITY).iter_mut();
        densities.zip(parts).for_each(|(density, part)| *density *= part);
        true
    }

    fn call_sky(&self, sky: &Sky, method: Method, kernel: &Kernel, batch: &mut ShadingBatch) {
        let light = &self.scene.compiled.lights[sky.light as usize];
        let ShadingBatch { count, state, surfaces, random, .. } = batch;
        surfaces.set_map(QueryColumns::MAPS, 0..*count, &light.inverse);
        surfaces.set_map(QueryColumns::MAPS + 12, 0..*count, &light.forward);
        let name = &sky.program.class().name;
        let callee = Callee { class: name, method, errors: self.errors };
        let (objects, index) = &sky.objects;
        let instances = Instances::Object(objects, *index);
        callee.call_for_first(kernel, *count, instances, state, &mut surfaces.block, random);
    }
}

impl ShadingBatch {
    /// Loads paths whose rays left the scene, with the random numbers that `purpose` selects.
    pub fn load_left(&mut self, paths: &[Path], left: &[u32], purpose: u32) {
        self.count = left.len().min(BATCH_LANES);
        for (lane, index) in left.iter().take(self.count).enumerate() {
            let path = &paths[*index as usize];
            self.hits[lane].path = *index;
            for (column, vector) in [
                (QueryColumns::ORIGIN, path.origin),
                (QueryColumns::DIRECTION, path.direction),
                (QueryColumns::GEOMETRIC_NORMAL, path.geometric_normal),
                (QueryColumns::SHADING_NORMAL, path.shading_normal),
            ] {
                self.surfaces.set_vector(column, lane, vector);
            }
            self.surfaces.column_mut(QueryColumns::TIME)[lane] = path.time;
            self.keys[lane] = path.key;
            self.samples[lane] = path.sample;
        }
        self.start_random_numbers(purpose);
    }
}
