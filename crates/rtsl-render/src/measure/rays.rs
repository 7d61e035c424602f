//! The rays that are timed, generated once.

use rtsl::host::{Host, LaneSet, LightLanes, LightQueryLanes, MAX_LANES};
use rtsl_bvh::{Bounds, Hits, LANES, LaneMask, RayPacket, lanes_of};
use rtsl_math::dot;
use rtsl_math::sampling::{hash, unit_float};

use crate::compiled::tracer::Tracer;
use crate::tiles::{CameraRays, LaneContext, Tile, camera_rays};
use crate::whitted::{ShadingHost, Workspace, hit_groups, prepare};

/// A packet with its active lanes.
pub struct Packet {
    pub rays: RayPacket,
    pub lanes: LaneMask,
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
    pub fn new(tracer: &Tracer<'_>, tiles: &[Tile]) -> Self {
        let mut workspace = Workspace::new(tracer.scene);
        let mut sets = RaySets::default();
        let count = tiles.len().min(MAX_PACKETS);
        for index in 0..count {
            let tile = tiles[index * tiles.len() / count];
            sets.add_tile(tracer, &mut workspace, tile, index);
        }
        let world = tracer.scene.geometry.groups.first().and_then(|world| world.bounds());
        if let Some(world) = world {
            sets.random = (0..count)
                .map(|index| random(world, tracer.scene.camera_epsilon(), index))
                .collect();
        }
        sets
    }

    fn add_tile(
        &mut self,
        tracer: &Tracer<'_>,
        workspace: &mut Workspace,
        tile: Tile,
        index: usize,
    ) {
        let settings = &tracer.scene.settings;
        let mut camera = camera_rays(tracer, &mut workspace.camera, tile, 0);
        let CameraRays { rays, context, .. } = &mut *camera;
        let mut level = workspace.take_level();
        let lanes = tile.lanes(settings.width, settings.height);
        let hits = tracer.nearest(&mut workspace.search, rays, lanes);
        for group in &hit_groups(tracer.scene, &hits, lanes) {
            prepare(tracer, group, rays, &hits, &mut level, context);
        }
        workspace.return_level(level);
        let surface = Surface { hits: &hits, lanes: hits.lanes(lanes), rays };
        let secondary = surface.secondary(tracer, context, index);
        let shadow = surface.shadow(tracer, workspace, context, index);
        workspace.camera.keep(camera);
        self.secondary.extend(Some(secondary).filter(|packet| packet.lanes != 0));
        self.shadow.extend(shadow.filter(|packet| packet.lanes != 0));
    }
}

/// The distance before lights at which shadow rays end, relative to their distance.
const BEFORE_LIGHT: f32 = 1e-3;

/// The hits of a packet's rays.
struct Surface<'a> {
    rays: &'a RayPacket,
    hits: &'a Hits,
    lanes: LaneMask,
}

impl Surface<'_> {
    fn point(&self, lane: usize) -> [f32; 3] {
        let (origin, direction) = (self.rays.origin_of(lane), self.rays.direction_of(lane));
        std::array::from_fn(|axis| origin[axis] + direction[axis] * self.hits.distance[lane])
    }

    /// The normal on the side that the ray came from.
    fn normal(&self, context: &LaneContext, lane: usize) -> [f32; 3] {
        let normal = context.geometric_normal(lane);
        let behind = dot(normal, self.rays.direction_of(lane)) > 0.0;
        normal.map(|x| if behind { -x } else { x })
    }

    /// Rays with cosine-distributed directions: the sum of a unit normal and a random unit vector.
    fn secondary(&self, tracer: &Tracer<'_>, context: &LaneContext, index: usize) -> Packet {
        let mut random = RandomNumbers::new(RandomNumbers::OF_SECONDARY_RAYS, index);
        let mut rays = RayPacket::default();
        for lane in lanes_of(self.lanes) {
            let (normal, sphere) = (self.normal(context, lane), random.on_sphere());
            let direction = std::array::from_fn(|axis| normal[axis] + sphere[axis]);
            rays.set(lane, self.point(lane), direction);
            rays.epsilon[lane] = tracer.scene.epsilon;
            rays.limit[lane] = f32::INFINITY;
            rays.time[lane] = self.rays.time[lane];
        }
        context.leave_surfaces(&mut rays, self.lanes);
        Packet { rays, lanes: self.lanes }
    }

    /// Rays towards one of the lights, another for each packet, in the lanes for which the light is above the surface.
    fn shadow(
        &self,
        tracer: &Tracer<'_>,
        workspace: &mut Workspace,
        context: &mut LaneContext,
        index: usize,
    ) -> Option<Packet> {
        let time = context.time;
        let mut host = ShadingHost { tracer, workspace, context, depth: 0 };
        let lights = host.light_count();
        let light = (index as u32).checked_rem(lights)?;
        let mut packet = Packet { rays: RayPacket { time, ..RayPacket::default() }, lanes: 0 };
        for base in (0..LANES).step_by(MAX_LANES) {
            let active = (self.lanes >> base & ((1 << MAX_LANES) - 1)) as u32;
            let set = LaneSet { base: base as u32, active };
            let mut samples = LightLanes::default();
            host.light_sample(set, light, &self.query(base), &mut samples);
            for lane in set.iter().filter(|lane| samples.distance[*lane] > 0.0) {
                let (from, to) = (base + lane, samples.direction.map(|axis| axis[lane]));
                if dot(self.normal(host.context, from), to) > 0.0 {
                    packet.rays.set(from, self.point(from), to);
                    packet.rays.epsilon[from] = tracer.scene.epsilon;
                    packet.rays.limit[from] = samples.distance[lane] * (1.0 - BEFORE_LIGHT);
                    packet.lanes |= 1 << from;
                }
            }
        }
        host.context.leave_surfaces(&mut packet.rays, packet.lanes);
        Some(packet)
    }

    /// The points of the lanes from `base` on, as light requests.
    fn query(&self, base: usize) -> LightQueryLanes {
        let cosine = [f32::NEG_INFINITY; MAX_LANES];
        let mut query = LightQueryLanes { cosine, ..LightQueryLanes::default() };
        for lane in 0..MAX_LANES {
            let point = self.point(base + lane);
            (0..3).for_each(|axis| query.point[axis][lane] = point[axis]);
        }
        query
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
