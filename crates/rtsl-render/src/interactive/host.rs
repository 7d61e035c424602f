//! Answers what shaders ask: new rays, light, random numbers.

use rtsl::Method;
use rtsl::host::{
    Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, MAX_LANES, RayLanes,
};

use crate::acceleration::{LANES, LaneMask, Lanes, RayPacket, lanes_of};
use crate::math::{dot, normalize_or};
use crate::sampling::{RayStream, Sampler};

use super::area_light::{AreaLight, sample};
use super::compiled::Light;
use super::lane_vectors::{LaneVectors, blend};
use super::shading::{Tracer, radiance};
use super::variables::{number, set_number, set_vector, variables, vector};
use super::workspace::Workspace;

/// What belongs to each ray of a packet besides the ray itself.
pub struct LaneContext {
    sampler: Sampler,
    /// Where each ray stands in its sequence of numbers.
    pub streams: [RayStream; LANES],
    /// The time within the shutter.
    pub time: Lanes,
    geometric_normals: [Lanes; 3],
    shading_normals: [Lanes; 3],
    /// The lanes whose rays met the surface from where its normal does not point.
    behind: LaneMask,
}

impl LaneContext {
    /// Rays with these streams and times.
    pub fn new(sampler: Sampler, streams: [RayStream; LANES], time: Lanes) -> Self {
        LaneContext {
            sampler,
            streams,
            time,
            geometric_normals: [[0.0; LANES]; 3],
            shading_normals: [[0.0; LANES]; 3],
            behind: 0,
        }
    }

    /// Streams and times of the rays of a request, counted as the request counts them.
    fn of_request(&self, lanes: LaneSet) -> Self {
        let mut streams = [RayStream::default(); LANES];
        let mut time = [0.0; LANES];
        for lane in lanes.iter() {
            streams[lane] = self.streams[lanes.base as usize + lane];
            time[lane] = self.time[lanes.base as usize + lane];
        }
        LaneContext::new(self.sampler, streams, time)
    }

    /// The normal of the surface that a lane hit.
    pub fn geometric_normal(&self, lane: usize) -> [f32; 3] {
        [0, 1, 2].map(|axis: usize| self.geometric_normals[axis][lane])
    }

    /// Sets the normals of the surfaces that lanes hit, and by the sign of the geometric one's product with
    /// the ray's direction from which side they are seen.
    #[inline(always)]
    pub fn set_normals(
        &mut self,
        lanes: LaneMask,
        geometric: &LaneVectors,
        shading: &LaneVectors,
        along_ray: &Lanes,
    ) {
        for axis in 0..3 {
            blend(lanes, &geometric[axis], &mut self.geometric_normals[axis]);
            blend(lanes, &shading[axis], &mut self.shading_normals[axis]);
        }
        let behind = along_ray.iter().enumerate();
        let behind = behind.fold(0, |mask, (lane, x)| mask | LaneMask::from(*x > 0.0) << lane);
        self.behind = self.behind & !lanes | behind & lanes;
    }

    /// The geometric and the shading normal on the side of the surface that is seen: the one that
    /// lights light.
    fn seen_normals(&self, lane: usize) -> [[f32; 3]; 2] {
        let behind = self.behind >> lane & 1 != 0;
        let turned = |normal: [f32; 3]| normal.map(|x| if behind { -x } else { x });
        [self.geometric_normal(lane), self.shading_normal(lane)].map(turned)
    }

    /// The normal for shading where a lane hit.
    pub fn shading_normal(&self, lane: usize) -> [f32; 3] {
        [0, 1, 2].map(|axis: usize| self.shading_normals[axis][lane])
    }
}

/// A context alone answers `rand`; cameras, shapes and lights can ask for nothing else.
impl Host for LaneContext {
    fn trace(&mut self, _: LaneSet, _: &RayLanes, radiance: &mut LaneColors) {
        *radiance = Default::default();
    }

    fn occluded(&mut self, _: LaneSet, _: &RayLanes) -> u32 {
        0
    }

    fn light_count(&mut self) -> u32 {
        0
    }

    fn light_sample(&mut self, _: LaneSet, _: u32, _: &LightQueryLanes, _: &mut LightLanes) -> u32 {
        0
    }

    fn ambient(&mut self) -> [f32; 3] {
        [0.0; 3]
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        for lane in lanes.iter() {
            let stream = &mut self.streams[lanes.base as usize + lane];
            values[lane] = self.sampler.next(stream);
        }
    }
}

/// Answers the materials of a packet.
pub struct ShadingHost<'a> {
    /// What rays are traced with.
    pub tracer: &'a Tracer<'a>,
    /// The thread's memory.
    pub workspace: &'a mut Workspace,
    /// What belongs to the rays that are shaded.
    pub context: &'a mut LaneContext,
    /// How often the rays that are shaded were spawned by others.
    pub depth: u32,
}

impl Host for ShadingHost<'_> {
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, colors: &mut LaneColors) {
        *colors = Default::default();
        let scene = self.tracer.scene;
        let mask = LaneMask::from(lanes.active);
        let mut streams = [RayStream::default(); LANES];
        for lane in lanes.iter() {
            streams[lane] = self.context.streams[lanes.base as usize + lane].spawn();
        }
        if self.depth >= scene.settings.max_depth || self.tracer.problems.any() {
            return;
        }
        let packet = self.packet(lanes, rays);
        self.workspace.rays.traced += u64::from(lanes.active.count_ones());
        let mut context = LaneContext::new(self.context.sampler, streams, packet.time);
        let traced =
            radiance(self.tracer, self.workspace, &packet, mask, &mut context, self.depth + 1);
        for (channel, color) in colors.iter_mut().enumerate() {
            color.copy_from_slice(&traced[channel][..MAX_LANES]);
        }
    }

    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        let packet = self.packet(lanes, rays);
        self.shadow(&packet, lanes.active)
    }

    fn light_count(&mut self) -> u32 {
        (self.tracer.scene.lights.len() + self.tracer.scene.area_lights.len()) as u32
    }

    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        answer: &mut LightLanes,
    ) -> u32 {
        let scene = self.tracer.scene;
        let index = index as usize;
        let Some(light) = scene.lights.get(index) else {
            let area_light = scene.area_lights.get(index - scene.lights.len());
            return area_light
                .map_or(0, |light| self.sample_area_light(lanes, light, query, answer));
        };
        if !self.sample_light(lanes, light, query, answer) {
            return 0;
        }
        let reaching = lanes.iter().filter(|lane| reaches(*lane, query, answer));
        let reaching = reaching.fold(0, |mask: u32, lane| mask | 1 << lane);
        let epsilon = scene.epsilon;
        let mut packet = RayPacket::default();
        for lane in lanes.iter() {
            let point = lane_vector(&query.point, lane);
            packet.set(lane, point, lane_vector(&answer.direction, lane));
            packet.epsilon[lane] = epsilon;
            packet.limit[lane] = answer.distance[lane] - epsilon;
            packet.time[lane] = self.context.time[lanes.base as usize + lane];
        }
        reaching & !self.shadow(&packet, reaching)
    }

    fn ambient(&mut self) -> [f32; 3] {
        self.tracer.scene.ambient
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        self.context.rand(lanes, values);
    }
}

impl ShadingHost<'_> {
    /// The rays of a request as a packet of their own.
    fn packet(&self, lanes: LaneSet, rays: &RayLanes) -> RayPacket {
        let mut packet = RayPacket::default();
        for lane in lanes.iter() {
            packet.set(lane, lane_vector(&rays.origin, lane), lane_vector(&rays.direction, lane));
            packet.epsilon[lane] = self.tracer.scene.epsilon;
            packet.limit[lane] = rays.limit[lane];
            packet.time[lane] = self.context.time[lanes.base as usize + lane];
        }
        packet
    }

    fn shadow(&mut self, packet: &RayPacket, lanes: u32) -> u32 {
        self.workspace.rays.shadow += u64::from(lanes.count_ones());
        self.tracer.any_hit(self.workspace, packet, LaneMask::from(lanes)) as u32
    }

    fn sample_area_light(
        &mut self,
        lanes: LaneSet,
        light: &AreaLight,
        query: &LightQueryLanes,
        answer: &mut LightLanes,
    ) -> u32 {
        // The light's surface has a context of its own; its numbers are those of the rays.
        let mut context = self.context.of_request(lanes);
        let (tracer, workspace) = (self.tracer, &mut *self.workspace);
        let lit = sample(tracer, workspace, &mut context, light, lanes, query, answer);
        for lane in lanes.iter() {
            self.context.streams[lanes.base as usize + lane] = context.streams[lane];
        }
        lit
    }

    /// Runs `illumination`; false if the light has none.
    fn sample_light(
        &mut self,
        lanes: LaneSet,
        light: &Light,
        query: &LightQueryLanes,
        answer: &mut LightLanes,
    ) -> bool {
        let scene = self.tracer.scene;
        let problems = self.tracer.problems;
        let Some(call) = scene.call(&light.instance, Method::Illumination, problems) else {
            return false;
        };
        let v = variables();
        let blocks = &mut self.workspace.light;
        let base = lanes.base as usize;
        let mask = LaneMask::from(lanes.active) << base;
        for lane in lanes_of(mask) {
            let state = &mut blocks.state;
            let point = light.inverse.point(lane_vector(&query.point, lane - base));
            set_vector(state, v.hit_point, lane, point);
            let normals = self.context.seen_normals(lane);
            for (variable, normal) in
                [v.geometric_normal, v.shading_normal].into_iter().zip(normals)
            {
                let local = light.forward.transposed_vector(normal);
                set_vector(state, variable, lane, normalize_or(local, [0.0, 0.0, 1.0]));
            }
            set_number(state, v.time_seed, lane, self.context.time[lane]);
        }
        blocks.call(&call, mask, None, self.context);
        for lane in lanes.iter() {
            read_light(light, &blocks.state, base + lane, lane, answer);
        }
        true
    }
}

/// The light's sample of a lane, taken into world space.
fn read_light(
    light: &Light,
    state: &rtsl::LaneBlock,
    from: usize,
    lane: usize,
    answer: &mut LightLanes,
) {
    let v = variables();
    let mut direction = vector(state, v.light_direction, from);
    let mut distance = number(state, v.light_distance, from);
    if !light.forward.is_identity() {
        let world = light.forward.vector(direction);
        distance *= dot(world, world).sqrt();
        direction = normalize_or(world, direction);
    }
    let color = vector(state, v.light_color, from);
    for axis in 0..3 {
        answer.direction[axis][lane] = direction[axis];
        answer.color[axis][lane] = color[axis];
    }
    answer.distance[lane] = distance;
    answer.pdf[lane] = number(state, v.pdf, from);
}

/// Whether a light's sample lies within the cone and is not black.
fn reaches(lane: usize, query: &LightQueryLanes, light: &LightLanes) -> bool {
    light.color.iter().any(|channel| channel[lane] != 0.0) && within_cone(lane, query, light)
}

/// Whether a light's sample lies within the cone.
pub fn within_cone(lane: usize, query: &LightQueryLanes, light: &LightLanes) -> bool {
    let cosine = query.cosine[lane];
    if cosine == f32::NEG_INFINITY {
        return true;
    }
    let axis = normalize_or(lane_vector(&query.normal, lane), [0.0; 3]);
    dot(axis, lane_vector(&light.direction, lane)) >= cosine
}

/// The vector of one lane of a request.
pub fn lane_vector(lanes: &[LaneFloats; 3], lane: usize) -> [f32; 3] {
    [0, 1, 2].map(|axis: usize| lanes[axis][lane])
}
