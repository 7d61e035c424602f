//! Counts what searches and shading do, for those who ask where the time goes. Nobody who does not ask
//! pays: searches that count are code of their own.

use fearless_simd::Simd;
use rtsl_bvh::{
    BlockTest, LANES, LaneMask, Lanes, Leaf, LeafHead, Objects, PacketSpace, Pair, PairHit,
    RayStream, TraversalRay, lanes_of,
};

use crate::statistics::LaneUse;

/// What is counted.
#[derive(Clone, Debug)]
pub struct WorkCounts {
    /// For each lane, the nodes and blocks whose boxes were tested against its rays.
    pub visited: [u32; LANES],
    /// The lanes of the vectors that `intersect` and `shade` ran on.
    pub lane_use: LaneUse,
    /// Lanes of a vector.
    width: u32,
}

impl WorkCounts {
    /// Nothing so far, with vectors of `width` lanes.
    pub fn new(width: u32) -> Self {
        WorkCounts { visited: [0; LANES], lane_use: LaneUse::default(), width }
    }

    /// Counts a call for the rays of `lanes`.
    pub fn add_call(&mut self, lanes: LaneMask) {
        self.lane_use.add_call(lanes, self.width);
    }
}

/// Objects whose visits and tests are counted.
pub struct CountedObjects<'a, O> {
    objects: O,
    counts: &'a mut WorkCounts,
}

impl<'a, O: Objects> CountedObjects<'a, O> {
    /// Counts for `objects`.
    pub fn new(objects: O, counts: &'a mut WorkCounts) -> Self {
        CountedObjects { objects, counts }
    }
}

impl<O: Objects> Objects for CountedObjects<'_, O> {
    fn packet<S: Simd>(
        &mut self,
        simd: S,
        space: &PacketSpace<'_>,
        block: &Leaf,
        index: usize,
        lanes: LaneMask,
    ) -> LaneMask {
        self.counts.add_call(lanes);
        self.objects.packet(simd, space, block, index, lanes)
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

    fn blocks(&mut self, tests: &mut [BlockTest<'_>]) {
        for BlockTest { head, .. } in &*tests {
            // The lanes are the block's objects.
            self.counts.add_call((1 << head.count) - 1);
        }
        self.objects.blocks(tests);
    }

    fn prefetch(&self, head: &LeafHead) {
        self.objects.prefetch(head);
    }

    fn visited(&mut self, lanes: LaneMask) {
        lanes_of(lanes).for_each(|lane| self.counts.visited[lane] += 1);
    }

    fn ray_against_one(&mut self, space: &TraversalRay, block: &Leaf, index: usize) -> Option<f32> {
        self.counts.add_call(1);
        self.objects.ray_against_one(space, block, index)
    }
}
