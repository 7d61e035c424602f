//! What happens to paths at surfaces: they gather light from a sample of the lights, and go on in a direction
//! that the material chooses.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8, mask32x8};
use rtsl::Method;
use rtsl_math::dot;

use super::emission::weight;
use super::features::PathFeatures;
use super::lights::LightMemory;
use super::material::{EvaluationKernels, ScatteringKernels};
use super::numbers::{derive_keys, lone_number};
use super::shading_batch::{
    BATCH_LANES, ChunkLanes, LightRows, ShadingBatch, are_finite, get, set,
};
use super::shadow_rays::ShadowRay;
use super::surface::ChunkSurfaces;
use super::surface_group::SurfaceGroup;
use super::tracer::{BatchMemory, PathTracer};
use super::wavefront::{Path, PathHit, Wavefront};
use crate::compiled::variables::{variables, vector};
use crate::lanes::eight::{Eight, Vectors, dots, eights_of, is_finite, is_lit, scaled, select};
use crate::lanes::surface_offset::off_surfaces;

/// What the numbers of a vertex are for: sequences of their own.
pub const NUMBERS_OF_SHAPES: u32 = 0x102;
const NUMBERS_OF_MATERIALS: u32 = 0x103;
const NUMBERS_OF_ROULETTE: u32 = 0x104;
const NUMBERS_OF_NEXT_VERTEX: u32 = 0x105;

impl PathTracer<'_> {
    /// Works on paths that hit surfaces of one group after `depth` others.
    pub fn scatter(
        &self,
        group: &SurfaceGroup,
        hits: std::ops::Range<usize>,
        depth: u32,
        memory: &mut BatchMemory,
    ) {
        let BatchMemory { wave, chunk, light, shadow_rays, shade, rays, .. } = memory;
        for start in hits.clone().step_by(BATCH_LANES) {
            let hits = &wave.sorted[start..hits.end.min(start + BATCH_LANES)];
            chunk.load(&wave.paths, hits, NUMBERS_OF_SHAPES);
            ChunkSurfaces::new(self, group, chunk).prepare(chunk);
            chunk.start_numbers(NUMBERS_OF_MATERIALS);
            self.add_emission(group, chunk, &mut wave.paths);
            if depth == 0 && self.with_features {
                note_surfaces(chunk, wave);
            }
            if group.material.shade.is_some()
                && let Some(shade) = shade
            {
                *rays += self.add_shading(chunk.hits().to_vec(), depth, &mut wave.paths, shade);
            }
            let Some(scattering) = &group.material.scattering else { continue };
            if depth >= self.scene.compiled.settings.max_depth {
                continue;
            }
            let ShadingBatch { numbers, keys, count, lobe_seeds, light_seeds, .. } = &mut **chunk;
            numbers.pairs(keys, 1, *count, [lobe_seeds, light_seeds]);
            if let Some(evaluate) = &scattering.evaluate
                && !self.scene.lights.is_empty()
            {
                self.gather_light(group, evaluate, chunk, light, &mut wave.paths);
                shadow_rays.extend(shadow_rays_of(chunk));
            }
            self.choose_directions(group, scattering, chunk, &mut wave.paths);
            if depth == 0 && self.with_features {
                note_albedo(chunk, wave);
            }
            self.send_on(chunk, depth, &mut wave.paths, &mut wave.active);
        }
    }

    /// Samples a light for each lane, and finds what the material scatters of it.
    fn gather_light(
        &self,
        group: &SurfaceGroup,
        evaluate: &EvaluationKernels,
        chunk: &mut ShadingBatch,
        light: &mut LightMemory,
        paths: &mut [Path],
    ) {
        self.sample_lights(chunk, light);
        let v = variables();
        dispatch!(Level::new(), simd => for eight in eights_of(simd, chunk.count) {
            let direction = eight.vectors(&chunk.light.direction);
            eight.store_vectors(&mut chunk.state, v.light_direction, &direction);
        });
        self.call_material(group, Method::Bsdf, &evaluate.bsdf, chunk);
        self.call_material(group, Method::EvaluatePdf, &evaluate.density, chunk);
        let mut lost = ChunkLanes::NONE;
        dispatch!(Level::new(), simd => for eight in eights_of(simd, chunk.count) {
            let Scattered { color, is_lit, is_lost } = scattered_light(eight, chunk);
            // Until it is known whose fault it is.
            let color = select(is_lost, &eight.vectors(&chunk.light.color), &color);
            eight.blend_vectors(&color, &mut chunk.light.color);
            let origin = origins(eight, chunk, &eight.vectors(&chunk.light.direction));
            eight.blend_vectors(&origin, &mut chunk.light.origin);
            lost.set_eight(eight.start(), is_lost.to_bitmask() as u8);
            chunk.light.lanes.set_eight(eight.start(), (is_lit | is_lost).to_bitmask() as u8);
        });
        self.blame(&lost, chunk, paths, |lane| self.whose_light(group, chunk, light, lane));
        for lane in lost.among(chunk.count) {
            // Where something is in the way of the light, it spoils nothing.
            set(&mut chunk.light.color, lane, [f32::NAN; 3]);
        }
    }

    /// Whose value it is that makes a lane's light not finite.
    fn whose_light(
        &self,
        group: &SurfaceGroup,
        chunk: &ShadingBatch,
        light: &LightMemory,
        lane: usize,
    ) -> (&str, Method) {
        let v = variables();
        let LightRows { color, direction, .. } = &chunk.light;
        if !are_finite(&get(color, lane)) || !are_finite(&get(direction, lane)) {
            return self.scene.lights.sampled_method(light.chosen(lane), &self.scene.materials);
        }
        let is_density = are_finite(&vector(&chunk.state, v.bsdf_value, lane))
            && chunk.state.floats(v.pdf)[lane].is_nan();
        let method = if is_density { Method::EvaluatePdf } else { Method::Bsdf };
        (self.material_name(group), method)
    }

    /// Says whose values are not finite in what the paths of `lanes` bring back, once for each path.
    fn blame<'a>(
        &self,
        lanes: &ChunkLanes,
        chunk: &ShadingBatch,
        paths: &mut [Path],
        whose: impl Fn(usize) -> (&'a str, Method),
    ) {
        if lanes.is_empty() {
            return;
        }
        for lane in lanes.among(chunk.count) {
            let path = &mut paths[chunk.hits[lane].path as usize];
            if !std::mem::replace(&mut path.is_blamed, true) {
                let (class, method) = whose(lane);
                self.report_lost(class, method, 1);
            }
        }
    }

    /// Has the material choose a direction for each lane.
    fn choose_directions(
        &self,
        group: &SurfaceGroup,
        scattering: &ScatteringKernels,
        chunk: &mut ShadingBatch,
        paths: &mut [Path],
    ) {
        let ShadingBatch { numbers, keys, count, state, lobe_seeds, .. } = chunk;
        let [first, second, third] = state.vectors_mut(variables().bsdf_seed);
        numbers.pairs(keys, 0, *count, [first, second]);
        third.copy_from_slice(lobe_seeds);
        self.call_material(group, Method::SampleBsdf, &scattering.sample, chunk);
        dispatch!(Level::new(), simd => for eight in eights_of(simd, chunk.count) {
            let (goes_on, is_lost) = take_directions(eight, chunk);
            chunk.onward.lanes.set_eight(eight.start(), goes_on.to_bitmask() as u8);
            chunk.onward.lost.set_eight(eight.start(), is_lost.to_bitmask() as u8);
        });
        let name = self.material_name(group);
        self.blame(&chunk.onward.lost, chunk, paths, |_| (name, Method::SampleBsdf));
        for lane in chunk.onward.lost.among(chunk.count) {
            paths[chunk.hits[lane].path as usize].radiance = [f32::NAN; 3];
        }
        let ShadingBatch { keys, count, onward, .. } = chunk;
        derive_keys(keys, NUMBERS_OF_NEXT_VERTEX, *count, &mut onward.keys);
    }

    /// Sends paths on that Russian roulette spares.
    fn send_on(&self, chunk: &ShadingBatch, depth: u32, paths: &mut [Path], active: &mut Vec<u32>) {
        let scene = &self.scene.compiled;
        let threshold = if depth > 0 { scene.settings.roulette_threshold } else { 0.0 };
        let onward = &chunk.onward;
        for lane in onward.lanes.among(chunk.count) {
            let PathHit { path: index, .. } = chunk.hits[lane];
            let path = &mut paths[index as usize];
            let mut throughput = get(&onward.throughput, lane);
            // Filters may count samples negative.
            let survival = throughput.into_iter().fold(0.0, |most: f32, it| most.max(it.abs()));
            if survival < threshold {
                if lone_number(path.key, NUMBERS_OF_ROULETTE, path.sample) >= survival {
                    continue;
                }
                throughput = throughput.map(|channel| channel / survival);
            }
            let side = chunk.side[lane];
            let seen = |normal: [f32; 3]| normal.map(|component| component * side);
            path.origin = get(&onward.origin, lane);
            path.direction = get(&onward.direction, lane);
            path.epsilon = scene.epsilon;
            path.distance = f32::INFINITY;
            path.limit = f32::INFINITY;
            path.width = chunk.width[lane];
            path.spread = onward.spread[lane];
            path.throughput = throughput;
            path.density = onward.density[lane];
            path.geometric_normal = seen(get(&chunk.geometric_normal, lane));
            path.shading_normal = seen(get(&chunk.shading_normal, lane));
            path.key = onward.keys[lane];
            active.push(index);
        }
    }
}

/// Rays towards the samples of lights that are lit.
fn shadow_rays_of(chunk: &ShadingBatch) -> impl Iterator<Item = ShadowRay> {
    chunk.light.lanes.among(chunk.count).map(|lane| ShadowRay {
        origin: get(&chunk.light.origin, lane),
        direction: get(&chunk.light.direction, lane),
        distance: chunk.light.distance[lane],
        time: chunk.time[lane],
        color: get(&chunk.light.color, lane),
        path: chunk.hits[lane].path,
        key: chunk.keys[lane],
        sample: chunk.samples[lane],
    })
}

/// How much wider rays become after a unit of length that did so by `before`: at least a part of the cones that directions
/// of this density per solid angle stand for. Mirrors keep what their rays have.
#[inline(always)]
fn spreads<S: Simd>(eight: Eight<S>, before: f32x8<S>, density: f32x8<S>) -> f32x8<S> {
    const PART: f32 = 0.1;
    let least = density.simd_gt(0.0).select(PART / density.sqrt(), eight.splat(0.0));
    before.simd_ge(least).select(before, least)
}

/// Notes what the first surfaces of paths are; of those that glow, how much.
fn note_surfaces(chunk: &ShadingBatch, wave: &mut Wavefront) {
    for (lane, hit) in chunk.hits().iter().enumerate() {
        let path = &wave.paths[hit.path as usize];
        let direction = get(&chunk.direction, lane);
        let glow = std::array::from_fn(|channel| {
            // The path has brought back nothing else so far.
            (path.radiance[channel] / path.throughput[channel]).clamp(0.0, 1.0)
        });
        wave.features[hit.path as usize] = PathFeatures {
            albedo: glow,
            normal: get(&chunk.shading_normal, lane),
            distance: chunk.distance[lane] * dot(direction, direction).sqrt(),
            object: hit.object as f32,
        };
    }
}

/// Notes what they reflect.
fn note_albedo(chunk: &ShadingBatch, wave: &mut Wavefront) {
    for lane in chunk.onward.lanes.among(chunk.count) {
        let (before, after) = (get(&chunk.throughput, lane), get(&chunk.onward.throughput, lane));
        let features = &mut wave.features[chunk.hits[lane].path as usize];
        for (channel, albedo) in features.albedo.iter_mut().enumerate() {
            *albedo += after[channel] / before[channel];
        }
    }
}

/// What materials scatter of samples of lights.
struct Scattered<S: Simd> {
    color: Vectors<S>,
    /// Where there is any.
    is_lit: mask32x8<S>,
    /// Where it is not finite.
    is_lost: mask32x8<S>,
}

/// The light that the material scatters of the lights' samples. What its directions find too, it is weighted by.
#[inline(always)]
fn scattered_light<S: Simd>(eight: Eight<S>, chunk: &ShadingBatch) -> Scattered<S> {
    let v = variables();
    let direction = eight.vectors(&chunk.light.direction);
    let (cosine, is_consistent) = cosines(eight, chunk, &direction);
    let value = eight.load_vectors(&chunk.state, v.bsdf_value);
    let light_density = eight.numbers(&chunk.light.density);
    let is_weighed = light_density.simd_gt(0.0);
    let part = weight(light_density, eight.load(&chunk.state, v.pdf));
    let factor = is_weighed.select(part, eight.splat(1.0)) * cosine;
    let light = eight.vectors(&chunk.light.color);
    let throughput = eight.vectors(&chunk.throughput);
    let color: Vectors<S> = std::array::from_fn(|channel| {
        throughput[channel] * value[channel] * light[channel] * factor
    });
    let is_finite_color = is_finite(&color);
    // A light that is black, behind the surface or not scattered adds nothing whatever it is multiplied with.
    let is_scattered = is_lit(&light) & is_lit(&value);
    let counts = is_scattered & (is_consistent | !is_finite(&direction));
    Scattered {
        is_lit: is_lit(&color) & is_finite_color & is_consistent,
        is_lost: counts & !is_finite_color,
        color,
    }
}

/// Takes the directions that the material chose; where paths go on, and where what they would bring back is not finite.
#[inline(always)]
fn take_directions<S: Simd>(
    eight: Eight<S>,
    chunk: &mut ShadingBatch,
) -> (mask32x8<S>, mask32x8<S>) {
    let v = variables();
    let direction = eight.load_vectors(&chunk.state, v.light_direction);
    let (cosine, is_consistent) = cosines(eight, chunk, &direction);
    let value = eight.load_vectors(&chunk.state, v.bsdf_value);
    let density = eight.load(&chunk.state, v.pdf);
    let is_number = density.simd_eq(density);
    let has_density = density.simd_gt(0.0);
    let factor = has_density.select(cosine / density, eight.splat(1.0));
    let weight = scaled(&value, factor);
    let throughput = eight.vectors(&chunk.throughput);
    let throughput: Vectors<S> =
        std::array::from_fn(|channel| throughput[channel] * weight[channel]);
    let density = has_density.select(density, eight.splat(0.0));
    let spread = spreads(eight, eight.numbers(&chunk.spread), density);
    let origin = origins(eight, chunk, &direction);
    let onward = &mut chunk.onward;
    eight.blend_vectors(&direction, &mut onward.direction);
    eight.blend_vectors(&origin, &mut onward.origin);
    eight.blend_vectors(&throughput, &mut onward.throughput);
    eight.blend(density, &mut onward.density);
    eight.blend(spread, &mut onward.spread);
    let is_direction = is_finite(&direction);
    let is_usable = is_finite(&throughput) & is_direction & is_number;
    let goes_on = is_lit(&throughput) & is_usable & is_consistent;
    // Black is no direction, and one to the wrong side is none either.
    (goes_on, is_lit(&value) & !is_usable & (is_consistent | !is_direction))
}

/// Where rays begin that leave the surfaces in these directions.
#[inline(always)]
fn origins<S: Simd>(eight: Eight<S>, chunk: &ShadingBatch, direction: &Vectors<S>) -> Vectors<S> {
    let (point, normal) = (eight.vectors(&chunk.point), eight.vectors(&chunk.geometric_normal));
    off_surfaces(&point, &normal, direction, eight.numbers(&chunk.offset))
}

/// The cosines between directions and the normals for shading, without sign, and whether both normals agree
/// on which side of the surface a direction leads to: else light would leak through it (Veach 1997,
/// section 5.3.3).
#[inline(always)]
fn cosines<S: Simd>(
    eight: Eight<S>,
    chunk: &ShadingBatch,
    direction: &Vectors<S>,
) -> (f32x8<S>, mask32x8<S>) {
    let geometric = dots(direction, &eight.vectors(&chunk.geometric_normal));
    let shading = dots(direction, &eight.vectors(&chunk.shading_normal));
    (shading.abs(), (geometric * shading).simd_gt(0.0))
}
