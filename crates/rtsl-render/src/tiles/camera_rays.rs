//! Camera rays of a tile.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch};
use rtsl::{LaneBlock, Method};
use rtsl_bvh::{LANES, LaneMask, Lanes, RayPacket, lanes_of, moved_packet_by};
use rtsl_math::sampling::{ANY_COUNT, INDEPENDENT, POWER_OF_TWO, SOBOL, Sampler};
use rtsl_math::{dot, normalize_or};
use rtsl_scene::Settings;

use super::lane_context::LaneContext;
use super::tile::Tile;
use crate::compiled::calls::CallBlocks;
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::tracer::Tracer;
use crate::compiled::variables::{variables, vector};
use crate::lanes::eight::{LaneVectors, eights_alone};
use crate::lanes::lane_streams::LaneStreams;

/// Camera rays with their contexts and weights.
pub struct CameraRays {
    /// The rays.
    pub rays: RayPacket,
    /// Random numbers and times.
    pub context: LaneContext,
    /// The weights of radiance.
    pub weights: LaneVectors,
    /// The widths of the rays at their origins, and the increase of width per unit of length: the distances to the rays
    /// of the pixels beside and above. 0 if they are not needed.
    pub footprints: [Lanes; 2],
}

impl CameraRays {
    /// No rays yet.
    fn new(sampler: Sampler) -> Self {
        CameraRays {
            rays: RayPacket::default(),
            context: LaneContext::new(sampler, LaneStreams::new([0; LANES], 0), [0.0; LANES]),
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

/// Generates the rays of one sample of a tile. [`CameraMemory::keep`] takes them back.
pub fn camera_rays(
    tracer: &Tracer<'_>,
    memory: &mut CameraMemory,
    tile: Tile,
    sample: u32,
) -> Box<CameraRays> {
    let kept = memory.free.take();
    let mut camera =
        kept.unwrap_or_else(|| Box::new(CameraRays::new(tracer.scene.settings.sampler)));
    dispatch!(Level::new(), simd => fill(simd, tracer, &mut memory.blocks, tile, sample, &mut camera));
    if memory.with_footprints {
        let part = tracer.scene.settings.sampler.part_of_pixel(sample);
        set_footprints(tracer, &mut memory.blocks, tile, part, &mut camera);
    }
    camera
}

#[inline(always)]
fn fill<S: Simd>(
    simd: S,
    tracer: &Tracer<'_>,
    blocks: &mut CallBlocks,
    tile: Tile,
    sample: u32,
    camera: &mut CameraRays,
) {
    let scene = tracer.scene;
    let settings = &scene.settings;
    let lanes = tile.lanes(settings.width, settings.height);
    let inputs = match settings.sampler.spread() {
        INDEPENDENT => CameraInputs::new::<INDEPENDENT>(settings, tile, sample),
        POWER_OF_TWO => CameraInputs::new::<POWER_OF_TWO>(settings, tile, sample),
        SOBOL => CameraInputs::new::<SOBOL>(settings, tile, sample),
        _ => CameraInputs::new::<ANY_COUNT>(settings, tile, sample),
    };
    let CameraRays { rays, context, weights, .. } = camera;
    context.begin(LaneStreams::new(inputs.stream_keys, sample), inputs.time);
    inputs.set(scene, &mut blocks.state);
    if let Some(call) = scene.call(&scene.camera, Method::GenerateRay, tracer.errors) {
        blocks.call(&call, lanes, None, context);
    }
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
    if let Some(motion) = &scene.camera_motion {
        *rays = moved_packet_by(rays, lanes, |time| motion.map_at(time));
    }
}

/// Measures the distances of rays to those of the pixels beside and above, and multiplies them by `part`. The camera's
/// blocks still contain the inputs of the rays.
fn set_footprints(
    tracer: &Tracer<'_>,
    blocks: &mut CallBlocks,
    tile: Tile,
    part: f32,
    camera: &mut CameraRays,
) {
    let scene = tracer.scene;
    let Some(call) = scene.call(&scene.camera, Method::GenerateRay, tracer.errors) else {
        return;
    };
    let v = variables();
    let lanes = tile.lanes(scene.settings.width, scene.settings.height);
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
    camera.footprints = footprints.map(|areas| areas.map(|area| area.sqrt() * part));
}

fn distance(one: [f32; 3], other: [f32; 3]) -> f32 {
    let way: [f32; 3] = std::array::from_fn(|axis| one[axis] - other[axis]);
    dot(way, way).sqrt()
}

/// The inputs of the camera, lane by lane.
struct CameraInputs {
    screen: [Lanes; 2],
    lens: [Lanes; 2],
    time: Lanes,
    stream_keys: [u32; LANES],
    /// The sample weights of the pixel filter.
    filter_weights: Lanes,
    /// The size of a pixel.
    pixel_size: [f32; 2],
}

impl CameraInputs {
    #[expect(clippy::needless_range_loop, reason = "loops over lanes of several arrays at once")]
    #[inline(always)]
    fn new<const SPREAD: u8>(settings: &Settings, tile: Tile, sample: u32) -> Self {
        let sampler = &settings.sampler;
        let [width, height] = settings.whole_size().map(|side| side as u32);
        let origin = settings.origin();
        let mut inputs = CameraInputs {
            screen: [[0.0; LANES]; 2],
            lens: [[0.0; LANES]; 2],
            time: [0.0; LANES],
            stream_keys: [0; LANES],
            filter_weights: [1.0; LANES],
            pixel_size: [1.0 / width as f32, 1.0 / height as f32],
        };
        let [du, dv] = inputs.pixel_size;
        // Each number has a separate loop, so that each is vectorised. Lanes outside the image are computed too, and
        // ignored.
        let mut pixels = [[0_u32; LANES]; 2];
        for lane in 0..LANES {
            let (x, y) = tile.pixel(lane);
            (pixels[0][lane], pixels[1][lane]) = ((x + origin[0]) as u32, (y + origin[1]) as u32);
        }
        let index = |lane: usize| pixels[1][lane].wrapping_mul(width).wrapping_add(pixels[0][lane]);
        for lane in 0..LANES {
            [inputs.screen[0][lane], inputs.screen[1][lane]] =
                sampler.pixel_position::<SPREAD>(index(lane), sample);
        }
        let [columns, rows] = &mut inputs.screen;
        settings.filter.sample_each([columns, rows], &mut inputs.filter_weights);
        for lane in 0..LANES {
            let [x, y] = [inputs.screen[0][lane], inputs.screen[1][lane]];
            // Rows count from the top, screen coordinates from the bottom.
            let row = height.wrapping_sub(1).wrapping_sub(pixels[1][lane]);
            inputs.screen[0][lane] = (pixels[0][lane] as i32 as f32 + x) * du;
            inputs.screen[1][lane] = (row as i32 as f32 + (1.0 - y)) * dv;
        }
        for lane in 0..LANES {
            [inputs.lens[0][lane], inputs.lens[1][lane]] =
                sampler.lens_position::<SPREAD>(index(lane), sample);
        }
        for lane in 0..LANES {
            inputs.time[lane] = sampler.time::<SPREAD>(index(lane), sample);
        }
        for lane in 0..LANES {
            inputs.stream_keys[lane] = sampler.stream_key(index(lane));
        }
        inputs
    }

    fn set(&self, scene: &CompiledScene, state: &mut LaneBlock) {
        let v = variables();
        for axis in 0..2 {
            state.floats_mut(v.screen_coord + axis).copy_from_slice(&self.screen[axis]);
            state.floats_mut(v.lens_coord + axis).copy_from_slice(&self.lens[axis]);
        }
        state.floats_mut(v.time_seed).copy_from_slice(&self.time);
        let [du, dv] = self.pixel_size;
        let far = f32::INFINITY;
        for (component, value) in
            [(v.du, du), (v.dv, dv), (v.epsilon, scene.camera_epsilon()), (v.hit_distance, far)]
        {
            state.floats_mut(component).fill(value);
        }
        for (first, values) in [
            (v.ray_origin, [0.0; 3]),
            (v.ray_direction, [0.0, 0.0, 1.0]),
            (v.inverse_ray_direction, [far, far, 1.0]),
            (v.sample_color, [1.0; 3]),
        ] {
            for (axis, value) in values.into_iter().enumerate() {
                state.floats_mut(first + axis).fill(value);
            }
        }
    }
}
