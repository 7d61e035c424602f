//! Emission of surfaces that paths hit, and of environment lights for rays that leave the scene.
//!
//! If the light could also have been sampled at the previous surface, the power heuristic weights the contribution of
//! the material's direction.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};
use rtsl::{Kernel, Method};

use super::lights::Sky;
use super::material::MaterialSource;
use super::path_tracer::PathTracer;
use super::rows::{BATCH_LANES, Row, Rows, are_finite, get, set};
use super::shading_batch::ShadingBatch;
use super::surface_group::SurfaceGroup;
use super::wavefront::{Path, Wavefront};
use crate::compiled::calls::Callee;
use crate::compiled::variables::variables;
use crate::lanes::eight::{Eight, eights_of};

/// Selects the random numbers of paths that leave the scene.
const NUMBERS_OF_SKIES: u32 = 0x108;

/// The weight of the power heuristic for a sample with density `one`, which another technique would generate with
/// density `other`. Both are per solid angle, and `one` is positive.
#[inline(always)]
pub fn weight<S: Simd>(one: f32x8<S>, other: f32x8<S>) -> f32x8<S> {
    let ratio = other / one;
    1.0 / (ratio * ratio + 1.0)
}

impl PathTracer<'_> {
    /// Adds the emission of a batch's surfaces.
    pub fn add_emission(&self, group: &SurfaceGroup, batch: &mut ShadingBatch, paths: &mut [Path]) {
        if let Some(kernel) = &group.material.emission {
            self.call_material(group, Method::Emission, kernel, batch);
            let lost = add(batch, paths, &[1.0; BATCH_LANES]);
            self.report_lost(self.material_name(group), Method::Emission, lost);
        }
        let Some((kernel, (class, of))) = group.emitter.as_ref().zip(group.key.emitter) else {
            return;
        };
        let emitters = &self.scene.materials[class];
        let name = &emitters.program.class().name;
        let callee = Callee { class: name, method: Method::Emission, errors: self.errors };
        let weights = self.weights_of_hits(group, batch);
        let ShadingBatch { count, state, scratch, emitters: of_lanes, random, .. } = batch;
        let instances = of.instances(&emitters.objects, of_lanes);
        callee.call_for_first(kernel, *count, instances, (state, scratch), None, random);
        let lost = add(batch, paths, &weights);
        self.report_lost(name, Method::Emission, lost);
    }

    /// Calls a method of the batch's materials.
    pub fn call_material(
        &self,
        group: &SurfaceGroup,
        method: Method,
        kernel: &Kernel,
        batch: &mut ShadingBatch,
    ) {
        let ShadingBatch {
            count, state, kept_scratch, scratch, objects, materials, random, ..
        } = batch;
        let (source, of) = group.key.material;
        let callee = Callee { class: self.material_name(group), method, errors: self.errors };
        match source {
            MaterialSource::Own => {
                let class = self.scene.compiled.class(group.key.class);
                let instances = of.instances(&class.objects, objects);
                callee.call_for_first(
                    kernel,
                    *count,
                    instances,
                    (state, kept_scratch),
                    None,
                    random,
                );
            }
            MaterialSource::Class(class) => {
                let class = &self.scene.materials[class];
                for array in 0..group.material_scratch {
                    scratch.words_mut(array).fill(0);
                }
                let instances = of.instances(&class.objects, materials);
                callee.call_for_first(kernel, *count, instances, (state, scratch), None, random);
            }
        }
    }

    /// The weights of the emission that directions found.
    fn weights_of_hits(&self, group: &SurfaceGroup, batch: &mut ShadingBatch) -> Row {
        let mut weights = [1.0; BATCH_LANES];
        if !group.key.is_sampled {
            return weights;
        }
        for lane in 0..batch.count {
            let entry = self.scene.lights.entry_of(&batch.hits[lane]);
            let origin = get(&batch.origin, lane);
            let probability = entry.map_or(0.0, |it| self.scene.lights.probability(it, origin));
            batch.light_density[lane] *= probability;
        }
        dispatch!(Level::new(), simd => for eight in eights_of(simd, batch.count) {
            set_weights(eight, &batch.density, &batch.light_density, &mut weights);
        });
        weights
    }

    /// Adds the environment lights for rays that left the scene.
    pub fn add_skies(&self, wavefront: &mut Wavefront, batch: &mut ShadingBatch) {
        let Wavefront { paths, left, .. } = wavefront;
        if self.scene.lights.skies.is_empty() {
            return;
        }
        for left in left.chunks(BATCH_LANES) {
            batch.load_left(paths, left, NUMBERS_OF_SKIES);
            for sky in &self.scene.lights.skies {
                let weights = self.weights_of_sky(sky, batch);
                self.compute_sky(sky, batch);
                let lost = add(batch, paths, &weights);
                self.report_lost(&sky.program.class().name, Method::Emission, lost);
            }
        }
    }

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

    /// The weights of the light that directions found in an environment light: 1 if it is never sampled, or the
    /// direction was not chosen by a density.
    fn weights_of_sky(&self, sky: &Sky, batch: &mut ShadingBatch) -> Row {
        let mut weights = [1.0; BATCH_LANES];
        if !self.compute_sky_densities(sky, batch) {
            return weights;
        }
        dispatch!(Level::new(), simd => for eight in eights_of(simd, batch.count) {
            set_weights(eight, &batch.density, &batch.light_density, &mut weights);
        });
        let densities = batch.light_density[..batch.count].iter().zip(&mut weights);
        let lost =
            densities.filter(|(density, _)| density.is_nan()).map(|(_, weight)| *weight = f32::NAN);
        self.report_lost(&sky.program.class().name, Method::EvaluatePdf, lost.count() as u64);
        weights
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
        for lane in 0..batch.count {
            let probability = self.scene.lights.probability(*entry, get(&batch.origin, lane));
            batch.light_density[lane] = batch.state.floats(variables().pdf)[lane] * probability;
        }
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

#[inline(always)]
fn set_weights<S: Simd>(eight: Eight<S>, density: &Row, light_density: &Row, weights: &mut Row) {
    let (density, light_density) = (eight.floats(density), eight.floats(light_density));
    let is_weighed = density.simd_gt(0.0) & light_density.simd_gt(0.0);
    let one = eight.splat(1.0);
    eight.blend(is_weighed.select(weight(density, light_density), one), weights);
}

/// Adds the weighted emission in the state to the paths' radiance. Returns the number of paths whose radiance it, and
/// not a weight, makes infinite or NaN.
fn add(batch: &ShadingBatch, paths: &mut [Path], weights: &Row) -> u64 {
    let v = variables();
    let mut lost = 0;
    let color = [0, 1, 2].map(|channel: usize| batch.state.floats(v.emission_color + channel));
    for lane in 0..batch.count {
        let path = &mut paths[batch.hits[lane].path as usize];
        let arriving = path.throughput.iter().zip(&color);
        for (radiance, (throughput, color)) in path.radiance.iter_mut().zip(arriving) {
            *radiance += throughput * color[lane] * weights[lane];
        }
        if !are_finite(&path.radiance) && !path.is_blamed {
            path.is_blamed = true;
            lost += u64::from(!weights[lane].is_nan());
        }
    }
    lost
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
            self.density[lane] = path.density;
            self.time[lane] = path.time;
            self.keys[lane] = path.key;
            self.samples[lane] = path.sample;
        }
        self.start_random_numbers(purpose);
    }
}
