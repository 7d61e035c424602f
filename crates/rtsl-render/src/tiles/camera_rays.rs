//! Camera rays of a tile.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch};
use rtsl::Method;
use rtsl::host::{Host, LaneFloats, LaneSet};
use rtsl_bvh::{LANES, LaneMask, Lanes, RayPacket, lanes_of, moved_packet_by};
use rtsl_math::sampling::Sampler;
use rtsl_math::{dot, normalize_or};

use super::camera_inputs::CameraInputs;
use super::lane_context::LaneContext;
use super::tile::Tile;
use super::tile_samples::TileSamples;
use crate::compiled::calls::CallBlocks;
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::tracer::Tracer;
use crate::compiled::variables::{variables, vector};
use crate::lanes::eight::{LaneVectors, eights_alone};
use crate::lanes::lane_streams::LaneStreams;
use crate::lanes::sequences::{Samples, Sequences};

/// Camera rays with their contexts and weights.
pub struct CameraRays<Context = LaneContext> {
    /// The rays.
    pub rays: RayPacket,
    /// Random numbers and, for a renderer of packets, what else belongs to rays.
    pub context: Context,
    /// The weights of radiance.
    pub weights: LaneVectors,
    /// The widths of the rays at their origins, and the increase of width per unit of length: the distances to the rays
    /// of the pixels beside and above. 0 if they are not needed.
    pub footprints: [Lanes; 2],
}

/// The context of camera rays, which answers requests of the camera.
pub trait CameraContext: Host + Clone {
    /// Creates the context of no rays yet.
    fn new(sampler: Sampler) -> Self;

    /// Reuses it for the rays of these inputs.
    fn begin(&mut self, inputs: &CameraInputs);
}

/// A packet's rays are of one sample.
impl CameraContext for LaneContext {
    fn new(sampler: Sampler) -> Self {
        LaneContext::new(sampler, LaneStreams::new([0; LANES], 0), [0.0; LANES])
    }

    fn begin(&mut self, inputs: &CameraInputs) {
        let streams = LaneStreams::new(inputs.stream_keys, inputs.samples[0]);
        LaneContext::begin(self, streams, inputs.time);
    }
}

/// The random numbers of rays of any samples.
#[derive(Clone)]
pub struct SampleStreams {
    sampler: Sampler,
    sequences: Sequences<LANES>,
    samples: [u32; LANES],
}

impl SampleStreams {
    /// Returns the keys of the rays' sequences.
    pub fn keys(&self) -> &[u32; LANES] {
        self.sequences.keys()
    }

    /// Returns the sample indices of the rays.
    pub fn samples(&self) -> &[u32; LANES] {
        &self.samples
    }
}

impl Host for SampleStreams {
    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        self.sequences.next(&self.sampler, Samples::Each(&self.samples), lanes, values);
    }
}

impl CameraContext for SampleStreams {
    fn new(sampler: Sampler) -> Self {
        SampleStreams { sampler, sequences: Sequences::new([0; LANES]), samples: [0; LANES] }
    }

    fn begin(&mut self, inputs: &CameraInputs) {
        (self.sequences, self.samples) = (Sequences::new(inputs.stream_keys), inputs.samples);
    }
}

impl<Context: CameraContext> CameraRays<Context> {
    /// No rays yet.
    fn new(sampler: Sampler) -> Self {
        CameraRays {
            rays: RayPacket::default(),
            context: Context::new(sampler),
            weights: [[1.0; LANES]; 3],
            footprints: [[0.0; LANES]; 2],
        }
    }
}

/// The memory of one thread for camera rays.
pub struct CameraMemory<Context = LaneContext> {
    blocks: CallBlocks,
    /// True if the widths of rays are needed.
    with_footprints: bool,
    /// Unused memory for rays.
    free: Option<Box<CameraRays<Context>>>,
}

impl<Context> CameraMemory<Context> {
    /// Allocates the memory for the camera of a scene.
    pub fn new(scene: &CompiledScene) -> Self {
        let blocks = CallBlocks::new(scene.scratch_arrays);
        CameraMemory { blocks, with_footprints: false, free: None }
    }

    /// Selects if the widths of rays are computed.
    #[must_use]
    pub fn with_footprints(self, with_footprints: bool) -> Self {
        CameraMemory { with_footprints, ..self }
    }

    /// Returns rays for reuse.
    pub fn keep(&mut self, rays: Box<CameraRays<Context>>) {
        self.free = Some(rays);
    }
}

/// Generates the rays of one sample of a tile. [`CameraMemory::keep`] takes them back.
pub fn camera_rays(
    tracer: &Tracer<'_>,
    memory: &mut CameraMemory,
    tile: Tile,
    sample: u32,
) -> Box<CameraRays> {
    camera_packet(tracer, memory, &TileSamples { tile, first: sample, count: 1 }, 0)
}

/// Generates a packet of the rays of some samples of a tile. [`CameraMemory::keep`] takes them back.
pub fn camera_packet<Context: CameraContext>(
    tracer: &Tracer<'_>,
    memory: &mut CameraMemory<Context>,
    samples: &TileSamples,
    packet: usize,
) -> Box<CameraRays<Context>> {
    let settings = &tracer.scene.settings;
    let CameraMemory { blocks, with_footprints, free } = memory;
    let mut camera = free.take().unwrap_or_else(|| Box::new(CameraRays::new(settings.sampler)));
    let lanes = samples.lanes(packet, (settings.width, settings.height));
    let call = tracer.scene.call(&tracer.scene.camera, Method::GenerateRay, tracer.errors);
    let lens = variables().lens_coord;
    let with_lens = call.as_ref().is_some_and(|call| call.touches(lens) || call.touches(lens + 1));
    let inputs = CameraInputs::new(settings, samples, packet, with_lens);
    camera.context.begin(&inputs);
    inputs.set(tracer.scene, &mut blocks.state);
    if let Some(call) = call {
        blocks.call(&call, lanes, None, &mut camera.context);
    }
    dispatch!(Level::new(), simd => take_rays(simd, tracer.scene, blocks, &inputs, &mut camera));
    if let Some(motion) = &tracer.scene.camera_motion {
        camera.rays = moved_packet_by(&camera.rays, lanes, |time| motion.map_at(time));
    }
    if *with_footprints {
        set_footprints(tracer, blocks, &inputs, lanes, &mut camera);
    }
    camera
}

/// Takes rays from the results of the camera, and transforms them to the world if the camera does not move.
#[inline(always)]
fn take_rays<S: Simd, Context>(
    simd: S,
    scene: &CompiledScene,
    blocks: &CallBlocks,
    inputs: &CameraInputs,
    camera: &mut CameraRays<Context>,
) {
    let CameraRays { rays, weights, .. } = camera;
    let (v, state) = (variables(), &blocks.state);
    let map = scene.camera_motion.is_none().then_some(&scene.camera_to_world);
    for eight in eights_alone(simd, LaneMask::MAX) {
        let mut origin = eight.load_vectors(state, v.ray_origin);
        let mut direction = eight.load_vectors(state, v.ray_direction);
        if let Some(map) = map {
            origin = eight.point(map, &origin);
            direction = eight.vector(map, &direction);
        }
        eight.blend_vectors(&origin, &mut rays.origin);
        eight.blend_vectors(&direction, &mut rays.direction);
        let filter_weight = eight.floats(&inputs.filter_weights);
        let color = eight.load_vectors(state, v.sample_color);
        eight.blend_vectors(&color.map(|channel| channel * filter_weight), weights);
        eight.blend(eight.load(state, v.hit_distance), &mut rays.limit);
        // Hits behind the origin never count.
        let epsilon = eight.load(state, v.epsilon);
        let zero = eight.splat(0.0);
        eight.blend(epsilon.simd_gt(zero).select(epsilon, zero), &mut rays.epsilon);
    }
    rays.time = inputs.time;
}

/// Measures the distances of rays to those of the pixels beside and above, and multiplies them by the part of a pixel
/// that a sample stands for. The camera's blocks still contain the inputs of the rays.
fn set_footprints<Context: CameraContext>(
    tracer: &Tracer<'_>,
    blocks: &mut CallBlocks,
    inputs: &CameraInputs,
    lanes: LaneMask,
    camera: &mut CameraRays<Context>,
) {
    let scene = tracer.scene;
    let Some(call) = scene.call(&scene.camera, Method::GenerateRay, tracer.errors) else {
        return;
    };
    let v = variables();
    let [width, height] = scene.settings.whole_size();
    let ray = |blocks: &CallBlocks, lane: usize| {
        let direction = vector(&blocks.state, v.ray_direction, lane);
        (vector(&blocks.state, v.ray_origin, lane), normalize_or(direction, [0.0, 0.0, 1.0]))
    };
    let rays: [_; LANES] = std::array::from_fn(|lane| ray(blocks, lane));
    let mut footprints = [[1.0; LANES]; 2];
    for (axis, step) in [1.0 / width as f32, 1.0 / height as f32].into_iter().enumerate() {
        let place = |step: f32, blocks: &mut CallBlocks| {
            let coordinates = blocks.state.floats_mut(v.screen_coord + axis);
            coordinates.iter_mut().for_each(|coordinate| *coordinate += step);
        };
        place(step, blocks);
        // The random numbers that this call draws must not advance the rays' sequences.
        blocks.call(&call, lanes, None, &mut camera.context.clone());
        for lane in lanes_of(lanes) {
            let (one, other) = (&rays[lane], ray(blocks, lane));
            footprints[0][lane] *= distance(one.0, other.0);
            footprints[1][lane] *= distance(one.1, other.1);
        }
        place(-step, blocks);
    }
    // The side of a square of the same area.
    let part = |lane: usize| scene.settings.sampler.part_of_pixel(inputs.samples[lane]);
    camera.footprints =
        footprints.map(|areas| std::array::from_fn(|lane| areas[lane].sqrt() * part(lane)));
}

fn distance(one: [f32; 3], other: [f32; 3]) -> f32 {
    let way: [f32; 3] = std::array::from_fn(|axis| one[axis] - other[axis]);
    dot(way, way).sqrt()
}
