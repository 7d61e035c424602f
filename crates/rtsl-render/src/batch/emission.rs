//! What rays bring back from what they meet: emission of surfaces, and of lights that they leave the scene towards.
//!
//! Where the light could have been sampled at the last surface, too, the power heuristic weighs what the
//! material's direction found.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};
use rtsl::{Kernel, Method};

use super::lights::Sky;
use super::material::MaterialSource;
use super::shading_batch::{BATCH_LANES, Callee, Row, Rows, ShadingBatch, are_finite, get, set};
use super::surface_group::SurfaceGroup;
use super::tracer::PathTracer;
use super::wavefront::{Path, Wavefront};
use crate::compiled::variables::variables;
use crate::lanes::eight::{Eight, eights_of};

/// What the numbers of paths that leave the scene are for.
const NUMBERS_OF_SKIES: u32 = 0x108;

/// The part of a sample of density `one` that counts where another way finds the same by density `other`: the
/// power heuristic. Both are per solid angle, and `one` is positive.
#[inline(always)]
pub fn weight<S: Simd>(one: f32x8<S>, other: f32x8<S>) -> f32x8<S> {
    let ratio = other / one;
    1.0 / (ratio * ratio + 1.0)
}

impl PathTracer<'_> {
    /// Adds what the surfaces of a chunk emit.
    pub fn add_emission(&self, group: &SurfaceGroup, chunk: &mut ShadingBatch, paths: &mut [Path]) {
        if let Some(kernel) = &group.material.emission {
            self.call_material(group, Method::Emission, kernel, chunk);
            let lost = add(chunk, paths, &[1.0; BATCH_LANES]);
            self.report_lost(self.material_name(group), Method::Emission, lost);
        }
        let Some((kernel, (class, of))) = group.emitter.as_ref().zip(group.key.emitter) else {
            return;
        };
        let emitters = &self.scene.materials.classes[class as usize];
        let name = &emitters.program.class().name;
        let callee = Callee { class: name, method: Method::Emission, problems: self.problems };
        let weights = self.weights_of_hits(group, chunk);
        let ShadingBatch { count, state, scratch, emitters: of_lanes, numbers, .. } = chunk;
        let instances = of.instances(&emitters.objects, of_lanes);
        callee.call(kernel, *count, instances, (state, scratch), None, numbers);
        let lost = add(chunk, paths, &weights);
        self.report_lost(name, Method::Emission, lost);
    }

    /// The class whose methods the materials of a group are.
    pub fn material_name(&self, group: &SurfaceGroup) -> &str {
        match group.key.material.0 {
            MaterialSource::Own => &self.scene.compiled.classes[group.key.class as usize].name,
            MaterialSource::Class(class) => {
                &self.scene.materials.classes[class as usize].program.class().name
            }
        }
    }

    /// Says how many paths a method of a class gave what is not finite.
    pub fn report_lost(&self, class: &str, method: Method, lost: u64) {
        if lost > 0 {
            self.problems.report_not_finite(class, method, lost);
        }
    }

    /// Calls a method of the chunk's materials.
    pub fn call_material(
        &self,
        group: &SurfaceGroup,
        method: Method,
        kernel: &Kernel,
        chunk: &mut ShadingBatch,
    ) {
        let ShadingBatch {
            count, state, kept_scratch, scratch, objects, materials, numbers, ..
        } = chunk;
        let (source, of) = group.key.material;
        let callee = Callee { class: self.material_name(group), method, problems: self.problems };
        match source {
            MaterialSource::Own => {
                let class = &self.scene.compiled.classes[group.key.class as usize];
                let instances = of.instances(&class.objects, objects);
                callee.call(kernel, *count, instances, (state, kept_scratch), None, numbers);
            }
            MaterialSource::Class(class) => {
                let class = &self.scene.materials.classes[class as usize];
                for array in 0..group.material_scratch {
                    scratch.words_mut(array).fill(0);
                }
                let instances = of.instances(&class.objects, materials);
                callee.call(kernel, *count, instances, (state, scratch), None, numbers);
            }
        }
    }

    /// How much of what directions found counts.
    fn weights_of_hits(&self, group: &SurfaceGroup, chunk: &mut ShadingBatch) -> Row {
        let mut weights = [1.0; BATCH_LANES];
        if !group.key.is_sampled {
            return weights;
        }
        for lane in 0..chunk.count {
            let entry = self.scene.lights.entry_of(&chunk.hits[lane]);
            let origin = get(&chunk.origin, lane);
            let probability = entry.map_or(0.0, |it| self.scene.lights.probability(it, origin));
            chunk.light_density[lane] *= probability;
        }
        dispatch!(Level::new(), simd => for eight in eights_of(simd, chunk.count) {
            set_weights(eight, &chunk.density, &chunk.light_density, &mut weights);
        });
        weights
    }

    /// Adds what the rays bring back that left the scene.
    pub fn add_skies(&self, wave: &mut Wavefront, chunk: &mut ShadingBatch) {
        let Wavefront { paths, left, .. } = wave;
        if self.scene.lights.skies.is_empty() {
            return;
        }
        for left in left.chunks(BATCH_LANES) {
            chunk.load_left(paths, left, NUMBERS_OF_SKIES);
            for sky in &self.scene.lights.skies {
                let weights = self.weights_of_sky(sky, chunk);
                dispatch!(Level::new(), simd => self.set_sky_directions(simd, sky, chunk));
                self.call_sky(sky, Method::Emission, &sky.emission, chunk);
                let lost = add(chunk, paths, &weights);
                self.report_lost(&sky.program.class().name, Method::Emission, lost);
            }
        }
    }

    fn call_sky(&self, sky: &Sky, method: Method, kernel: &Kernel, chunk: &mut ShadingBatch) {
        let name = &sky.program.class().name;
        let callee = Callee { class: name, method, problems: self.problems };
        let (objects, number) = &sky.objects;
        let ShadingBatch { count, state, scratch, numbers, .. } = chunk;
        let instances = rtsl::Instances::Object(objects, *number);
        callee.call(kernel, *count, instances, (state, scratch), None, numbers);
    }

    #[inline(always)]
    fn set_sky_directions<S: Simd>(&self, simd: S, sky: &Sky, chunk: &mut ShadingBatch) {
        let v = variables();
        let light = &self.scene.compiled.lights[sky.light as usize];
        for eight in eights_of(simd, chunk.count) {
            let up = eight.splat_vector([0.0, 0.0, 1.0]);
            let direction = eight.vector(&light.inverse, &eight.vectors(&chunk.direction));
            let direction = eight.normalized_or(&direction, &up);
            let state = &mut chunk.state;
            eight.store_vectors(state, v.ray_direction, &direction);
            eight.store_vectors(state, v.light_direction, &direction);
            eight.store(state, v.time_seed, eight.numbers(&chunk.time));
        }
    }

    /// How much counts of what directions found in a light: all where it is never sampled, or the
    /// direction was not chosen by a density.
    fn weights_of_sky(&self, sky: &Sky, chunk: &mut ShadingBatch) -> Row {
        let mut weights = [1.0; BATCH_LANES];
        let Some((kernel, entry)) = &sky.density else { return weights };
        dispatch!(Level::new(), simd => {
            self.set_sky_directions(simd, sky, chunk);
            self.set_sky_points(simd, sky, chunk);
        });
        self.call_sky(sky, Method::EvaluatePdf, kernel, chunk);
        for lane in 0..chunk.count {
            let probability = self.scene.lights.probability(*entry, get(&chunk.origin, lane));
            chunk.light_density[lane] = chunk.state.floats(variables().pdf)[lane] * probability;
        }
        dispatch!(Level::new(), simd => for eight in eights_of(simd, chunk.count) {
            set_weights(eight, &chunk.density, &chunk.light_density, &mut weights);
        });
        let densities = chunk.light_density[..chunk.count].iter().zip(&mut weights);
        let lost =
            densities.filter(|(density, _)| density.is_nan()).map(|(_, weight)| *weight = f32::NAN);
        self.report_lost(&sky.program.class().name, Method::EvaluatePdf, lost.count() as u64);
        weights
    }

    /// Sets the points that a light was sampled for, if it was: where the rays begin.
    #[inline(always)]
    fn set_sky_points<S: Simd>(&self, simd: S, sky: &Sky, chunk: &mut ShadingBatch) {
        let v = variables();
        let light = &self.scene.compiled.lights[sky.light as usize];
        for eight in eights_of(simd, chunk.count) {
            let point = eight.point(&light.inverse, &eight.vectors(&chunk.origin));
            eight.store_vectors(&mut chunk.state, v.hit_point, &point);
            if sky.reads_normals {
                let up = eight.splat_vector([0.0, 0.0, 1.0]);
                for (variable, normal) in [
                    (v.geometric_normal, &chunk.geometric_normal),
                    (v.shading_normal, &chunk.shading_normal),
                ] {
                    let normal = eight.transposed_vector(&light.forward, &eight.vectors(normal));
                    let normal = eight.normalized_or(&normal, &up);
                    eight.store_vectors(&mut chunk.state, variable, &normal);
                }
            }
        }
    }
}

#[inline(always)]
fn set_weights<S: Simd>(eight: Eight<S>, density: &Row, light_density: &Row, weights: &mut Row) {
    let (density, light_density) = (eight.numbers(density), eight.numbers(light_density));
    let is_weighed = density.simd_gt(0.0) & light_density.simd_gt(0.0);
    let one = eight.splat(1.0);
    eight.blend(is_weighed.select(weight(density, light_density), one), weights);
}

/// Adds the emission in the state, weighted, to what the paths bring back. Returns how many paths bring back what is not
/// finite for it, and not for their weights.
fn add(chunk: &ShadingBatch, paths: &mut [Path], weights: &Row) -> u64 {
    let v = variables();
    let mut lost = 0;
    let color = [0, 1, 2].map(|channel: usize| chunk.state.floats(v.emission_color + channel));
    for lane in 0..chunk.count {
        let path = &mut paths[chunk.hits[lane].path as usize];
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
    /// Takes paths whose rays left the scene, with the numbers that `purpose` chooses.
    fn load_left(&mut self, paths: &[Path], left: &[u32], purpose: u32) {
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
        self.start_numbers(purpose);
    }
}
