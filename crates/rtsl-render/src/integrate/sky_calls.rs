//! Calls of environment lights for rays that leave the scene.

use rtsl::{Instances, Kernel, Method, QueryColumns};

use super::path_tracer::PathTracer;
use super::rows::{BATCH_LANES, Rows, get, set};
use super::shading_batch::ShadingBatch;
use super::wavefront::Path;
use crate::compiled::calls::Callee;
use crate::lights::Sky;
use crate::surfaces::PlacedLanes;

impl PathTracer<'_> {
    /// Computes the radiance of an environment light along the rays of a batch, in the column for it.
    pub fn compute_sky(&self, sky: &Sky, batch: &mut ShadingBatch) {
        self.call_sky(sky, Method::Emission, &sky.emission, batch);
    }

    /// Computes the densities with which light samples at the origins of a batch's rays choose their directions. Returns
    /// false if the light is never sampled.
    pub fn compute_sky_densities(&self, sky: &Sky, batch: &mut ShadingBatch) -> bool {
        let Some((kernel, entry)) = &sky.density else { return false };
        self.call_sky(sky, Method::EvaluatePdf, kernel, batch);
        let (lights, count, origin) = (&self.scene.lights, batch.count, batch.origin);
        let way = lights.way_to_entry(*entry);
        let selector = lights.selector(&self.scene.engine);
        batch.selection_probabilities(selector, count, |lane| (way, get(&origin, lane)));
        let own = batch.column(QueryColumns::DENSITY).to_vec();
        let ShadingBatch { light_density, selection, .. } = batch;
        let own = own.into_iter().zip(selection.floats(4));
        light_density[..count].iter_mut().zip(own).for_each(|(to, (own, part))| *to = own * part);
        true
    }

    fn call_sky(&self, sky: &Sky, method: Method, kernel: &Kernel, batch: &mut ShadingBatch) {
        let (count, first) = (batch.count, self.scene.scratch_arrays());
        let rays = batch.origin.iter().chain(&batch.direction);
        let rays = (QueryColumns::ORIGIN..).zip(rays);
        let normals = batch.geometric_normal.iter().chain(&batch.shading_normal);
        let normals = (QueryColumns::GEOMETRIC_NORMAL..).zip(normals);
        for (column, row) in rays.chain(normals).chain([(QueryColumns::TIME, &batch.time)]) {
            let column = batch.kept_scratch.floats_mut(first + column);
            column[..count].copy_from_slice(&row[..count]);
        }
        let light = &self.scene.compiled.lights[sky.light as usize];
        let mut all = PlacedLanes { columns: &mut batch.kept_scratch, first, start: 0, end: count };
        all.fill_map(QueryColumns::MAPS, &light.inverse);
        all.fill_map(QueryColumns::MAPS + 12, &light.forward);
        let name = &sky.program.class().name;
        let callee = Callee { class: name, method, errors: self.errors };
        let (objects, index) = &sky.objects;
        let ShadingBatch { count, state, kept_scratch, random, .. } = batch;
        let instances = Instances::Object(objects, *index);
        callee.call_for_first(kernel, *count, instances, (state, kept_scratch), None, random);
    }
}

impl ShadingBatch {
    /// Loads paths whose rays left the scene, with the random numbers that `purpose` selects.
    pub fn load_left(&mut self, paths: &[Path], left: &[u32], purpose: u32) {
        self.count = left.len().min(BATCH_LANES);
        let normals = |path: &Path, to: [&mut Rows; 2], lane: usize| {
            let [geometric, shading] = to;
            set(geometric, lane, path.geometric_normal);
            set(shading, lane, path.shading_normal);
        };
        for (lane, index) in left.iter().take(self.count).enumerate() {
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
