//! The inputs of cameras.

use fearless_simd::{Level, Simd, dispatch};
use rtsl::LaneBlock;
use rtsl_bvh::{LANES, Lanes};
use rtsl_math::sampling::{ANY_COUNT, INDEPENDENT, POWER_OF_TWO, SOBOL};
use rtsl_scene::Settings;

use super::tile::Tile;
use super::tile_samples::TileSamples;
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::variables::variables;

/// The inputs of the camera, lane by lane.
pub struct CameraInputs {
    screen: [Lanes; 2],
    lens: [Lanes; 2],
    /// The times within the shutter.
    pub time: Lanes,
    /// The keys of the rays' random sequences.
    pub stream_keys: [u32; LANES],
    /// The sample indices of the rays.
    pub samples: [u32; LANES],
    /// The sample weights of the pixel filter.
    pub filter_weights: Lanes,
    /// The size of a pixel.
    pixel_size: [f32; 2],
}

impl CameraInputs {
    /// Computes the inputs of a packet of rays. `with_lens` says if the camera reads the places on the lens.
    pub fn new(settings: &Settings, samples: &TileSamples, packet: usize, with_lens: bool) -> Self {
        dispatch!(Level::new(), simd => match settings.sampler.spread() {
            INDEPENDENT => Self::in_vectors::<_, INDEPENDENT>(simd, settings, (samples, packet), with_lens),
            POWER_OF_TWO => Self::in_vectors::<_, POWER_OF_TWO>(simd, settings, (samples, packet), with_lens),
            SOBOL => Self::in_vectors::<_, SOBOL>(simd, settings, (samples, packet), with_lens),
            _ => Self::in_vectors::<_, ANY_COUNT>(simd, settings, (samples, packet), with_lens),
        })
    }

    #[expect(clippy::needless_range_loop, reason = "loops over lanes of several arrays at once")]
    #[inline(always)]
    fn in_vectors<S: Simd, const SPREAD: u8>(
        _: S,
        settings: &Settings,
        (samples, packet): (&TileSamples, usize),
        with_lens: bool,
    ) -> Self {
        let sampler = &settings.sampler;
        let [width, height] = settings.whole_size().map(|side| side as u32);
        let origin = settings.origin();
        let mut inputs = CameraInputs {
            screen: [[0.0; LANES]; 2],
            lens: [[0.0; LANES]; 2],
            time: [0.0; LANES],
            stream_keys: [0; LANES],
            samples: [0; LANES],
            filter_weights: [1.0; LANES],
            pixel_size: [1.0 / width as f32, 1.0 / height as f32],
        };
        let [du, dv] = inputs.pixel_size;
        // Each number has a separate loop, so that each is vectorised. Lanes outside the image are computed too, and
        // ignored.
        let mut pixels = [[0_u32; LANES]; 2];
        let [mut position_keys, mut lens_keys, mut time_keys] = [[0_u32; LANES]; 3];
        let keys_of = |x: u32, y: u32| sampler.pixel_keys(y.wrapping_mul(width).wrapping_add(x));
        if samples.count == 1 {
            let (x, y) = (samples.tile.x + origin[0], samples.tile.y + origin[1]);
            for lane in 0..LANES {
                let [column, row] = Tile::PLACES[lane];
                pixels[0][lane] = (x as u32).wrapping_add(column);
                pixels[1][lane] = (y as u32).wrapping_add(row);
            }
            inputs.samples = [samples.first; LANES];
            let keys = |lane: usize| keys_of(pixels[0][lane], pixels[1][lane]);
            for lane in 0..LANES {
                position_keys[lane] = keys(lane).position;
            }
            for lane in 0..LANES {
                time_keys[lane] = keys(lane).time;
            }
            for lane in 0..LANES {
                inputs.stream_keys[lane] = keys(lane).stream;
            }
            if with_lens {
                for lane in 0..LANES {
                    lens_keys[lane] = keys(lane).lens;
                }
            }
        } else {
            // The samples of a pixel share its keys, which are most of the work.
            for (pixel, lanes, first) in samples.of_packet(packet) {
                let (x, y) = samples.tile.pixel(pixel);
                let (x, y) = ((x + origin[0]) as u32, (y + origin[1]) as u32);
                let keys = keys_of(x, y);
                let [columns, rows] = &mut pixels;
                for (column, value) in [
                    (columns, x),
                    (rows, y),
                    (&mut position_keys, keys.position),
                    (&mut lens_keys, keys.lens),
                    (&mut time_keys, keys.time),
                    (&mut inputs.stream_keys, keys.stream),
                ] {
                    column[lanes.clone()].fill(value);
                }
                inputs.samples[lanes].iter_mut().zip(first..).for_each(|(to, sample)| *to = sample);
            }
        }
        for lane in 0..LANES {
            [inputs.screen[0][lane], inputs.screen[1][lane]] =
                sampler.pixel_position::<SPREAD>(position_keys[lane], inputs.samples[lane]);
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
        if with_lens {
            for lane in 0..LANES {
                [inputs.lens[0][lane], inputs.lens[1][lane]] =
                    sampler.lens_position::<SPREAD>(lens_keys[lane], inputs.samples[lane]);
            }
        }
        for lane in 0..LANES {
            inputs.time[lane] = sampler.time::<SPREAD>(time_keys[lane], inputs.samples[lane]);
        }
        inputs
    }

    /// Sets the state of the camera.
    pub fn set(&self, scene: &CompiledScene, state: &mut LaneBlock) {
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
