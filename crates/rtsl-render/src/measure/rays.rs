//! The rays that are timed, generated once.

use rtsl_bvh::{Bounds, LANES, LaneMask, RayPacket};
use rtsl_math::dot;
use rtsl_math::sampling::{hash, unit_float};

use super::hit_surfaces::{HitSurfaces, light_rays, surfaces_of_hits};
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::tracer::Tracer;
use crate::integrate::memory::ThreadMemory;
use crate::integrate::shading_texts::ShadingCalls;
use crate::schedule::tile::Tile;
use crate::schedule::tile_samples::TileSamples;

/// A packet with its active lanes.
pub struct Packet {
    pub rays: RayPacket,
    pub lanes: LaneMask,
}

impl Packet {
    /// Sets the ray of a lane.
    fn add(&mut self, lane: usize, origin: [f32; 3], direction: [f32; 3], limit: f32) {
        self.rays.set(lane, origin, direction);
        self.rays.limit[lane] = limit;
        self.lanes |= 1 << lane;
    }
}

/// Rays of each kind except primary rays, which are generated as they are traced.
#[derive(Default)]
pub struct RaySets {
    pub shadow: Vec<Packet>,
    pub secondary: Vec<Packet>,
    pub random: Vec<Packet>,
}

/// The greatest number of packets of a kind: a quarter of a million rays suffice, and take 9 MiB.
const MAX_PACKETS: usize = 4096;

impl RaySets {
    /// Generates rays from the hits of the primary rays of `tiles`, or of an evenly spaced subset.
    pub fn new(scene: &RenderScene, errors: &RuntimeErrors, tiles: &[Tile]) -> Self {
        let mut memory = ThreadMemory::new(scene);
        let mut sets = RaySets::default();
        let count = tiles.len().min(MAX_PACKETS);
        for index in 0..count {
            let tile = tiles[index * tiles.len() / count];
            sets.add_tile(scene, errors, &mut memory, tile, index);
        }
        let compiled = &scene.compiled;
        let world = compiled.geometry.groups.first().and_then(|world| world.bounds());
        if let Some(world) = world {
            sets.random = (0..count).map(|index| random(world, compiled.epsilon, index)).collect();
        }
        sets
    }

    fn add_tile(
        &mut self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        memory: &mut ThreadMemory,
        tile: Tile,
        index: usize,
    ) {
        let CompiledScene { settings, epsilon, .. } = &scene.compiled;
        let searches = Tracer { scene: &scene.compiled, errors };
        let samples = TileSamples { tile, first: 0, count: 1 };
        let lanes = samples.lanes(0, (settings.width, settings.height));
        let camera = memory.camera.generate_packet(scene, errors, &samples, 0);
        let hits = searches.nearest(&mut memory.searcher.memory, &camera.rays, lanes);
        let surfaces =
            surfaces_of_hits(scene, errors, &mut memory.batch, &camera.rays, lanes, &hits);
        let leaving = Leaving { epsilon: *epsilon, surfaces: &surfaces, time: &camera.rays.time };
        let secondary = leaving.secondary(&mut memory.shading_calls, index);
        self.secondary.extend(Some(secondary).filter(|packet| packet.lanes != 0));
        let shadow = leaving.shadow(scene, errors, memory, index);
        self.shadow.extend(shadow.filter(|packet| packet.lanes != 0));
    }
}

/// Rays that leave the surfaces that a packet's rays hit.
struct Leaving<'a> {
    epsilon: f32,
    surfaces: &'a HitSurfaces,
    time: &'a [f32; LANES],
}

impl Leaving<'_> {
    /// Rays with cosine-distributed directions: the sum of a unit normal and a random unit vector.
    fn secondary(&self, calls: &mut ShadingCalls, index: usize) -> Packet {
        let mut random = RandomNumbers::new(RandomNumbers::OF_SECONDARY_RAYS, index);
        let mut packet = self.no_rays();
        for (lane, surface) in self.surfaces.iter().enumerate() {
            let Some(surface) = surface else { continue };
            let (normal, sphere) = (surface.normal(), random.on_sphere());
            let direction = std::array::from_fn(|axis| normal[axis] + sphere[axis]);
            let origin = calls.leave(Some(surface), surface.point(), direction);
            packet.add(lane, origin, direction, f32::INFINITY);
        }
        packet
    }

    /// Rays towards one of the lights, another for each packet, in the lanes for which the light is above the surface.
    fn shadow(
        &self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        memory: &mut ThreadMemory,
        index: usize,
    ) -> Option<Packet> {
        let light = (index as u32).checked_rem(scene.lights.entries.len() as u32)?;
        let rays = light_rays(scene, errors, memory, light, self.surfaces, self.time);
        let mut packet = self.no_rays();
        for (lane, (surface, ray)) in self.surfaces.iter().zip(rays).enumerate() {
            let Some((surface, (direction, limit))) = surface.as_ref().zip(ray) else { continue };
            if dot(surface.normal(), direction) > 0.0 {
                let calls = &mut memory.shading_calls;
                let origin = calls.leave(Some(surface), surface.point(), direction);
                packet.add(lane, origin, direction, limit);
            }
        }
        Some(packet)
    }

    fn no_rays(&self) -> Packet {
        let epsilon = [self.epsilon; LANES];
        let rays = RayPacket { time: *self.time, epsilon, ..RayPacket::default() };
        Packet { rays, lanes: 0 }
    }
}

/// Rays from random points in the cube around the scene, in random directions.
fn random(world: Bounds, epsilon: f32, index: usize) -> Packet {
    let mut random = RandomNumbers::new(RandomNumbers::OF_RANDOM_RAYS, index);
    let half = (0..3).map(|axis| world.max[axis] - world.min[axis]).fold(0.0, f32::max) * 0.5;
    let mut rays = RayPacket::default();
    for lane in 0..LANES {
        let origin = std::array::from_fn(|axis| {
            (world.min[axis] + world.max[axis]) * 0.5 + half * random.between_minus_one_and_one()
        });
        rays.set(lane, origin, random.on_sphere());
        rays.epsilon[lane] = epsilon;
        rays.limit[lane] = f32::INFINITY;
    }
    Packet { rays, lanes: LaneMask::MAX }
}

/// Random numbers that are the same in every run.
struct RandomNumbers {
    key: u32,
    count: u32,
}

impl RandomNumbers {
    const OF_SECONDARY_RAYS: u32 = 1;
    const OF_RANDOM_RAYS: u32 = 2;

    /// The sequence for one packet of a purpose.
    fn new(purpose: u32, packet: usize) -> Self {
        RandomNumbers { key: hash(purpose, packet as u32), count: 0 }
    }

    fn between_minus_one_and_one(&mut self) -> f32 {
        self.count += 1;
        2.0 * unit_float(hash(self.key, self.count)) - 1.0
    }

    /// By rejection sampling, which needs no trigonometry.
    fn on_sphere(&mut self) -> [f32; 3] {
        loop {
            let point = [0; 3].map(|_| self.between_minus_one_and_one());
            let square = dot(point, point);
            if (1e-4..=1.0).contains(&square) {
                return point.map(|x| x / square.sqrt());
            }
        }
    }
}
