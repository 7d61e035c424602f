//! Shadow rays, and the contributions of unoccluded light samples.

use rtsl_bvh::{LANES, LaneMask, RAYS_OF_STREAM, RayPacket, Search, lanes_of};

use super::searcher::Searcher;
use super::wavefront::Path;
use crate::compiled::tracer::Tracer;

/// A shadow ray.
#[derive(Clone, Copy, Debug)]
pub struct ShadowRay {
    /// The origin.
    pub origin: [f32; 3],
    /// Its direction, of unit length.
    pub direction: [f32; 3],
    /// The length.
    pub distance: f32,
    /// The time within the shutter.
    pub time: f32,
    /// The contribution if it is not occluded.
    pub color: [f32; 3],
    /// The index of the path.
    pub path: u32,
    /// The key of the path's random sequence.
    pub key: u32,
    /// The sample index of the path.
    pub sample: u32,
}

impl ShadowRay {
    /// Adds the contribution to its path.
    #[inline(always)]
    pub fn add_to(&self, paths: &mut [Path]) {
        let radiance = &mut paths[self.path as usize].radiance;
        (0..3).for_each(|channel| radiance[channel] += self.color[channel]);
    }

    /// Returns the ray as a path.
    pub fn path_of(&self, epsilon: f32) -> Path {
        Path {
            origin: self.origin,
            epsilon,
            direction: self.direction,
            distance: self.distance,
            limit: self.distance,
            time: self.time,
            key: self.key,
            sample: self.sample,
            ..Path::NOWHERE
        }
    }
}

/// Traces shadow rays, and calls `reached` with each that nothing blocks, in order.
pub fn trace_shadow_rays(
    tracer: &Tracer<'_>,
    shadow_rays: &[ShadowRay],
    searcher: &mut Searcher,
    reached: &mut dyn FnMut(&ShadowRay),
) {
    if tracer.scene.geometry.suits_stream(shadow_rays.len()) {
        trace_with_streams(tracer, shadow_rays, searcher, reached);
    } else {
        trace_with_packets(tracer, shadow_rays, searcher, reached);
    }
}

fn trace_with_streams(
    tracer: &Tracer<'_>,
    shadow_rays: &[ShadowRay],
    searcher: &mut Searcher,
    reached: &mut dyn FnMut(&ShadowRay),
) {
    let Searcher { memory, stream, .. } = searcher;
    for shadow_rays in shadow_rays.chunks(RAYS_OF_STREAM) {
        stream.clear();
        for ray in shadow_rays {
            let limits = (tracer.scene.epsilon, ray.distance);
            stream.push(ray.origin, ray.direction, limits, ray.time);
        }
        tracer.search_stream(memory, stream, Search::Any);
        for (place, ray) in shadow_rays.iter().enumerate() {
            if stream.hit(place).is_none() {
                reached(ray);
            }
        }
    }
}

fn trace_with_packets(
    tracer: &Tracer<'_>,
    shadow_rays: &[ShadowRay],
    searcher: &mut Searcher,
    reached: &mut dyn FnMut(&ShadowRay),
) {
    let Searcher { memory, packet, .. } = searcher;
    for shadow_rays in shadow_rays.chunks(LANES) {
        fill(packet, shadow_rays, tracer.scene.epsilon);
        let lanes = LaneMask::MAX >> (LANES - shadow_rays.len());
        let occluded = tracer.any_hit(memory, packet, lanes);
        for lane in lanes_of(lanes & !occluded) {
            reached(&shadow_rays[lane]);
        }
    }
}

fn fill(packet: &mut RayPacket, shadow_rays: &[ShadowRay], epsilon: f32) {
    for (lane, ray) in shadow_rays.iter().enumerate().take(LANES) {
        packet.set(lane, ray.origin, ray.direction);
        packet.epsilon[lane] = epsilon;
        packet.limit[lane] = ray.distance;
        packet.time[lane] = ray.time;
    }
}
