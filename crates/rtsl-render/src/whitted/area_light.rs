//! Area light sampling.
//!
//! The shape's `generateSample` selects a point and its density, in the shape's space. A ray is then traced from the
//! lit point towards it; if it hits the shape there, the contribution is the emission seen along this ray. An area
//! light therefore illuminates with the same emission that a traced ray of this direction sees, and one ray handles
//! occlusion, including that by the other side of the light itself.
//!
//! A transform with non-uniform scaling distorts solid angles; the density is converted by its Jacobian, so any
//! transform of a shape is supported. Emission may request random numbers, but no light.
//!
//! Each face of a mesh is a separate light, if the mesh has few faces. Meshes of many faces, shapes within the scene's
//! instances, and shapes without `generateSample` are visible but not sampled. Moving lights are sampled at the time of
//! the ray that requests light.

use fearless_simd::prelude::*;
use fearless_simd::{Level as SimdLevel, Simd, dispatch};
use rtsl::Method;
use rtsl_bvh::{Hits, LANES, LaneMask, Lanes, lanes_of};

use super::light_samples::LightSamples;
use super::surface::{hit_groups, prepare};
use super::workspace::{Level, Workspace};
use crate::compiled::area_light::AreaLight;
use crate::compiled::calls::CallBlocks;
use crate::compiled::tracer::Tracer;
use crate::compiled::variables::variables;
use crate::lanes::eight::{LaneVectors, difference, dots, eights_alone, is_lit, not_finite};
use crate::surfaces::{HitLanes, ObjectHit, SurfaceTransforms};
use crate::tiles::LaneContext;

/// The tolerance of the hit's distance from the sample, relative to its distance: rounding at silhouettes.
const TOLERANCE: f32 = 1e-3;

/// Samples one light. Returns the lanes that it reaches.
pub fn sample(
    tracer: &Tracer<'_>,
    workspace: &mut Workspace,
    context: &mut LaneContext,
    light: &AreaLight,
    samples: &mut LightSamples,
) -> LaneMask {
    let lamp = AreaLightSampler { tracer, light };
    dispatch!(SimdLevel::new(), simd => lamp.sample(simd, workspace, context, samples))
}

/// The object that is sampled, at the times of the lanes.
struct SampledObject {
    hit: ObjectHit,
    time: Lanes,
}

impl HitLanes for SampledObject {
    #[inline(always)]
    fn hit(&self, _: usize) -> ObjectHit {
        self.hit
    }

    #[inline(always)]
    fn time(&self, lane: usize) -> f32 {
        self.time[lane]
    }
}

/// An area light with the inputs for tracing its rays.
struct AreaLightSampler<'a> {
    tracer: &'a Tracer<'a>,
    light: &'a AreaLight,
}

impl AreaLightSampler<'_> {
    #[inline(always)]
    fn sample<S: Simd>(
        &self,
        simd: S,
        workspace: &mut Workspace,
        context: &mut LaneContext,
        samples: &mut LightSamples,
    ) -> LaneMask {
        let Some((usable, normals)) = self.generate(simd, &mut workspace.light, context, samples)
        else {
            return 0;
        };
        let reaching = samples.within_cones(simd, usable);
        if reaching == 0 {
            return 0;
        }
        workspace.rays.shadow += u64::from(reaching.count_ones());
        context.leave_surfaces(&mut samples.rays, reaching);
        let hits = self.tracer.nearest(&mut workspace.search, &samples.rays, reaching);
        let found = self.found(&hits, samples, context.offsets(), reaching);
        if found == 0 {
            return 0;
        }
        let (mut level, mut own) = (workspace.take_level(), workspace.take_spawned());
        let contexts = [context, &mut own.context];
        let lit = self.emission(simd, &mut level, contexts, &hits, found, &normals, samples);
        workspace.return_level(level);
        workspace.keep_spawned(own);
        lit
    }

    /// Calls `generateSample`: returns directions, distances and densities, and rays that end a little behind the
    /// samples. Also returns the valid samples and their normals in world space, which are zero if the class sets none;
    /// returns `None` if there is no such method.
    #[inline(always)]
    fn generate<S: Simd>(
        &self,
        simd: S,
        blocks: &mut CallBlocks,
        context: &mut LaneContext,
        samples: &mut LightSamples,
    ) -> Option<(LaneMask, LaneVectors)> {
        let AreaLightSampler { tracer, light } = *self;
        let call = tracer.scene.call(&light.primitive, Method::GenerateSample, tracer.errors)?;
        let placement = light.instance.and_then(|it| tracer.scene.placement(it));
        let hit = ObjectHit { object: light.object, element: 0, instance: light.instance };
        let transforms = SurfaceTransforms::of_object(tracer.scene, hit, false);
        let lanes = SampledObject { hit, time: context.time };
        let v = variables();
        for eight in eights_alone(simd, samples.lanes) {
            let origin = eight.vectors(&samples.rays.origin);
            let origin = transforms.local_points(eight, &lanes, &origin);
            eight.store_vectors(&mut blocks.state, v.ray_origin, &origin);
            eight.store(&mut blocks.state, v.epsilon, eight.splat(tracer.scene.epsilon));
            eight.store(&mut blocks.state, v.time_seed, eight.floats(&context.time));
        }
        blocks.clear_scratch(call.scratch_arrays);
        blocks.call(&call, samples.lanes, None, context);
        let state = &blocks.state;
        let mut normals = [[0.0; LANES]; 3];
        let mut local_squares = [0.0; LANES];
        for eight in eights_alone(simd, samples.lanes) {
            let local = eight.load_vectors(state, v.hit_point);
            let local_way = difference(&local, &eight.load_vectors(state, v.ray_origin));
            let point = transforms.points(eight, &lanes, &local);
            let normal = eight.load_vectors(state, v.geometric_normal);
            let [normal] = transforms.normals(eight, &lanes, [normal]);
            eight.blend_vectors(&normal, &mut normals);
            let way = difference(&point, &eight.vectors(&samples.rays.origin));
            let distance = dots(&way, &way).sqrt();
            let nowhere = eight.splat_vector([0.0; 3]);
            eight.blend_vectors(&eight.normalized_or(&way, &nowhere), &mut samples.rays.direction);
            eight.blend(distance, &mut samples.distance);
            let offset = eight.floats(context.offsets());
            eight.blend(distance * (1.0 + TOLERANCE) + offset, &mut samples.rays.limit);
            eight.blend(dots(&local_way, &local_way), &mut local_squares);
        }
        let density = state.floats(v.pdf);
        let mut usable = 0;
        for lane in lanes_of(samples.lanes) {
            let distance = samples.distance[lane];
            let placed = placement.as_ref();
            let volume = placed.map_or(1.0, |placement| placement.volume_scale(context.time[lane]));
            let scale = light.density_scale(distance, local_squares[lane].sqrt()) / volume;
            let pdf = (f64::from(density[lane]) * scale) as f32;
            samples.pdf[lane] = pdf;
            let is_usable = pdf > 0.0 && pdf.is_finite() && distance > 0.0 && distance.is_finite();
            usable |= LaneMask::from(is_usable) << lane;
        }
        Some((usable, normals))
    }

    /// Returns the lanes whose rays hit the light itself at the sample's distance.
    fn found(
        &self,
        hits: &Hits,
        samples: &LightSamples,
        offsets: &Lanes,
        lanes: LaneMask,
    ) -> LaneMask {
        let is_found = |lane: &usize| {
            let least = samples.distance[*lane] * (1.0 - TOLERANCE) - offsets[*lane];
            hits.id[*lane] == self.light.id && hits.distance[*lane] >= least
        };
        lanes_of(lanes).filter(is_found).fold(0, |found, lane| found | 1 << lane)
    }

    /// Calls `emission` for rays that hit the light; returns the lanes that are lit.
    #[expect(clippy::too_many_arguments, reason = "what is known of the samples so far")]
    #[inline(always)]
    fn emission<S: Simd>(
        &self,
        simd: S,
        level: &mut Level,
        [context, own]: [&mut LaneContext; 2],
        hits: &Hits,
        found: LaneMask,
        normals: &LaneVectors,
        samples: &mut LightSamples,
    ) -> LaneMask {
        let Tracer { scene, errors } = *self.tracer;
        let emitter = &scene.materials[self.light.emitter as usize];
        let Some(call) = scene.call(emitter, Method::Emission, errors) else { return 0 };
        // The light's surface has separate normals; its random numbers are those of the rays.
        own.begin_beside(context);
        for group in &hit_groups(scene, hits, found) {
            prepare(self.tracer, group, &samples.rays, hits, level, own);
        }
        level.blocks.clear_scratch(call.scratch_arrays);
        level.blocks.call(&call, found, None, own);
        let mut lit = 0;
        for eight in eights_alone(simd, found) {
            let color = eight.load_vectors(&level.blocks.state, variables().emission_color);
            eight.blend_vectors(&color, &mut samples.color);
            // Checks that rays hit the side that was sampled: for a thin light, both are within the tolerance.
            let direction = eight.vectors(&samples.rays.direction);
            let sampled = dots(&eight.vectors(normals), &direction);
            let seen = dots(&own.geometric_normals(eight), &direction);
            lit |= eight.lanes(is_lit(&color) & (sampled * seen).simd_ge(0.0));
        }
        context.streams.clone_from(&own.streams);
        let lost = not_finite(&samples.color, lit);
        call.report_not_finite(lost);
        context.take_not_finite(lost);
        lit
    }
}
