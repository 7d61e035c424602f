//! Objects that count visits and tests.

use fearless_simd::Simd;
use rtsl_bvh::{
    LaneMask, Lanes, Leaf, LeafHead, LoadedRay, Objects, PacketSpace, Pair, PairHit, RayLeafTest,
    RayStream, TraversalRay,
};

/// The counts.
#[derive(Default)]
pub struct Counts {
    /// The visits of nodes and leaves.
    pub visits: u64,
    /// The sum of the rays of all visits.
    pub rays_of_visits: u64,
    /// The vectors of tests.
    pub tests: u64,
    /// The sum of the lanes in use in these.
    pub lanes_of_tests: u64,
}

/// Objects that are counted.
pub struct Counted<'a, O> {
    objects: O,
    counts: &'a mut Counts,
}

impl<'a, O: Objects> Counted<'a, O> {
    /// Wraps `objects`.
    pub fn new(objects: O, counts: &'a mut Counts) -> Self {
        Counted { objects, counts }
    }

    fn add_test(&mut self, lanes: LaneMask) {
        let vectors = (0..8).filter(|vector| lanes >> (8 * vector) & 0xFF != 0).count();
        self.counts.tests += vectors as u64;
        self.counts.lanes_of_tests += u64::from(lanes.count_ones());
    }
}

impl<O: Objects> Objects for Counted<'_, O> {
    fn packet<S: Simd>(
        &mut self,
        simd: S,
        space: &PacketSpace<'_>,
        leaf: &Leaf,
        index: usize,
        lanes: LaneMask,
    ) -> LaneMask {
        self.add_test(lanes);
        self.objects.packet(simd, space, leaf, index, lanes)
    }

    fn distance(&self) -> &Lanes {
        self.objects.distance()
    }

    fn load_packet<S: Simd>(&mut self, simd: S, space: &PacketSpace<'_>) {
        self.objects.load_packet(simd, space);
    }

    fn load_ray(&mut self, ray: &TraversalRay) {
        self.objects.load_ray(ray);
    }

    fn prefetch(&self, head: &LeafHead) {
        self.objects.prefetch(head);
    }

    fn pairs(&mut self, stream: &RayStream, class: u32, pairs: &[Pair], found: &mut Vec<PairHit>) {
        pairs.chunks(8).for_each(|pairs| self.add_test((1 << pairs.len()) - 1));
        self.objects.pairs(stream, class, pairs, found);
    }

    fn leaves(&mut self, rays: &[LoadedRay], leaves: &[Leaf], tests: &mut [RayLeafTest]) {
        tests.iter().for_each(|test| self.add_test((1 << test.head.count) - 1));
        self.objects.leaves(rays, leaves, tests);
    }

    fn ray_against_one(&mut self, ray: &LoadedRay, leaf: &Leaf, index: usize) -> Option<f32> {
        self.objects.ray_against_one(ray, leaf, index)
    }

    fn visited(&mut self, lanes: LaneMask) {
        self.counts.visits += 1;
        self.counts.rays_of_visits += u64::from(lanes.count_ones());
    }
}
