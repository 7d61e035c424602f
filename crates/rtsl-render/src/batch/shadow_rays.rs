//! Rays towards samples of lights, and what those add if nothing lies between.

use crate::acceleration::{LANES, LaneMask, RayPacket, lanes_of};
use crate::compiled::tracer::Tracer;

use super::tracer::BatchMemory;
use super::wave::Path;

/// A ray towards a sample of a light.
#[derive(Clone, Copy, Debug)]
pub struct ShadowRay {
    /// Where it begins.
    pub origin: [f32; 3],
    /// Its direction, of unit length.
    pub direction: [f32; 3],
    /// Where it ends.
    pub distance: f32,
    /// The time within the shutter.
    pub time: f32,
    /// What it adds if it meets nothing.
    pub color: [f32; 3],
    /// To which path.
    pub path: u32,
    /// Which sequence of numbers the path has.
    pub key: u32,
    /// Which sample of its pixel the path is.
    pub sample: u32,
}

impl ShadowRay {
    /// Adds what it is for.
    #[inline(always)]
    pub fn add_to(&self, paths: &mut [Path]) {
        let radiance = &mut paths[self.path as usize].radiance;
        (0..3).for_each(|channel| radiance[channel] += self.color[channel]);
    }

    /// The same ray, as that of a path.
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

/// Traces the shadow rays of a wave and adds what they are for.
pub fn trace_shadow_rays(tracer: &Tracer<'_>, memory: &mut BatchMemory) {
    let BatchMemory { shadow_rays, search, wave, packet, .. } = memory;
    for shadow_rays in shadow_rays.chunks(LANES) {
        fill(packet, shadow_rays, tracer.scene.epsilon);
        let lanes = LaneMask::MAX >> (LANES - shadow_rays.len());
        let occluded = tracer.any_hit(search, packet, lanes);
        for lane in lanes_of(lanes & !occluded) {
            shadow_rays[lane].add_to(&mut wave.paths);
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
