//! Calls of environment lights for rays that leave the scene.

use fearless_simd::{Level, Simd, dispatch};
use rtsl::{Kernel, Method};

use super::path_tracer::PathTracer;
use super::rows::{BATCH_LANES, Rows, get, set};
use super::shading_batch::ShadingBatch;
use super::wavefront::Path;
use crate::compiled::calls::Callee;
use crate::compiled::variables::variables;
use crate::lanes::eight::eights_of;
use crate::lights::Sky;

impl PathTracer<'_> {
    /// Computes the radiance of an environment light along the rays of a batch.
    pub fn compute_sky(&self, sky: &Sky, batch: &mut ShadingBatch) {
        dispatch!(Level::new(), simd => self.set_sky_rays(simd, sky, batch));
        self.call_sky(sky, Method::Emission, &sky.emission, batch);
    }

    fn call_sky(&self, sky: &Sky, method: Method, kernel: &Kernel, batch: &mut ShadingBatch) {
        let name = &sky.program.class().name;
        let callee = Callee { class: name, method, errors: self.errors };
        let (objects, index) = &sky.objects;
        let ShadingBatch { count, state, scratch, random, .. } = batch;
        let instances = rtsl::Instances::Object(objects, *index);
        callee.call_for_first(kernel, *count, instances, (state, scratch), None, random);
    }

    #[inline(always)]
    fn set_sky_rays<S: Simd>(&self, simd: S, sky: &Sky, batch: &mut ShadingBatch) {
        let v = variables();
        let light = &self.scene.compiled.lights[sky.light as usize];
        for eight in eights_of(simd, batch.count) {
            let up = eight.splat_vector([0.0, 0.0, 1.0]);
            let direction = eight.vector(&light.inverse, &eight.vectors(&batch.direction));
            let direction = eight.normalized_or(&direction, &up);
            let origin = eight.point(&light.inverse, &eight.vectors(&batch.origin));
            let state = &mut batch.state;
            eight.store_vectors(state, v.ray_origin, &origin);
            eight.store_vectors(state, v.ray_direction, &direction);
            eight.store_vectors(state, v.light_direction, &direction);
            eight.store(state, v.time_seed, eight.floats(&batch.time));
        }
    }

    /// Computes the densities with which light samples at the origins of a batch's rays choose their directions. Returns
    /// false if the light is never sampled.
    pub fn compute_sky_densities(&self, sky: &Sky, batch: &mut ShadingBatch) -> bool {
        let Some((kernel, entry)) = &sky.density else { return false };
        dispatch!(Level::new(), simd => {
            self.set_sky_rays(simd, sky, batch);
            self.set_sky_points(simd, sky, batch);
        });
        self.call_sky(sky, Method::EvaluatePdf, kernel, batch);
        let (lights, count, origin) = (&self.scene.lights, batch.count, batch.origin);
        let way = lights.way_to_entry(*entry);
        let selector = lights.selector(&self.scene.engine);
        batch.selection_probabilities(selector, count, |lane| (way, get(&origin, lane)));
        let ShadingBatch { light_density, state, selection, .. } = batch;
        let own = state.floats(variables().pdf).iter().zip(selection.floats(4));
        light_density[..count].iter_mut().zip(own).for_each(|(to, (own, part))| *to = own * part);
        true
    }

    /// Sets the points for which an environment light may have been sampled: the origins of the rays.
    #[inline(always)]
    fn set_sky_points<S: Simd>(&self, simd: S, sky: &Sky, batch: &mut ShadingBatch) {
        let v = variables();
        let light = &self.scene.compiled.lights[sky.light as usize];
        for eight in eights_of(simd, batch.count) {
            let point = eight.point(&light.inverse, &eight.vectors(&batch.origin));
            eight.store_vectors(&mut batch.state, v.hit_point, &point);
            if sky.reads_normals {
                let up = eight.splat_vector([0.0, 0.0, 1.0]);
                for (variable, normal) in [
                    (v.geometric_normal, &batch.geometric_normal),
                    (v.shading_normal, &batch.shading_normal),
                ] {
                    let normal = eight.transposed_vector(&light.forward, &eight.vectors(normal));
                    let normal = eight.normalized_or(&normal, &up);
                    eight.store_vectors(&mut batch.state, variable, &normal);
                }
            }
        }
    }
}

impl ShadingBatch {
    /// Loads paths whose rays left the scene, with the random numbers that `purpose` selects.
    pub fn load_left(&mut self, paths: &[Path], left: &[u32], purpose: u32) {
        self.count = left.len().min(BATCH_LANES);
        let Some(last) = left.last() else { return };
        let padding = std::iter::repeat_n(last, self.count.next_multiple_of(8) - self.count);
        let normals = |path: &Path, to: [&mut Rows; 2], lane: usize| {
            let [geometric, shading] = to;
            set(geometric, lane, path.geometric_normal);
            set(shading, lane, path.shading_normal);
        };
        for (lane, index) in left.iter().chain(padding).enumerate() {
            let path = &paths[*index as usize];
            self.hits[lane].path = *index;
            set(&mut self.origin, lane, path.origin);
            set(&mut self.direction, lane, path.direction);
            normals(path, [&mut self.geometric_normal, &mut self.shading_normal], lane);
            self.time[lane] = path.time;
            self.keys[lane] = path.key;
            self.samples[lane] = path.sample;
        }
        self.start_random_numbers(purpose);
    }
}
