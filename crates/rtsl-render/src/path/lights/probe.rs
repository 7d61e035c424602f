//! Probing: a few samples of each light, from which its strength and position are estimated.

use std::ops::Range;

use rayon::prelude::*;
use rtsl_bvh::Bounds;
use rtsl_math::sampling::{hash, unit_float};
use rtsl_memory::on_all_processors;
use smallvec::SmallVec;

use super::super::path_tracer::PathTracer;
use super::super::rows::{BATCH_LANES, get, set};
use super::super::scene::BatchScene;
use super::super::shading_batch::ShadingBatch;
use super::sample::LightMemory;
use super::selection::LightProbe;

/// Samples of each light.
const SAMPLES: usize = 16;

/// The number of lights sampled in one batch. Random numbers depend on the lane, so this does not follow the batch's
/// size.
const LIGHTS_IN_BATCH: usize = 16;

/// The key of the random numbers of probes.
const NUMBERS_OF_PROBES: u32 = 0x7072_6F62;

/// Memory of a thread that samples lights.
struct ProbeMemory {
    batch: Box<ShadingBatch>,
    light: Box<LightMemory>,
}

impl ProbeMemory {
    fn new(scene: &BatchScene) -> Self {
        let (scratch, sampler) = (scene.scratch_arrays(), scene.compiled.settings.sampler);
        ProbeMemory {
            batch: ShadingBatch::new(scratch, sampler),
            light: LightMemory::new(scratch, sampler),
        }
    }
}

impl PathTracer<'_> {
    /// Samples every light from some points distributed over the scene, in parallel.
    pub fn probe_lights(&self) -> Vec<LightProbe> {
        let world = self.world();
        let count = self.scene.lights.entries.len();
        let chunks = (0..count.div_ceil(LIGHTS_IN_BATCH)).into_par_iter();
        let probes = chunks.map_init(
            || ProbeMemory::new(self.scene),
            |memory, index| {
                let first = index * LIGHTS_IN_BATCH;
                self.probe_batch(memory, first..count.min(first + LIGHTS_IN_BATCH), world)
            },
        );
        on_all_processors(|| probes.flatten_iter().collect())
    }

    /// Samples the lights of one batch.
    fn probe_batch(
        &self,
        memory: &mut ProbeMemory,
        lights: Range<usize>,
        world: Bounds,
    ) -> SmallVec<[LightProbe; LIGHTS_IN_BATCH]> {
        let ProbeMemory { batch, light } = memory;
        let chosen = lights.flat_map(|light| std::iter::repeat_n(light as u32, SAMPLES));
        let chosen: SmallVec<[u32; LIGHTS_IN_BATCH * SAMPLES]> = chosen.collect();
        set_points(batch, &chosen, world);
        self.sample_chosen(batch, light, &chosen);
        (0..chosen.len()).step_by(SAMPLES).map(|start| probe(batch, start)).collect()
    }

    /// The bounds of the scene's bounded objects.
    fn world(&self) -> Bounds {
        let groups = &self.scene.compiled.geometry.groups;
        let world = groups.first().map(|group| group.tree.bounds);
        let is_usable = |bounds: &Bounds| bounds.diagonal().is_finite() && bounds.diagonal() > 0.0;
        world
            .filter(is_usable)
            .or_else(|| Bounds::new([-1.0; 3], [1.0; 3]))
            .unwrap_or(Bounds::EMPTY)
    }
}

/// Distributes the points from which each light is sampled over a box.
fn set_points(batch: &mut ShadingBatch, lights: &[u32], world: Bounds) {
    batch.count = lights.len();
    for lane in 0..lights.len().next_multiple_of(8).min(BATCH_LANES) {
        let random =
            |axis: u32| unit_float(hash(hash(NUMBERS_OF_PROBES, (lane % SAMPLES) as u32), axis));
        let [x, y, z] = [0, 1, 2].map(random);
        set(&mut batch.point, lane, world.at([x, y, z]));
        set(&mut batch.geometric_normal, lane, [0.0, 0.0, 1.0]);
        set(&mut batch.shading_normal, lane, [0.0, 0.0, 1.0]);
        batch.side[lane] = 1.0;
        batch.time[lane] = (lane % SAMPLES) as f32 / SAMPLES as f32;
        batch.keys[lane] = hash(NUMBERS_OF_PROBES, lane as u32);
        batch.samples[lane] = (lane % SAMPLES) as u32;
    }
}

/// Evaluates the samples of one light.
fn probe(batch: &ShadingBatch, start: usize) -> LightProbe {
    let (mut bounds, mut strength) = (Bounds::EMPTY, 0.0);
    let is_lit = |lane: &usize| get(&batch.light.color, *lane) != [0.0; 3];
    let mut lit = (start..start + SAMPLES).filter(is_lit).peekable();
    let is_near = lit.peek().is_some() && lit.all(|lane| batch.light.reach[lane] < f32::INFINITY);
    for lane in start..start + SAMPLES {
        let distance = batch.light.distance[lane];
        if distance.is_nan() || distance == f32::INFINITY {
            return LightProbe { bounds: None, strength: 1.0, is_near };
        }
        let (point, direction) = (get(&batch.point, lane), get(&batch.light.direction, lane));
        let place: [f32; 3] = std::array::from_fn(|axis| point[axis] + direction[axis] * distance);
        if let Some(place) = Bounds::new(place, place) {
            bounds = bounds.union(&place);
        }
        let [red, green, blue] = get(&batch.light.color, lane);
        let luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
        let intensity = luminance * distance * distance;
        strength += if intensity.is_finite() { intensity.max(0.0) / SAMPLES as f32 } else { 0.0 };
    }
    let is_somewhere = bounds != Bounds::EMPTY;
    LightProbe { bounds: is_somewhere.then_some(bounds), strength, is_near }
}
