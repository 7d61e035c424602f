//! Counts the work of searches and shading. Searches that count are compiled separately, so that others have no
//! overhead.

use fearless_simd::Simd;
use rtsl_bvh::{
    LANES, LaneMask, Lanes, Leaf, LeafHead, LoadedRay, Objects, PacketSpace, Pair, PairHit,
    RayLeafTest, RayStream, TraversalRay, lanes_of,
};

use crate::statistics::LaneUse;

/// The counters.
#[derive(Clone, Debug)]
pub struct WorkCounts {
    /// For each lane, the number of nodes and leaves whose boxes were tested against its rays.
    pub visited: [u32; LANES],
    /// The use of the vector lanes in calls of `intersect` and `shade`.
    pub lane_use: LaneUse,
    /// The SIMD width in lanes.
    width: u32,
}

impl WorkCounts {
    /// Creates counters at zero, for vectors of `width` lanes.
    pub fn new(width: u32) -> Self {
        WorkCounts { visited: [0; LANES], lane_use: LaneUse::default(), width }
    }

    /// Counts a call for the rays of `lanes`.
    pub fn add_call(&mut self, lanes: LaneMask) {
        self.lane_use.add_call(lanes, self.width);
    }
}

/// Wraps objects and counts their visits and tests.
pub struct CountedObjects<'a, O> {
    objects: O,
    counts: &'a mut WorkCounts,
}

impl<'a, O: Objects> CountedObjects<'a, O> {
    /// Wraps `objects`.
    pub fn new(objects: O, counts: &'a mut WorkCounts) -> Self {
        CountedObjects { objects, counts }
    }
}

impl<O: Objects> Objects for CountedObjects<'_, O> {
    fn packet<S: Simd>(
        &mut self,
        simd: S,
        space: &PacketSpace<'_>,
        leaf: &Leaf,
        index: usize,
        lanes: LaneMask,
    ) -> LaneMask {
        self.counts.add_call(lanes);
        self.objects.packet(simd, space, leaf, index, lanes)
    }

    fn distance(&self) -> &Lanes {
        self.objects.distance()
    }

    fn load_packet<S: Simd>(&mut self, simd: S, space: &PacketSpace<'_>) {
        self.objects.load_packet(simd, space);
    }

    fn pairs(&mut self, stream: &RayStream, class: u32, pairs: &[Pair], found: &mut Vec<PairHit>) {
        for pairs in pairs.chunks(LANES) {
            self.counts.add_call(LaneMask::MAX >> (LANES - pairs.len()));
        }
        self.objects.pairs(stream, class, pairs, found);
    }

    fn load_ray(&mut self, ray: &TraversalRay) {
        self.objects.load_ray(ray);
    }

    fn leaves(&mut self, rays: &[LoadedRay], leaves: &[Leaf], tests: &mut [RayLeafTest]) {
        for RayLeafTest { head, .. } in &*tests {
            // The lanes of this call are the leaf's objects.
            self.counts.add_call((1 << head.count) - 1);
        }
        self.objects.leaves(rays, leaves, tests);
    }

    fn prefetch(&self, head: &LeafHead) {
        self.objects.prefetch(head);
    }

    fn visited(&mut self, lanes: LaneMask) {
        lanes_of(lanes).for_each(|lane| self.counts.visited[lane] += 1);
    }

    fn ray_against_one(&mut self, ray: &LoadedRay, leaf: &Leaf, index: usize) -> Option<f32> {
        self.counts.add_call(1);
        self.objects.ray_against_one(ray, leaf, index)
    }
}
