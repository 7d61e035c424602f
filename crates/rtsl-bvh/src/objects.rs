//! What the traversal asks of those who know what the items are.

use fearless_simd::Simd;

use super::bvh8::{Leaf, LeafHead};
use super::packet::{LaneMask, Lanes};
use super::ray_space::TraversalRay;
use super::space::PacketSpace;
use super::stream::{Pair, PairHit, RayStream};

/// Tests single objects. What they answer must be a function of the ray and the object alone: the
/// limit that counts is the ray's own, never that of a hit found before. So it does not matter in
/// which order, and how often, objects are asked.
pub trait Objects {
    /// Tests the rays of `lanes` against the `index`th item of a block; returns those that hit it.
    /// [`Objects::distance`] then has where.
    fn packet<S: Simd>(
        &mut self,
        simd: S,
        space: &PacketSpace<'_>,
        block: &Leaf,
        index: usize,
        lanes: LaneMask,
    ) -> LaneMask;

    /// The parameters of the hits that [`Objects::packet`] found last.
    fn distance(&self) -> &Lanes;

    /// Is told that rays of a packet, in its [company](super::RayFrame::Packet), are going to be tested against
    /// blocks.
    fn load_packet<S: Simd>(&mut self, simd: S, space: &PacketSpace<'_>);

    /// Is told that a ray that is [alone](super::RayFrame::Alone) is going to be tested against blocks.
    fn load_ray(&mut self, ray: &TraversalRay);

    /// Is told which block will soon be asked about, so that it can be fetched from memory by then.
    #[inline(always)]
    fn prefetch(&self, _head: &LeafHead) {}

    /// Tests rays of a stream, each against an object of one class. Adds to `found` those that hit.
    fn pairs(&mut self, stream: &RayStream, class: u32, pairs: &[Pair], found: &mut Vec<PairHit>);

    /// Makes tests of loaded rays of one company, at most one of each.
    fn blocks(&mut self, tests: &mut [BlockTest<'_>]);

    /// Tests one loaded ray against the `index`th item of a block.
    fn ray_against_one(&mut self, ray: &TraversalRay, block: &Leaf, index: usize) -> Option<f32>;

    /// Is told that the rays of `lanes` are tested against the boxes of a node or of a block. For
    /// those who count.
    #[inline(always)]
    fn visited(&mut self, _lanes: LaneMask) {}
}

/// A test of one ray against all items of a block.
#[derive(Clone, Copy, Debug)]
pub struct BlockTest<'a> {
    /// The ray.
    pub ray: &'a TraversalRay,
    /// What need not be read from the block.
    pub head: LeafHead,
    /// The block.
    pub block: &'a Leaf,
    /// What is found: the index of the nearest hit, of equally near ones the lowest, and where it is.
    pub nearest: Option<(usize, f32)>,
}
