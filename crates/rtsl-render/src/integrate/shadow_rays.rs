//! Shadow rays, and the contributions of unoccluded light samples.

use rtsl_bvh::{LANES, LaneMask, RAYS_OF_STREAM, RayPacket, Search, lanes_of};

use super::memory::ThreadMemory;
use super::searcher::Searcher;
use super::wavefront::Path;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
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
    /// The lane of the path.
    pub path: u32,
    /// The key of the path's random sequence.
    pub key: u32,
    /// The sample index of the path.
    pub sample: u32,
}

impl ShadowRay {
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

/// Shadow rays that wait for being traced, component by component.
#[derive(Clone, Debug, Default)]
pub struct ShadowRays {
    /// Origin, direction and length.
    pub ends: [Vec<f32>; 7],
    /// The contributions.
    pub colors: [Vec<f32>; 3],
    /// The times within the shutter.
    pub times: Vec<f32>,
    /// The lanes of the paths.
    pub paths: Vec<u32>,
    /// The keys and the sample indices of the paths; arbitrary without alpha textures, which need them.
    pub sequences: Vec<[u32; 2]>,
}

impl ShadowRays {
    /// Adds a ray.
    pub fn push(&mut self, ray: &ShadowRay) {
        let ShadowRay { origin, direction, distance, time, color, path, key, sample } = *ray;
        let ends = origin.into_iter().chain(direction).chain([distance]);
        self.ends.iter_mut().zip(ends).for_each(|(column, value)| column.push(value));
        self.colors.iter_mut().zip(color).for_each(|(column, value)| column.push(value));
        self.times.push(time);
        self.paths.push(path);
        self.sequences.push([key, sample]);
    }

    /// Returns the columns of origins, directions, lengths and contributions.
    pub fn columns_mut(&mut self) -> impl Iterator<Item = &mut Vec<f32>> {
        self.ends.iter_mut().chain(&mut self.colors)
    }

    /// Returns the number of rays.
    pub fn len(&self) -> usize {
        self.paths.len()
    }

    /// Removes all rays.
    pub fn clear(&mut self) {
        self.ends.iter_mut().chain(&mut self.colors).for_each(Vec::clear);
        self.times.clear();
        self.paths.clear();
        self.sequences.clear();
    }

    /// Returns a ray.
    pub fn ray(&self, index: usize) -> ShadowRay {
        let [key, sample] = self.sequences[index];
        ShadowRay {
            origin: self.origin(index),
            direction: self.direction(index),
            distance: self.ends[6][index],
            time: self.times[index],
            color: self.color(index),
            path: self.paths[index],
            key,
            sample,
        }
    }

    /// Returns the contribution of a ray.
    pub fn color(&self, index: usize) -> [f32; 3] {
        [0, 1, 2].map(|channel: usize| self.colors[channel][index])
    }

    /// Returns the origin of a ray.
    pub fn origin(&self, index: usize) -> [f32; 3] {
        [0, 1, 2].map(|axis: usize| self.ends[axis][index])
    }

    /// Returns the direction of a ray.
    pub fn direction(&self, index: usize) -> [f32; 3] {
        [3, 4, 5].map(|axis: usize| self.ends[axis][index])
    }

    /// Copies the rays from `start` on to a packet; returns their lanes.
    fn load(&self, start: usize, epsilon: f32, packet: &mut RayPacket) -> LaneMask {
        let count = (self.len() - start).min(LANES);
        let RayPacket { origin, direction, epsilon: epsilons, limit, time } = packet;
        let ends = origin.iter_mut().chain(direction).chain([limit]);
        for (lanes, column) in ends.zip(&self.ends) {
            lanes[..count].copy_from_slice(&column[start..start + count]);
        }
        time[..count].copy_from_slice(&self.times[start..start + count]);
        epsilons.fill(epsilon);
        LaneMask::MAX >> (LANES - count)
    }

    /// Traces the rays, and returns in `reached` the indices of those that nothing blocks, in order.
    pub fn trace(&self, tracer: &Tracer<'_>, searcher: &mut Searcher, reached: &mut Vec<u32>) {
        if tracer.scene.geometry.suits_stream(self.len()) {
            self.trace_with_streams(tracer, searcher, reached);
        } else {
            self.trace_with_packets(tracer, searcher, reached);
        }
    }

    fn trace_with_streams(
        &self,
        tracer: &Tracer<'_>,
        searcher: &mut Searcher,
        reached: &mut Vec<u32>,
    ) {
        let Searcher { memory, stream, .. } = searcher;
        for start in (0..self.len()).step_by(RAYS_OF_STREAM) {
            let end = self.len().min(start + RAYS_OF_STREAM);
            let [ends @ .., limits] = self.ends.each_ref().map(|column| &column[start..end]);
            stream.load(ends, |_| tracer.scene.epsilon, limits, &self.times[start..end]);
            tracer.search_stream(memory, stream, Search::Any);
            let free = (start..end).filter(|index| stream.hit(index - start).is_none());
            reached.extend(free.map(|index| index as u32));
        }
    }

    fn trace_with_packets(
        &self,
        tracer: &Tracer<'_>,
        searcher: &mut Searcher,
        reached: &mut Vec<u32>,
    ) {
        let Searcher { memory, packet, .. } = searcher;
        for start in (0..self.len()).step_by(LANES) {
            let lanes = self.load(start, tracer.scene.epsilon, packet);
            let occluded = tracer.any_hit(memory, packet, lanes);
            reached.extend(lanes_of(lanes & !occluded).map(|lane| (start + lane) as u32));
        }
    }
}

impl ThreadMemory {
    /// Traces the waiting shadow rays, and notes those that nothing blocks. The rays stay until someone clears them.
    pub fn trace_shadow_rays(&mut self, scene: &RenderScene, errors: &RuntimeErrors) {
        self.rays.shadow += self.shadow_rays.len() as u64;
        self.reached.clear();
        if scene.has_alpha() {
            self.trace_shadows_through_alpha(scene, errors);
        } else {
            let tracer = Tracer { scene: &scene.compiled, errors };
            let ThreadMemory { shadow_rays, reached, searcher, .. } = self;
            shadow_rays.trace(&tracer, searcher, reached);
        }
    }

    /// The same if alpha textures may let rays pass surfaces: the rays form another wavefront.
    fn trace_shadows_through_alpha(&mut self, scene: &RenderScene, errors: &RuntimeErrors) {
        let ThreadMemory { shadows, shadow_rays, reached, batch, searcher, .. } = self;
        let epsilon = scene.compiled.epsilon;
        let count = shadow_rays.len();
        shadows.paths.clear();
        shadows.paths.extend((0..count).map(|index| shadow_rays.ray(index).path_of(epsilon)));
        shadows.active.clear();
        shadows.active.extend(0..count as u32);
        searcher.are_together = false;
        searcher.find_hits(scene, errors, shadows, batch);
        reached.extend_from_slice(&shadows.left);
        // Passing surfaces changes the order, on which sums depend.
        reached.sort_unstable();
    }
}
