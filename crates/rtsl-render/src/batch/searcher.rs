//! What rays of a wave hit.

use rtsl_bvh::{HitId, LANES, LaneMask, RAYS_OF_STREAM, RayPacket, RayStream, Search, lanes_of};

use super::scene::BatchScene;
use super::shading_batch::ShadingBatch;
use super::tracer::PathTracer;
use super::wavefront::{NO_INSTANCE, PathHit, Wavefront};
use crate::compiled::placed_objects::HitObject;
use crate::compiled::tracer::{SearchMemory, Tracer};

/// What searches need besides the rays.
pub struct Searcher {
    /// The memory of searches.
    pub memory: SearchMemory,
    /// Rays that are searched for together.
    pub packet: Box<RayPacket>,
    /// The same where they go all ways.
    pub stream: RayStream,
    /// Whether rays of nearby lanes go nearly the same way.
    pub are_together: bool,
}

impl Searcher {
    /// For rays in a scene.
    pub fn new(scene: &BatchScene) -> Self {
        Searcher {
            memory: SearchMemory::new(&scene.compiled),
            packet: Box::default(),
            stream: RayStream::default(),
            are_together: false,
        }
    }
}

impl PathTracer<'_> {
    /// Finds what the active rays of a wave hit: their hits, and those that left the scene. None is active afterwards.
    pub fn find_hits(
        &self,
        wave: &mut Wavefront,
        searcher: &mut Searcher,
        chunk: &mut ShadingBatch,
    ) {
        wave.hits.clear();
        wave.left.clear();
        loop {
            let known = wave.hits.len();
            let geometry = &self.scene.compiled.geometry;
            if !searcher.are_together && geometry.suits_stream(wave.active.len()) {
                self.search_with_streams(wave, searcher);
            } else {
                self.search_with_packets(wave, searcher);
            }
            wave.active.clear();
            if !self.scene.has_cut_outs() {
                return;
            }
            self.pass_cut_outs(wave, known, chunk);
            if wave.active.is_empty() {
                return;
            }
        }
    }

    /// Searches for the nearest hits of the active rays, in packets.
    fn search_with_packets(&self, wave: &mut Wavefront, searcher: &mut Searcher) {
        let tracer = Tracer { scene: &self.scene.compiled, problems: self.problems };
        let Searcher { memory, packet, .. } = searcher;
        for start in (0..wave.active.len()).step_by(LANES) {
            let count = (wave.active.len() - start).min(LANES);
            for lane in 0..count {
                let path = &wave.paths[wave.active[start + lane] as usize];
                packet.set(lane, path.origin, path.direction);
                packet.epsilon[lane] = path.epsilon;
                packet.limit[lane] = path.distance;
                packet.time[lane] = path.time;
            }
            let lanes = LaneMask::MAX >> (LANES - count);
            let found = tracer.nearest(memory, packet, lanes);
            let hit = found.lanes(lanes);
            wave.left.extend(lanes_of(lanes & !hit).map(|lane| wave.active[start + lane]));
            for lane in lanes_of(hit) {
                let path = wave.active[start + lane];
                self.add_hit(wave, path, (found.distance[lane], found.id[lane]));
            }
        }
    }

    /// The same, in streams.
    fn search_with_streams(&self, wave: &mut Wavefront, searcher: &mut Searcher) {
        let tracer = Tracer { scene: &self.scene.compiled, problems: self.problems };
        let Searcher { memory, stream, .. } = searcher;
        for start in (0..wave.active.len()).step_by(RAYS_OF_STREAM) {
            let end = (start + RAYS_OF_STREAM).min(wave.active.len());
            stream.clear();
            for index in &wave.active[start..end] {
                let path = &wave.paths[*index as usize];
                let limits = (path.epsilon, path.distance);
                stream.push(path.origin, path.direction, limits, path.time);
            }
            tracer.search_stream(memory, stream, Search::Closest);
            for place in 0..end - start {
                let path = wave.active[start + place];
                match stream.hit(place) {
                    Some(hit) => self.add_hit(wave, path, hit),
                    None => wave.left.push(path),
                }
            }
        }
    }

    /// Notes what the ray of a path hit, and where.
    #[inline(always)]
    fn add_hit(&self, wave: &mut Wavefront, path: u32, (distance, id): (f32, HitId)) {
        wave.paths[path as usize].distance = distance;
        let scene = &self.scene.compiled;
        let Some(hit) = HitObject::of(&scene.geometry, &scene.items, id) else { return };
        let object = hit.member.object;
        let instance = hit.instance.unwrap_or(NO_INSTANCE);
        let group = self.scene.objects[object as usize].group;
        wave.hits.push((group, PathHit { path, object, element: hit.element, instance }));
    }
}
