//! Camera rays of a tile.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch};
use rtsl::host::{Host, LaneFloats, LaneSet};
use rtsl::{LaneBlock, Method};
use rtsl_bvh::{LANES, LaneMask, Lanes, RayPacket, moved_packet_by};
use rtsl_math::sampling::Sampler;

use super::camera_inputs::CameraInputs;
use super::tile_samples::TileSamples;
use crate::compiled::calls::CallBlocks;
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::tracer::Tracer;
use crate::compiled::variables::variables;
use crate::lanes::eight::{LaneVectors, difference, dots, eights_alone};
use crate::lanes::sequences::Sequences;

/// Camera rays with their random numbers and weights.
pub struct CameraRays {
    /// The rays.
    pub rays: RayPacket,
    /// The random numbers, from which requests of the camera are answered.
    pub streams: SampleStreams,
    /// The weights of radiance.
    pub weights: LaneVectors,
    /// The widths of the rays at their origins, and the increase of width per unit of length: the distances to the rays
    /// of the pixels beside and above. 0 if they are not needed.
    pub footprints: [Lanes; 2],
}

/// The random numbers of rays of any samples.
#[derive(Clone)]
pub struct SampleStreams {
    sampler: Sampler,
    sequences: Sequences<LANES>,
    samples: [u32; LANES],
}

impl SampleStreams {
    /// Begins the numbers of the rays of these inputs.
    fn begin(&mut self, inputs: &CameraInputs) {
        (self.sequences, self.samples) = (Sequences::new(inputs.stream_keys), inputs.samples);
    }

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
        self.sequences.next(&self.sampler, &self.samples, lanes, values);
    }
}

impl CameraRays {
    /// No rays yet.
    fn new(sampler: Sampler) -> Self {
        let sequences = Sequences::new([0; LANES]);
        CameraRays {
            rays: RayPacket::default(),
            streams: SampleStreams { sampler, sequences, samples: [0; LANES] },
            weights: [[1.0; LANES]; 3],
            footprints: [[0.0; LANES]; 2],
        }
    }
}

/// The memory of one thread for camera rays.
pub struct CameraMemory {
    blocks: CallBlocks,
    /// True if the widths of rays are needed.
    with_footprints: bool,
    /// Unused memory for rays.
    free: Option<Box<CameraRays>>,
}

impl CameraMemory {
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
    pub fn keep(&mut self, rays: Box<CameraRays>) {
        self.free = Some(rays);
    }
}

/// Generates a packet of the rays of some samples of a tile. [`CameraMemory::keep`] takes them back.
pub fn camera_packet(
    tracer: &Tracer<'_>,
    memory: &mut CameraMemory,
    samples: &TileSamples,
    packet: usize,
) -> Box<CameraRays> {
    let settings = &tracer.scene.settings;
    let CameraMemory { blocks, with_footprints, free } = memory;
    let mut camera = free.take().unwrap_or_else(|| Box::new(CameraRays::new(settings.sampler)));
    let lanes = samples.lanes(packet, (settings.width, settings.height));
    let call = tracer.scene.call(&tracer.scene.camera, Method::GenerateRay, tracer.errors);
    let lens = variables().lens_coord;
    let with_lens = call.as_ref().is_some_and(|call| call.touches(lens) || call.touches(lens + 1));
    let inputs = CameraInputs::new(settings, samples, packet, with_lens);
    camera.streams.begin(&inputs);
    inputs.set(tracer.scene, &mut blocks.state);
    if let Some(call) = call {
        blocks.call(&call, lanes, &mut camera.streams);
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
fn take_rays<S: Simd>(
    simd: S,
    scene: &CompiledScene,
    blocks: &CallBlocks,
    inputs: &CameraInputs,
    camera: &mut CameraRays,
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
fn set_footprints(
    tracer: &Tracer<'_>,
    blocks: &mut CallBlocks,
    inputs: &CameraInputs,
    lanes: LaneMask,
    camera: &mut CameraRays,
) {
    let scene = tracer.scene;
    let Some(call) = scene.call(&scene.camera, Method::GenerateRay, tracer.errors) else {
        return;
    };
    let [width, height] = scene.settings.whole_size();
    let mut rays = [[[0.0; LANES]; 3]; 2];
    dispatch!(Level::new(), simd => store_rays(simd, &blocks.state, &mut rays));
    let mut footprints = [[1.0; LANES]; 2];
    for (axis, step) in [1.0 / width as f32, 1.0 / height as f32].into_iter().enumerate() {
        let place = |step: f32, blocks: &mut CallBlocks| {
            let coordinates = blocks.state.floats_mut(variables().screen_coord + axis);
            coordinates.iter_mut().for_each(|coordinate| *coordinate += step);
        };
        place(step, blocks);
        // The random numbers that this call draws must not advance the rays' sequences.
        blocks.call(&call, lanes, &mut camera.streams.clone());
        let mut others = [[[0.0; LANES]; 3]; 2];
        dispatch!(Level::new(), simd => {
            store_rays(simd, &blocks.state, &mut others);
            multiply_distances(simd, &rays, &others, &mut footprints);
        });
        place(-step, blocks);
    }
    // The side of a square of the same area.
    let part = |lane: usize| scene.settings.sampler.part_of_pixel(inputs.samples[lane]);
    camera.footprints =
        footprints.map(|areas| std::array::from_fn(|lane| areas[lane].sqrt() * part(lane)));
}

/// Stores the origins of rays, and their directions at unit length.
#[inline(always)]
fn store_rays<S: Simd>(simd: S, state: &LaneBlock, [origins, directions]: &mut [LaneVectors; 2]) {
    let v = variables();
    for eight in eights_alone(simd, LaneMask::MAX) {
        let up = [0.0, 0.0, 1.0].map(|component| eight.splat(component));
        let direction = eight.load_vectors(state, v.ray_direction);
        eight.blend_vectors(&eight.normalized_or(&direction, &up), directions);
        eight.blend_vectors(&eight.load_vectors(state, v.ray_origin), origins);
    }
}

/// Multiplies footprints by the distances between rays and others.
#[inline(always)]
fn multiply_distances<S: Simd>(
    simd: S,
    rays: &[LaneVectors; 2],
    others: &[LaneVectors; 2],
    footprints: &mut [Lanes; 2],
) {
    for eight in eights_alone(simd, LaneMask::MAX) {
        for ((one, other), footprint) in rays.iter().zip(others).zip(&mut *footprints) {
            let way = difference(&eight.vectors(one), &eight.vectors(other));
            eight.blend(eight.floats(footprint) * dots(&way, &way).sqrt(), footprint);
        }
    }
}
