//! Searches for hits.

use rtsl_bvh::{Hits, LaneMask, RayPacket, RayStream, Search, TraversalStack};

use super::compiled_scene::CompiledScene;
use super::intersection::{IntersectionBlocks, Intersector};
use super::runtime_errors::RuntimeErrors;
use super::work_counts::{CountedObjects, WorkCounts};

/// The inputs of searches.
pub struct Tracer<'a> {
    /// The scene.
    pub scene: &'a CompiledScene,
    /// The record of runtime errors.
    pub errors: &'a RuntimeErrors,
}

impl Tracer<'_> {
    /// Finds the closest hits.
    pub fn nearest(&self, memory: &mut SearchMemory, rays: &RayPacket, lanes: LaneMask) -> Hits {
        let SearchMemory { intersection, visits, counts } = memory;
        let mut intersector = Intersector::new(self.scene, intersection, self.errors);
        let geometry = &self.scene.geometry;
        match counts {
            None => geometry.nearest(rays, lanes, &mut intersector, visits),
            Some(counts) => {
                let mut counted = CountedObjects::new(intersector, counts);
                geometry.nearest(rays, lanes, &mut counted, visits)
            }
        }
    }

    /// Finds the hits of a stream, in a scene without instances.
    pub fn search_stream(&self, memory: &mut SearchMemory, rays: &mut RayStream, search: Search) {
        let SearchMemory { intersection, visits, .. } = memory;
        let mut intersector = Intersector::new(self.scene, intersection, self.errors);
        self.scene.geometry.search_stream(rays, search, &mut intersector, visits);
    }

    /// Returns the lanes that hit anything before their limits.
    pub fn any_hit(
        &self,
        memory: &mut SearchMemory,
        rays: &RayPacket,
        lanes: LaneMask,
    ) -> LaneMask {
        let SearchMemory { intersection, visits, counts } = memory;
        let mut intersector = Intersector::new(self.scene, intersection, self.errors);
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
    /// For `intersect`, which spawns no rays.
    intersection: IntersectionBlocks,
    visits: TraversalStack,
    /// Counts of the work of searches and shading, if they are needed.
    pub counts: Option<WorkCounts>,
}

impl SearchMemory {
    /// Allocates the memory for a scene.
    pub fn new(scene: &CompiledScene) -> Self {
        SearchMemory {
            intersection: IntersectionBlocks::new(scene.scratch_arrays),
            visits: TraversalStack::default(),
            counts: None,
        }
    }
}
