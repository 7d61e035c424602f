//! Camera rays of a tile.

use rtsl::Method;

use crate::acceleration::{LANES, LaneMask, Lanes, RayPacket, lanes_of};
use crate::math::reciprocal;
use crate::sampling::RayStream;

use super::host::LaneContext;
use super::shading::{PacketColors, Tracer};
use super::variables::{number, set_number, set_vector, variables, vector};
use super::workspace::Workspace;

/// The side of a tile in pixels: a packet is one sample of each of its pixels.
pub const TILE: usize = 8;

/// A tile of the image. Lanes follow a Z through its pixels, bits of x and y in turn, so that the
/// lanes of one vector, of any width, are close to square: neighbours hit the same.
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    /// Its first column.
    pub x: usize,
    /// Its first row, from the top.
    pub y: usize,
}

impl Tile {
    /// The pixel of a lane.
    pub fn pixel(&self, lane: usize) -> (usize, usize) {
        (self.x + every_other_bit(lane), self.y + every_other_bit(lane >> 1))
    }

    /// The lane of the pixel (x, y) in its tile.
    pub fn lane(x: usize, y: usize) -> usize {
        let spread = |place: usize| place & 1 | (place & 2) << 1 | (place & 4) << 2;
        spread(x) | spread(y) << 1
    }

    /// The lanes whose pixels lie inside the image.
    pub fn lanes(&self, width: usize, height: usize) -> LaneMask {
        let inside = |lane: &usize| {
            let (x, y) = self.pixel(*lane);
            x < width && y < height
        };
        (0..LANES).filter(inside).fold(0, |mask, lane| mask | 1 << lane)
    }
}

/// Bits 0, 2 and 4 of a lane, side by side.
fn every_other_bit(lane: usize) -> usize {
    lane & 1 | lane >> 1 & 2 | lane >> 2 & 4
}

/// Camera rays, what belongs to them, and their weights.
pub struct CameraRays {
    /// The rays.
    pub rays: RayPacket,
    /// Random numbers and time.
    pub context: LaneContext,
    /// What radiance is multiplied with.
    pub weights: PacketColors,
}

/// Makes the rays of one sample of a tile.
pub fn camera_rays(
    tracer: &Tracer<'_>,
    workspace: &mut Workspace,
    tile: Tile,
    sample: u32,
) -> CameraRays {
    let scene = tracer.scene;
    let settings = &scene.settings;
    let lanes = tile.lanes(settings.width, settings.height);
    let v = variables();
    let (du, dv) = (1.0 / settings.width as f32, 1.0 / settings.height as f32);
    let mut streams = [RayStream::default(); LANES];
    let mut time: Lanes = [0.0; LANES];
    let mut level = workspace.take_level();
    let state = &mut level.blocks.state;
    for lane in lanes_of(lanes) {
        let (x, y) = tile.pixel(lane);
        let pixel = (y * settings.width + x) as u64;
        let [px, py] = settings.sampler.pixel_position(pixel, sample);
        let [lens_x, lens_y] = settings.sampler.lens_position(pixel, sample);
        streams[lane] = settings.sampler.stream(pixel, sample);
        time[lane] = settings.sampler.time(pixel, sample);
        // Rows count from the top, screen coordinates from the bottom.
        let row = (settings.height - 1 - y) as f32 + (1.0 - py);
        set_number(state, v.screen_coord, lane, (x as f32 + px) * du);
        set_number(state, v.screen_coord + 1, lane, row * dv);
        set_number(state, v.lens_coord, lane, lens_x);
        set_number(state, v.lens_coord + 1, lane, lens_y);
        set_number(state, v.du, lane, du);
        set_number(state, v.dv, lane, dv);
        set_number(state, v.time_seed, lane, time[lane]);
        set_number(state, v.epsilon, lane, scene.epsilon);
        set_number(state, v.hit_distance, lane, f32::INFINITY);
        set_vector(state, v.ray_origin, lane, [0.0; 3]);
        set_vector(state, v.ray_direction, lane, [0.0, 0.0, 1.0]);
        set_vector(state, v.inverse_ray_direction, lane, reciprocal([0.0, 0.0, 1.0]));
        set_vector(state, v.sample_color, lane, [1.0; 3]);
    }
    let mut context = LaneContext::new(settings.sampler, streams, time);
    if let Some(call) = scene.call(&scene.camera, Method::GenerateRay, tracer.problems) {
        level.blocks.call(&call, lanes, None, &mut context);
    }
    let state = &level.blocks.state;
    let mut rays = RayPacket { time, ..RayPacket::default() };
    let mut weights = [[0.0; LANES]; 3];
    for lane in lanes_of(lanes) {
        let origin = scene.camera_to_world.point(vector(state, v.ray_origin, lane));
        let direction = scene.camera_to_world.vector(vector(state, v.ray_direction, lane));
        rays.set(lane, origin, direction);
        rays.epsilon[lane] = number(state, v.epsilon, lane);
        rays.limit[lane] = number(state, v.hit_distance, lane);
        let weight = vector(state, v.sample_color, lane);
        (0..3).for_each(|channel| weights[channel][lane] = weight[channel]);
    }
    workspace.return_level(level);
    CameraRays { rays, context, weights }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_has_a_lane() {
        let tile = Tile { x: 16, y: 8 };
        for lane in 0..LANES {
            let (x, y) = tile.pixel(lane);
            assert_eq!(Tile::lane(x, y), lane);
        }
        assert_eq!((tile.pixel(1), tile.pixel(2), tile.pixel(63)), ((17, 8), (16, 9), (23, 15)));
    }
}
