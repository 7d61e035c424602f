//! The rays, generated before the time is taken.

use rtsl_bvh::{LANES, LaneMask, RayPacket, TraversalStack, lanes_of};
use rtsl_math::{dot, normalize_or};

use super::scenes::{Numbers, Scene};
use super::shapes::Tests;

/// A packet with its active lanes.
pub struct Packet {
    /// The rays.
    pub rays: RayPacket,
    /// The active lanes.
    pub lanes: LaneMask,
}

/// The side of the image in pixels, and of a packet's tile.
const SIDE: usize = 1024;
const TILE: usize = 8;

/// One of so many tiles of the image, in each direction, starts rays that leave surfaces.
const LEAVING: usize = 2;

/// Returns the rays through all pixels of a square image.
pub fn camera(scene: &Scene) -> Vec<Packet> {
    let mut packets = Vec::new();
    for y in (0..SIDE).step_by(TILE) {
        for x in (0..SIDE).step_by(TILE) {
            packets.push(tile(scene, x, y));
        }
    }
    packets
}

#[expect(clippy::disallowed_methods, reason = "times do not depend on the last bit of a direction")]
fn tile(scene: &Scene, x: usize, y: usize) -> Packet {
    let (eye, target, field_of_view) = scene.camera;
    let ahead = normalize_or([0, 1, 2].map(|axis| target[axis] - eye[axis]), [0.0, 0.0, 1.0]);
    let right = normalize_or([-ahead[2], 0.0, ahead[0]], [1.0, 0.0, 0.0]);
    let up = [
        right[1] * ahead[2] - right[2] * ahead[1],
        right[2] * ahead[0] - right[0] * ahead[2],
        right[0] * ahead[1] - right[1] * ahead[0],
    ];
    let half = (0.5 * field_of_view.to_radians()).tan();
    let mut rays = RayPacket::default();
    for lane in 0..LANES {
        // Lanes follow a Z-order curve.
        let every_other = |it: usize| it & 1 | it >> 1 & 2 | it >> 2 & 4;
        let at = |pixel: usize| half * (2.0 * (pixel as f32 + 0.5) / SIDE as f32 - 1.0);
        let (u, v) = (at(x + every_other(lane)), -at(y + every_other(lane >> 1)));
        let direction = [0, 1, 2].map(|axis| ahead[axis] + u * right[axis] + v * up[axis]);
        rays.set(lane, eye, normalize_or(direction, ahead));
    }
    rays.limit = [f32::INFINITY; LANES];
    Packet { rays, lanes: LaneMask::MAX }
}

/// Returns rays from the surfaces that the camera's rays hit: in directions around the normal, and towards a lamp.
pub fn from_surfaces(scene: &Scene, camera: &[Packet]) -> (Vec<Packet>, Vec<Packet>) {
    const LAMP: [f32; 3] = [4.0, 6.0, 3.0];
    let mut numbers = Numbers(7);
    let mut tests = Tests::new(&scene.shapes);
    let (mut secondary, mut shadow) = (Vec::new(), Vec::new());
    let tiles = SIDE / TILE;
    let is_leaving = |index: &usize| {
        (index % tiles).is_multiple_of(LEAVING) && (index / tiles).is_multiple_of(LEAVING)
    };
    for index in (0..camera.len()).filter(is_leaving) {
        let Packet { rays, lanes } = &camera[index];
        let hits = scene.geometry.nearest(rays, *lanes, &mut tests, &mut TraversalStack::default());
        let lanes = hits.lanes(*lanes);
        let mut around = RayPacket { limit: [f32::INFINITY; LANES], ..RayPacket::default() };
        around.epsilon = [1e-3; LANES];
        let mut towards = RayPacket { limit: [0.999; LANES], ..around.clone() };
        let mut lit = 0;
        for lane in lanes_of(lanes) {
            let (origin, direction) = (rays.origin_of(lane), rays.direction_of(lane));
            let point = [0, 1, 2].map(|axis| origin[axis] + hits.distance[lane] * direction[axis]);
            let normal = scene.normal(hits.id[lane], point, direction);
            let random = on_sphere(&mut numbers);
            around.set(lane, point, [0, 1, 2].map(|axis| normal[axis] + random[axis]));
            let to_lamp = [0, 1, 2].map(|axis| LAMP[axis] - point[axis]);
            towards.set(lane, point, to_lamp);
            lit |= u64::from(dot(to_lamp, normal) > 0.0) << lane;
        }
        secondary.extend((lanes != 0).then_some(Packet { rays: around, lanes }));
        shadow.extend((lit != 0).then_some(Packet { rays: towards, lanes: lit }));
    }
    (secondary, shadow)
}

/// Returns rays from random points in the cube around the scene, in random directions.
pub fn random(scene: &Scene, count: usize) -> Vec<Packet> {
    let mut numbers = Numbers(11);
    let bounds = scene.geometry.groups[0].tree.bounds;
    let size = [0, 1, 2].map(|axis| bounds.max[axis] - bounds.min[axis]);
    let half = 0.5 * size.into_iter().fold(0.0, f32::max);
    let packet = |_| {
        let mut rays = RayPacket { limit: [f32::INFINITY; LANES], ..RayPacket::default() };
        for lane in 0..LANES {
            let middle = |axis: usize| (bounds.min[axis] + bounds.max[axis]) * 0.5;
            let origin = [0, 1, 2].map(|axis| middle(axis) + half * numbers.around_zero());
            rays.set(lane, origin, on_sphere(&mut numbers));
        }
        Packet { rays, lanes: LaneMask::MAX }
    };
    (0..count).map(packet).collect()
}

fn on_sphere(numbers: &mut Numbers) -> [f32; 3] {
    loop {
        let point = [0; 3].map(|_| numbers.around_zero());
        let square = dot(point, point);
        if (1e-4..=1.0).contains(&square) {
            return point.map(|it| it / square.sqrt());
        }
    }
}
