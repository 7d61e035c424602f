//! Scattering: at a surface, paths gather light from a light sample and continue in a direction that the material
//! samples.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8, mask32x8};
use rtsl::Method;
use rtsl_math::dot;
use rtsl_math::sampling::NUMBERS_OF_SHAPES;

use super::emission::weight;
use super::features::PathFeatures;
use super::lights::LightMemory;
use super::material::{EvaluationKernels, ScatteringKernels};
use super::memory::BatchMemory;
use super::path_tracer::PathTracer;
use super::random_numbers::{derive_keys, lone_random_number};
use super::rows::{BATCH_LANES, BatchLanes, are_finite, get, set};
use super::shading_batch::{LightRows, ShadingBatch};
use super::shadow_rays::ShadowRays;
use super::surface_group::SurfaceGroup;
use super::wavefront::{Path, PathHit, Wavefront};
use crate::compiled::variables::{variables, vector};
use crate::lanes::eight::{Eight, Vectors, dots, eights_of, is_finite, is_lit, scaled, select};
use crate::lanes::surface_offset::off_surfaces;

// These select the random numbers of a vertex by their use: independent sequences.
const NUMBERS_OF_MATERIALS: u32 = 0x103;
const NUMBERS_OF_ROULETTE: u32 = 0x104;
const NUMBERS_OF_NEXT_VERTEX: u32 = 0x105;

impl PathTracer<'_> {
    /// Processes paths that hit surfaces of one group after `depth` others.
    pub fn scatter(
        &self,
        group: &SurfaceGroup,
        hits: std::ops::Range<usize>,
        depth: u32,
        memory: &mut BatchMemory,
    ) {
        let BatchMemory { wavefront, batch, light, shadow_rays, shade, rays, .. } = memory;
        for start in hits.clone().step_by(BATCH_LANES) {
            let hits = &wavefront.sorted[start..hits.end.min(start + BATCH_LANES)];
            batch.load(&wavefront.paths, hits, NUMBERS_OF_SHAPES);
            self.prepare_surfaces(group, batch);
            batch.set_depth(depth);
            batch.start_random_numbers(NUMBERS_OF_MATERIALS);
            self.add_emission(group, batch, &mut wavefront.paths);
            if depth == 0 && self.with_features {
                note_surfaces(batch, wavefront);
            }
            if group.material.shade.is_some()
                && let Some(shade) = shade
            {
                *rays +=
                    self.add_shading(batch.hits().to_vec(), depth, &mut wavefront.paths, shade);
            }
            let Some(scattering) = &group.material.scattering else { continue };
            if depth >= self.scene.compiled.settings.max_depth {
                continue;
            }
            let ShadingBatch { random, keys, count, lobe_seeds, light_seeds, .. } = &mut **batch;
            random.pairs(keys, 1, *count, [lobe_seeds, light_seeds]);
            if let Some(evaluate) = &scattering.evaluate
                && !self.scene.lights.is_empty()
            {
                self.gather_light(group, evaluate, batch, light, &mut wavefront.paths);
                add_shadow_rays(batch, shadow_rays);
            }
            self.choose_directions(group, scattering, batch, &mut wavefront.paths);
            if depth == 0 && self.with_features {
                note_albedo(batch, wavefront);
            }
            self.send_on(batch, depth, &mut wavefront.paths, &mut wavefront.active);
        }
    }

    /// Samples a light for each lane, and evaluates the light scattered by the material.
    fn gather_light(
        &self,
        group: &SurfaceGroup,
        evaluate: &EvaluationKernels,
        batch: &mut ShadingBatch,
        light: &mut LightMemory,
        paths: &mut [Path],
    ) {
        self.sample_lights(batch, light);
        let v = variables();
        dispatch!(Level::new(), simd => for eight in eights_of(simd, batch.count) {
            let direction = eight.vectors(&batch.light.direction);
            eight.store_vectors(&mut batch.state, v.light_direction, &direction);
        });
        self.call_material(group, Method::Bsdf, &evaluate.bsdf, batch);
        self.call_material(group, Method::EvaluatePdf, &evaluate.density, batch);
        let mut lost = BatchLanes::NONE;
        dispatch!(Level::new(), simd => for eight in eights_of(simd, batch.count) {
            let Scattered { color, is_lit, is_lost } = scattered_light(eight, batch);
            // Until the cause is known.
            let color = select(is_lost, &eight.vectors(&batch.light.color), &color);
            eight.blend_vectors(&color, &mut batch.light.color);
            let origin = origins(eight, batch, &eight.vectors(&batch.light.direction));
            eight.blend_vectors(&origin, &mut batch.light.origin);
            lost.set_eight(eight.start(), is_lost.to_bitmask() as u8);
            batch.light.lanes.set_eight(eight.start(), (is_lit | is_lost).to_bitmask() as u8);
        });
        self.blame(&lost, batch, paths, |lane| self.whose_light(group, batch, light, lane));
        for lane in lost.among(batch.count) {
            // Occluded light does not affect the path.
            set(&mut batch.light.color, lane, [f32::NAN; 3]);
        }
    }

    /// Returns the method that caused a lane's light to be infinite or NaN.
    fn whose_light(
        &self,
        group: &SurfaceGroup,
        batch: &ShadingBatch,
        light: &LightMemory,
        lane: usize,
    ) -> (&str, Method) {
        let v = variables();
        let LightRows { color, direction, .. } = &batch.light;
        if !are_finite(&get(color, lane)) || !are_finite(&get(direction, lane)) {
            return self.scene.lights.sampled_method(light.chosen(lane), &self.scene.materials);
        }
        let is_density = are_finite(&vector(&batch.state, v.bsdf_value, lane))
            && batch.state.floats(v.pdf)[lane].is_nan();
        let method = if is_density { Method::EvaluatePdf } else { Method::Bsdf };
        (self.material_name(group), method)
    }

    /// Reports the methods whose values make the radiance of the paths of `lanes` infinite or NaN, once for each path.
    fn blame<'a>(
        &self,
        lanes: &BatchLanes,
        batch: &ShadingBatch,
        paths: &mut [Path],
        whose: impl Fn(usize) -> (&'a str, Method),
    ) {
        if lanes.is_empty() {
            return;
        }
        for lane in lanes.among(batch.count) {
            let path = &mut paths[batch.hits[lane].path as usize];
            if !std::mem::replace(&mut path.is_blamed, true) {
                let (class, method) = whose(lane);
                self.report_lost(class, method, 1);
            }
        }
    }

    /// Samples a direction of the material for each lane.
    fn choose_directions(
        &self,
        group: &SurfaceGroup,
        scattering: &ScatteringKernels,
        batch: &mut ShadingBatch,
        paths: &mut [Path],
    ) {
        let ShadingBatch { random, keys, count, state, lobe_seeds, .. } = batch;
        let [first, second, third] = state.vectors_mut(variables().bsdf_seed);
        random.pairs(keys, 0, *count, [first, second]);
        third.copy_from_slice(lobe_seeds);
        self.call_material(group, Method::SampleBsdf, &scattering.sample, batch);
        dispatch!(Level::new(), simd => for eight in eights_of(simd, batch.count) {
            let (goes_on, is_lost) = take_directions(eight, batch);
            batch.onward.lanes.set_eight(eight.start(), goes_on.to_bitmask() as u8);
            batch.onward.lost.set_eight(eight.start(), is_lost.to_bitmask() as u8);
        });
        let name = self.material_name(group);
        self.blame(&batch.onward.lost, batch, paths, |_| (name, Method::SampleBsdf));
        for lane in batch.onward.lost.among(batch.count) {
            paths[batch.hits[lane].path as usize].radiance = [f32::NAN; 3];
        }
        let ShadingBatch { keys, count, onward, .. } = batch;
        derive_keys(keys, NUMBERS_OF_NEXT_VERTEX, *count, &mut onward.keys);
    }

    /// Continues the paths that survive Russian roulette.
    fn send_on(&self, batch: &ShadingBatch, depth: u32, paths: &mut [Path], active: &mut Vec<u32>) {
        let scene = &self.scene.compiled;
        let threshold = if depth > 0 { scene.settings.roulette_threshold } else { 0.0 };
        let onward = &batch.onward;
        for lane in onward.lanes.among(batch.count) {
            let PathHit { path: index, .. } = batch.hits[lane];
            let path = &mut paths[index as usize];
            let mut throughput = get(&onward.throughput, lane);
            // Filters may have negative weights.
            let survival = throughput.into_iter().fold(0.0, |most: f32, it| most.max(it.abs()));
            if survival < threshold {
                if lone_random_number(path.key, NUMBERS_OF_ROULETTE, path.sample) >= survival {
                    continue;
                }
                throughput = throughput.map(|channel| channel / survival);
            }
            let side = batch.side[lane];
            let seen = |normal: [f32; 3]| normal.map(|component| component * side);
            path.origin = get(&onward.origin, lane);
            path.direction = get(&onward.direction, lane);
            path.epsilon = scene.epsilon;
            path.distance = f32::INFINITY;
            path.limit = f32::INFINITY;
            path.width = batch.width[lane];
            path.spread = onward.spread[lane];
            path.throughput = throughput;
            path.density = onward.density[lane];
            path.geometric_normal = seen(get(&batch.geometric_normal, lane));
            path.shading_normal = seen(get(&batch.shading_normal, lane));
            path.key = onward.keys[lane];
            active.push(index);
        }
    }
}

/// Adds the rays towards light samples that contribute.
fn add_shadow_rays(batch: &ShadingBatch, to: &mut ShadowRays) {
    let light = &batch.light;
    let lanes: Vec<u32> = light.lanes.among(batch.count).map(|lane| lane as u32).collect();
    let [ox, oy, oz] = light.origin.each_ref().map(|row| &row[..]);
    let [dx, dy, dz] = light.direction.each_ref().map(|row| &row[..]);
    let [red, green, blue] = light.color.each_ref().map(|row| &row[..]);
    let columns = [ox, oy, oz, dx, dy, dz, &light.distance, red, green, blue];
    for (to, from) in to.columns_mut().zip(columns) {
        to.extend(lanes.iter().map(|lane| from[*lane as usize]));
    }
    let each = || lanes.iter().map(|lane| *lane as usize);
    to.times.extend(each().map(|lane| batch.time[lane]));
    to.paths.extend(each().map(|lane| batch.hits[lane].path));
    to.sequences.extend(each().map(|lane| [batch.keys[lane], batch.samples[lane]]));
}

/// The spread of rays after scattering: at least a fraction of the cone that a direction of this density per solid
/// angle represents. Delta directions keep the spread `before`.
#[inline(always)]
fn spreads<S: Simd>(eight: Eight<S>, before: f32x8<S>, density: f32x8<S>) -> f32x8<S> {
    const PART: f32 = 0.1;
    let least = density.simd_gt(0.0).select(PART / density.sqrt(), eight.splat(0.0));
    before.simd_ge(least).select(before, least)
}

/// Records the features of the paths' first surfaces; for emitters, the emission.
fn note_surfaces(batch: &ShadingBatch, wavefront: &mut Wavefront) {
    for (lane, hit) in batch.hits().iter().enumerate() {
        let path = &wavefront.paths[hit.path as usize];
        let direction = get(&batch.direction, lane);
        let glow = std::array::from_fn(|channel| {
            // The path's radiance contains only this emission so far.
            (path.radiance[channel] / path.throughput[channel]).clamp(0.0, 1.0)
        });
        wavefront.features[hit.path as usize] = PathFeatures {
            albedo: glow,
            normal: get(&batch.shading_normal, lane),
            distance: batch.distance[lane] * dot(direction, direction).sqrt(),
            object: hit.object as f32,
        };
    }
}

/// Records the albedo.
fn note_albedo(batch: &ShadingBatch, wavefront: &mut Wavefront) {
    for lane in batch.onward.lanes.among(batch.count) {
        let (before, after) = (get(&batch.throughput, lane), get(&batch.onward.throughput, lane));
        let features = &mut wavefront.features[batch.hits[lane].path as usize];
        for (channel, albedo) in features.albedo.iter_mut().enumerate() {
            *albedo += after[channel] / before[channel];
        }
    }
}

/// The scattered light of light samples.
struct Scattered<S: Simd> {
    color: Vectors<S>,
    /// True if it is not black.
    is_lit: mask32x8<S>,
    /// True if it is not finite.
    is_lost: mask32x8<S>,
}

/// Returns the light of samples that the material scatters, weighted against directions of the material.
#[inline(always)]
fn scattered_light<S: Simd>(eight: Eight<S>, batch: &ShadingBatch) -> Scattered<S> {
    let v = variables();
    let direction = eight.vectors(&batch.light.direction);
    let (cosine, is_consistent) = cosines(eight, batch, &direction);
    let value = eight.load_vectors(&batch.state, v.bsdf_value);
    let light_density = eight.floats(&batch.light.density);
    let is_weighed = light_density.simd_gt(0.0);
    let part = weight(light_density, eight.load(&batch.state, v.pdf));
    let factor = is_weighed.select(part, eight.splat(1.0)) * cosine;
    let light = eight.vectors(&batch.light.color);
    let throughput = eight.vectors(&batch.throughput);
    let color: Vectors<S> = std::array::from_fn(|channel| {
        throughput[channel] * value[channel] * light[channel] * factor
    });
    let is_finite_color = is_finite(&color);
    // Light that is black, behind the surface or not scattered contributes nothing, whatever its other factors are.
    let is_scattered = is_lit(&light) & is_lit(&value);
    let counts = is_scattered & (is_consistent | !is_finite(&direction));
    Scattered {
        is_lit: is_lit(&color) & is_finite_color & is_consistent,
        is_lost: counts & !is_finite_color,
        color,
    }
}

/// Stores the directions that the material sampled. Returns the lanes that continue, and those with values that are not
/// finite.
#[inline(always)]
fn take_directions<S: Simd>(
    eight: Eight<S>,
    batch: &mut ShadingBatch,
) -> (mask32x8<S>, mask32x8<S>) {
    let v = variables();
    let direction = eight.load_vectors(&batch.state, v.light_direction);
    let (cosine, is_consistent) = cosines(eight, batch, &direction);
    let value = eight.load_vectors(&batch.state, v.bsdf_value);
    let density = eight.load(&batch.state, v.pdf);
    let is_number = density.simd_eq(density);
    let has_density = density.simd_gt(0.0);
    let factor = has_density.select(cosine / density, eight.splat(1.0));
    let weight = scaled(&value, factor);
    let throughput = eight.vectors(&batch.throughput);
    let throughput: Vectors<S> =
        std::array::from_fn(|channel| throughput[channel] * weight[channel]);
    let density = has_density.select(density, eight.splat(0.0));
    let spread = spreads(eight, eight.floats(&batch.spread), density);
    let origin = origins(eight, batch, &direction);
    let onward = &mut batch.onward;
    eight.blend_vectors(&direction, &mut onward.direction);
    eight.blend_vectors(&origin, &mut onward.origin);
    eight.blend_vectors(&throughput, &mut onward.throughput);
    eight.blend(density, &mut onward.density);
    eight.blend(spread, &mut onward.spread);
    let is_direction = is_finite(&direction);
    let is_usable = is_finite(&throughput) & is_direction & is_number;
    let goes_on = is_lit(&throughput) & is_usable & is_consistent;
    // A black value is no direction, and neither is one into the wrong hemisphere.
    (goes_on, is_lit(&value) & !is_usable & (is_consistent | !is_direction))
}

/// Returns the origins of rays that leave the surfaces in these directions.
#[inline(always)]
fn origins<S: Simd>(eight: Eight<S>, batch: &ShadingBatch, direction: &Vectors<S>) -> Vectors<S> {
    let (point, normal) = (eight.vectors(&batch.point), eight.vectors(&batch.geometric_normal));
    off_surfaces(&point, &normal, direction, eight.floats(&batch.offset))
}

/// Returns the absolute cosines between directions and shading normals, and a mask of lanes for which both normals
/// agree on the side of the surface to which a direction leads: otherwise light would leak through it (Veach 1997,
/// section 5.3.3).
#[inline(always)]
fn cosines<S: Simd>(
    eight: Eight<S>,
    batch: &ShadingBatch,
    direction: &Vectors<S>,
) -> (f32x8<S>, mask32x8<S>) {
    let geometric = dots(direction, &eight.vectors(&batch.geometric_normal));
    let shading = dots(direction, &eight.vectors(&batch.shading_normal));
    (shading.abs(), (geometric * shading).simd_gt(0.0))
}
