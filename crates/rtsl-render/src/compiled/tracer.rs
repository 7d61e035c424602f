//! Searches for what rays hit.

use rtsl_bvh::{Hits, LaneMask, RayPacket, RayStream, Search, TraversalStack};

use super::compiled_scene::CompiledScene;
use super::intersection::{IntersectionBlocks, Intersector};
use super::runtime_errors::RuntimeErrors;
use super::work_counts::{CountedObjects, WorkCounts};

/// What rays are traced with.
pub struct Tracer<'a> {
    /// The scene.
    pub scene: &'a CompiledScene,
    /// Where problems go.
    pub problems: &'a RuntimeErrors,
}

impl Tracer<'_> {
    /// The nearest hits.
    pub fn nearest(&self, memory: &mut SearchMemory, rays: &RayPacket, lanes: LaneMask) -> Hits {
        let SearchMemory { intersection, visits, counts } = memory;
        let mut intersector = Intersector::new(self.scene, intersection, self.problems);
        let geometry = &self.scene.geometry;
        match counts {
            None => geometry.nearest(rays, lanes, &mut intersector, visits),
            Some(counts) => {
                let mut counted = CountedObjects::new(intersector, counts);
                geometry.nearest(rays, lanes, &mut counted, visits)
            }
        }
    }

    /// The hits of a stream, where there are no instances.
    pub fn search_stream(&self, memory: &mut SearchMemory, rays: &mut RayStream, search: Search) {
        let SearchMemory { intersection, visits, .. } = memory;
        let mut intersector = Intersector::new(self.scene, intersection, self.problems);
        self.scene.geometry.search_stream(rays, search, &mut intersector, visits);
    }

    /// The lanes that hit anything before their limits.
    pub fn any_hit(
        &self,
        memory: &mut SearchMemory,
        rays: &RayPacket,
        lanes: LaneMask,
    ) -> LaneMask {
        let SearchMemory { intersection, visits, counts } = memory;
        let mut intersector = Intersector::new(self.scene, intersection, self.problems);
        let geometry = &self.scene.geometry;
        match counts {
            None => geometry.any(rays, lanes, &mut intersector, visits),
            Some(counts) => {
                geometry.any(rays, lanes, &mut CountedObjects::new(intersector, counts), visits)
            }
        }
    }
}

/// The memory of one thread for searches.
pub struct SearchMemory {
    /// For `intersect`, which spawns nothing.
    intersection: IntersectionBlocks,
    visits: TraversalStack,
    /// What searches and shading do, while somebody wants to know.
    pub counts: Option<WorkCounts>,
}

impl SearchMemory {
    /// For searches in a scene.
    pub fn new(scene: &CompiledScene) -> Self {
        SearchMemory {
            intersection: IntersectionBlocks::new(scene.scratch_arrays),
            visits: TraversalStack::default(),
            counts: None,
        }
    }
}
