//! The host of shaders: answers requests for rays, light and random numbers.
//!
//! The requests of a call for several SIMD vectors arrive together, and are answered for all lanes of the packet at
//! once: one search for their shadow rays, one for the rays that they spawn.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch};
use rtsl::host::{
    Host, LaneColors, LaneFloats, LaneSet, LightLanes, LightQueryLanes, LightRequest,
    OcclusionRequest, RayLanes, TraceRequest,
};
use rtsl::{LaneBlock, Method};
use rtsl_bvh::{LANES, LaneMask, Lanes, RayPacket};
use rtsl_scene::MAX_TRACE_DEPTH;

use super::area_light::sample;
use super::light_samples::LightSamples;
use super::shading::radiance;
use super::workspace::{SpawnedPacket, Workspace};
use crate::compiled::light::Light;
use crate::compiled::tracer::Tracer;
use crate::compiled::variables::variables;
use crate::lanes::delta_light::delta_scale;
use crate::lanes::eight::{dots, eights_alone, is_finite, is_lit, not_finite, scaled, select};
use crate::lanes::request_lanes::{from_packet, mask_of, request_bits, to_packet};
use crate::lanes::surface_offset::distance_to_light;
use crate::tiles::LaneContext;

/// The host of a packet's materials.
pub struct ShadingHost<'a> {
    /// The inputs of searches.
    pub tracer: &'a Tracer<'a>,
    /// The thread's memory.
    pub workspace: &'a mut Workspace,
    /// The context of the rays that are shaded.
    pub context: &'a mut LaneContext,
    /// The depth of the rays that are shaded.
    pub depth: u32,
}

impl Host for ShadingHost<'_> {
    fn trace(&mut self, lanes: LaneSet, rays: &RayLanes, radiance: &mut LaneColors) {
        self.trace_together(&mut [TraceRequest { lanes, rays, radiance }]);
    }

    fn occluded(&mut self, lanes: LaneSet, rays: &RayLanes) -> u32 {
        let mut request = [OcclusionRequest { lanes, rays, occluded: 0 }];
        self.occluded_together(&mut request);
        request[0].occluded
    }

    fn light_count(&mut self) -> u32 {
        (self.tracer.scene.lights.len() + self.tracer.scene.area_lights.len()) as u32
    }

    fn light_sample(
        &mut self,
        lanes: LaneSet,
        index: u32,
        query: &LightQueryLanes,
        light: &mut LightLanes,
    ) -> u32 {
        let mut request = [LightRequest { lanes, query, light, reached: 0 }];
        self.light_sample_together(index, &mut request);
        request[0].reached
    }

    fn trace_together(&mut self, requests: &mut [TraceRequest<'_>]) {
        let mut packet = self.workspace.take_spawned();
        let lanes = dispatch!(Level::new(), simd => self.spawn(simd, requests, &mut packet));
        if lanes != 0 {
            self.workspace.rays.traced += u64::from(lanes.count_ones());
            let SpawnedPacket { rays, context, .. } = &mut *packet;
            let (tracer, workspace, depth) = (self.tracer, &mut *self.workspace, self.depth + 1);
            let traced = radiance(tracer, workspace, rays, lanes, context, depth);
            self.context.take_not_finite(not_finite(&traced, lanes));
            for request in requests {
                for (channel, color) in request.radiance.iter_mut().enumerate() {
                    from_packet(request.lanes, &traced[channel], color);
                }
            }
        }
        self.workspace.keep_spawned(packet);
    }

    fn occluded_together(&mut self, requests: &mut [OcclusionRequest<'_>]) {
        let mut packet = self.workspace.take_spawned();
        let asked = requests.iter().map(|it| (it.lanes, it.rays));
        let lanes = dispatch!(Level::new(), simd => self.set_rays(simd, asked, &mut packet.rays));
        let occluded = self.shadow(&packet.rays, lanes);
        self.workspace.keep_spawned(packet);
        for request in requests {
            request.occluded = request_bits(request.lanes, occluded);
        }
    }

    fn light_sample_together(&mut self, index: u32, requests: &mut [LightRequest<'_>]) {
        let mut samples = self.workspace.take_light_samples();
        dispatch!(Level::new(), simd => self.answer(simd, index as usize, requests, &mut samples));
        self.workspace.keep_light_samples(samples);
    }

    fn ambient(&mut self) -> [f32; 3] {
        self.tracer.scene.ambient
    }

    fn rand(&mut self, lanes: LaneSet, values: &mut LaneFloats) {
        self.context.rand(lanes, values);
    }
}

impl ShadingHost<'_> {
    /// Creates a packet of the requested rays. Returns the lanes whose rays contribute enough to be traced.
    #[inline(always)]
    fn spawn<S: Simd>(
        &mut self,
        simd: S,
        requests: &[TraceRequest<'_>],
        packet: &mut SpawnedPacket,
    ) -> LaneMask {
        let SpawnedPacket { rays, weights, context } = packet;
        let asking = self.set_rays(simd, requests.iter().map(|it| (it.lanes, it.rays)), rays);
        for request in requests {
            to_packet(request.lanes, &request.rays.weight, weights);
        }
        self.context.spawn(asking, weights, context);
        let settings = &self.tracer.scene.settings;
        if self.depth >= settings.max_depth.min(MAX_TRACE_DEPTH) || self.tracer.errors.any() {
            return 0;
        }
        asking & !context.less_important_than(simd, settings.cutoff, asking)
    }

    /// Sets the rays of requests, each in its lane; returns the requesting lanes.
    #[inline(always)]
    fn set_rays<'a, S: Simd>(
        &self,
        simd: S,
        requests: impl Iterator<Item = (LaneSet, &'a RayLanes)>,
        packet: &mut RayPacket,
    ) -> LaneMask {
        packet.epsilon = [self.tracer.scene.epsilon; LANES];
        packet.time = self.context.time;
        let mut asking = 0;
        for (lanes, rays) in requests {
            asking |= mask_of(lanes);
            for axis in 0..3 {
                to_packet(lanes, &rays.origin[axis], &mut packet.origin[axis]);
                to_packet(lanes, &rays.direction[axis], &mut packet.direction[axis]);
            }
            to_packet(lanes, &rays.limit, &mut packet.limit);
        }
        self.context.leave_in_vectors(simd, packet, asking);
        asking
    }

    /// Answers requests for samples of a light.
    #[inline(always)]
    fn answer<S: Simd>(
        &mut self,
        simd: S,
        index: usize,
        requests: &mut [LightRequest<'_>],
        samples: &mut LightSamples,
    ) {
        let scene = self.tracer.scene;
        samples.begin(requests, scene.epsilon, &self.context.time);
        let reached = if let Some(light) = scene.lights.get(index) {
            self.sample_light(simd, light, samples)
        } else if let Some(light) = scene.area_lights.get(index - scene.lights.len()) {
            sample(self.tracer, self.workspace, self.context, light, samples)
        } else {
            0
        };
        samples.answer(reached, requests);
    }

    /// Returns the lanes whose rays are occluded.
    fn shadow(&mut self, rays: &RayPacket, lanes: LaneMask) -> LaneMask {
        if lanes == 0 {
            return 0;
        }
        self.workspace.rays.shadow += u64::from(lanes.count_ones());
        self.tracer.any_hit(&mut self.workspace.search, rays, lanes)
    }

    /// Samples a light without a shape; returns the lanes that it reaches.
    #[inline(always)]
    fn sample_light<S: Simd>(
        &mut self,
        simd: S,
        light: &Light,
        samples: &mut LightSamples,
    ) -> LaneMask {
        let Tracer { scene, errors } = *self.tracer;
        let Some(call) = scene.call(&light.instance, Method::Illumination, errors) else {
            return 0;
        };
        let v = variables();
        let reads_normals = call.touches(v.geometric_normal) || call.touches(v.shading_normal);
        self.set_points(simd, light, samples, reads_normals);
        let blocks = &mut self.workspace.light;
        blocks.call(&call, samples.lanes, None, self.context);
        let is_hidden = !scene.shader(&light.instance).program.has(Method::Emission);
        let offsets = self.context.offsets();
        let (lit, lost) = read_samples(simd, light, &blocks.state, samples, offsets, is_hidden);
        let reaching = samples.within_cones(simd, lit);
        self.context.leave_in_vectors(simd, &mut samples.rays, reaching);
        let reaching = reaching & !self.shadow(&samples.rays, reaching);
        call.report_not_finite(lost & reaching);
        self.context.take_not_finite(lost & reaching);
        reaching
    }

    /// Sets the inputs of `illumination`.
    #[inline(always)]
    fn set_points<S: Simd>(
        &mut self,
        simd: S,
        light: &Light,
        samples: &LightSamples,
        reads_normals: bool,
    ) {
        let v = variables();
        let state = &mut self.workspace.light.state;
        for eight in eights_alone(simd, samples.lanes) {
            let point = eight.point(&light.inverse, &eight.vectors(&samples.rays.origin));
            eight.store_vectors(state, v.hit_point, &point);
            eight.store(state, v.time_seed, eight.floats(&self.context.time));
            if reads_normals {
                let up = eight.splat_vector([0.0, 0.0, 1.0]);
                let [geometric, shading] =
                    samples.on_their_side(eight, self.context.seen_normals(eight));
                let geometric = eight.transposed_vector(&light.forward, &geometric);
                let shading = eight.transposed_vector(&light.forward, &shading);
                let geometric = eight.normalized_or(&geometric, &up);
                let shading = eight.normalized_or(&shading, &up);
                eight.store_vectors(state, v.geometric_normal, &geometric);
                eight.store_vectors(state, v.shading_normal, &shading);
            }
        }
    }
}

/// Transforms the samples of `illumination` to world space. Returns those that are not black, and those that are not
/// finite. The rays towards them end a little before them. Samples of a light that traced rays cannot find are
/// converted to those of a delta light: whole contributions, which materials do not weight against traced rays.
#[inline(always)]
fn read_samples<S: Simd>(
    simd: S,
    light: &Light,
    state: &LaneBlock,
    samples: &mut LightSamples,
    offsets: &Lanes,
    is_hidden: bool,
) -> (LaneMask, LaneMask) {
    let v = variables();
    let is_placed = !light.forward.is_identity();
    let (mut lit, mut lost) = (0, 0);
    for eight in eights_alone(simd, samples.lanes) {
        let mut direction = eight.load_vectors(state, v.light_direction);
        let mut distance = eight.load(state, v.light_distance);
        let mut color = eight.load_vectors(state, v.light_color);
        let mut density = eight.load(state, v.pdf);
        if is_placed {
            let world = eight.vector(&light.forward, &direction);
            let stretch2 = dots(&world, &world);
            color = scaled(&color, delta_scale(eight, stretch2, distance, density));
            distance *= stretch2.sqrt();
            direction = eight.normalized_or(&world, &direction);
        }
        // With a NaN density the sample is NaN, so that it is not mistaken for a delta.
        let nan = eight.splat_vector([f32::NAN; 3]);
        let mut color = select(density.simd_eq(density), &color, &nan);
        lit |= eight.lanes(is_lit(&color));
        if is_hidden {
            let divisor = density.simd_gt(0.0).select(density, eight.splat(1.0));
            color = scaled(&color, 1.0 / divisor);
            density = eight.splat(0.0);
        }
        lost |= eight.lanes(!(is_finite(&color) & is_finite(&direction)));
        eight.blend_vectors(&direction, &mut samples.rays.direction);
        let limit = distance_to_light(eight, distance, eight.floats(offsets));
        eight.blend(limit, &mut samples.rays.limit);
        eight.blend(distance, &mut samples.distance);
        eight.blend_vectors(&color, &mut samples.color);
        eight.blend(density, &mut samples.pdf);
    }
    (lit, lost)
}
