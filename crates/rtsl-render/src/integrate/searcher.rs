//! Searches for the hits of a wavefront.

use rtsl_bvh::{HitId, LANES, LaneMask, RAYS_OF_STREAM, RayPacket, RayStream, Search, lanes_of};

use super::shading_batch::ShadingBatch;
use super::wavefront::{NO_INSTANCE, PathHit, Wavefront};
use crate::compiled::compiled_scene::CompiledScene;
use crate::compiled::placed_objects::HitObject;
use crate::compiled::render_scene::RenderScene;
use crate::compiled::runtime_errors::RuntimeErrors;
use crate::compiled::tracer::{SearchMemory, Tracer};

/// The state of searches besides the rays.
pub struct Searcher {
    /// The memory of searches.
    pub memory: SearchMemory,
    /// A packet of rays.
    pub packet: Box<RayPacket>,
    /// A stream of incoherent rays.
    pub stream: RayStream,
    /// True if rays of adjacent lanes are coherent.
    pub are_together: bool,
}

impl Searcher {
    /// Creates the state for a scene.
    pub fn new(scene: &RenderScene) -> Self {
        Searcher {
            memory: SearchMemory::new(&scene.compiled),
            packet: Box::default(),
            stream: RayStream::default(),
            are_together: false,
        }
    }

    /// Finds the hits of a wavefront's active rays. Each becomes a hit or leaves the scene; none is active afterwards.
    pub fn find_hits(
        &mut self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        wavefront: &mut Wavefront,
        batch: &mut ShadingBatch,
    ) {
        let tracer = Tracer { scene: &scene.compiled, errors };
        wavefront.hits.clear();
        wavefront.left.clear();
        self.search_active(&tracer, wavefront);
        if scene.has_alpha() {
            self.pass_transparent(scene, errors, wavefront, batch);
        }
    }

    /// Continues the rays of a wavefront's hits behind surfaces that they pass, until all have hit one that they do not
    /// pass, or have left the scene.
    pub fn pass_transparent(
        &mut self,
        scene: &RenderScene,
        errors: &RuntimeErrors,
        wavefront: &mut Wavefront,
        batch: &mut ShadingBatch,
    ) {
        let tracer = Tracer { scene: &scene.compiled, errors };
        let mut known = 0;
        loop {
            wavefront.pass_transparent_hits(scene, errors, known, batch);
            if wavefront.active.is_empty() {
                return;
            }
            known = wavefront.hits.len();
            self.search_active(&tracer, wavefront);
        }
    }

    /// Finds the closest hits of the active rays, of which none is active then.
    fn search_active(&mut self, tracer: &Tracer<'_>, wavefront: &mut Wavefront) {
        let geometry = &tracer.scene.geometry;
        if !self.are_together && geometry.suits_stream(wavefront.active.len()) {
            self.search_with_streams(tracer, wavefront);
        } else {
            self.search_with_packets(tracer, wavefront);
        }
        wavefront.active.clear();
    }

    /// Finds the closest hits of the active rays in packets.
    fn search_with_packets(&mut self, tracer: &Tracer<'_>, wavefront: &mut Wavefront) {
        let Searcher { memory, packet, .. } = self;
        for start in (0..wavefront.active.len()).step_by(LANES) {
            let count = (wavefront.active.len() - start).min(LANES);
            for lane in 0..count {
                let path = &wavefront.paths[wavefront.active[start + lane] as usize];
                packet.set(lane, path.origin, path.direction);
                packet.epsilon[lane] = path.epsilon;
                packet.limit[lane] = path.distance;
                packet.time[lane] = path.time;
            }
            let lanes = LaneMask::MAX >> (LANES - count);
            let found = tracer.nearest(memory, packet, lanes);
            let hit = found.lanes(lanes);
            wavefront
                .left
                .extend(lanes_of(lanes & !hit).map(|lane| wavefront.active[start + lane]));
            for lane in lanes_of(hit) {
                let path = wavefront.active[start + lane];
                wavefront.add_hit(tracer.scene, path, found.distance[lane], found.id[lane]);
            }
        }
    }

    /// Finds them in streams.
    fn search_with_streams(&mut self, tracer: &Tracer<'_>, wavefront: &mut Wavefront) {
        let Searcher { memory, stream, .. } = self;
        for start in (0..wavefront.active.len()).step_by(RAYS_OF_STREAM) {
            let end = (start + RAYS_OF_STREAM).min(wavefront.active.len());
            stream.clear();
            for index in &wavefront.active[start..end] {
                let path = &wavefront.paths[*index as usize];
                let limits = (path.epsilon, path.distance);
                stream.push(path.origin, path.direction, limits, path.time);
            }
            tracer.search_stream(memory, stream, Search::Closest);
            for place in 0..end - start {
                let path = wavefront.active[start + place];
                match stream.hit(place) {
                    Some((distance, id)) => wavefront.add_hit(tracer.scene, path, distance, id),
                    None => wavefront.left.push(path),
                }
            }
        }
    }
}

impl Wavefront {
    /// Adds the hit of a path's ray.
    #[inline(always)]
    fn add_hit(&mut self, scene: &CompiledScene, path: u32, distance: f32, id: HitId) {
        self.paths[path as usize].distance = distance;
        let Some(hit) = HitObject::of(&scene.geometry, &scene.items, id) else { return };
        let object = hit.member.object;
        let instance = hit.instance.unwrap_or(NO_INSTANCE);
        self.hits.push(PathHit { path, object, element: hit.element, instance });
    }
}
