//! Calls of environment lights for rays that leave the scene.

use rtsl::{Instances, Kernel, Method, QueryColumns};

use super::rows::BATCH_LANES;
use super::shading_batch::{ShadingBatch, selection_probabilities};
use super::wavefront::Path;
use crate::compiled::calls::Callee;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::lights::Sky;

impl Sky {
    /// Computes the radiance of the light along the rays of a batch, in the column for it.
    pub fn compute_radiance(
        &self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        batch: &mut ShadingBatch,
    ) {
        self.call(Method::Emission, &self.emission, scene, errors, batch);
    }

    /// Computes the densities with which light samples at the origins of a batch's rays choose their directions, in the
    /// column for them. Returns false if the light is never sampled.
    pub fn compute_densities(
        &self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        batch: &mut ShadingBatch,
    ) -> bool {
        let Some((kernel, entry)) = &self.density else { return false };
        self.call(Method::EvaluatePdf, kernel, scene, errors, batch);
        let lights = &scene.lights;
        let way = lights.way_to_entry(*entry);
        let ShadingBatch { count, surfaces, selection, .. } = batch;
        let origin = |lane: usize| surfaces.vector(QueryColumns::ORIGIN, lane);
        let selector = lights.selector(&scene.engine);
        let parts = selection_probabilities(selection, selector, *count, |it| (way, origin(it)));
        let densities = surfaces.column_mut(QueryColumns::DENSITY).iter_mut();
        densities.zip(parts).for_each(|(density, part)| *density *= part);
        true
    }

    fn call(
        &self,
        method: Method,
        kernel: &Kernel,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        batch: &mut ShadingBatch,
    ) {
        let light = &scene.compiled.lights[self.light as usize];
        let ShadingBatch { count, state, surfaces, random, .. } = batch;
        surfaces.set_map(QueryColumns::MAPS, 0..*count, &light.inverse);
        surfaces.set_map(QueryColumns::MAPS + 12, 0..*count, &light.forward);
        let name = &self.program.class().name;
        let callee = Callee { class: name, method, errors };
        let (objects, index) = &self.objects;
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
