//! What the traversal asks of those who know what the items are.

use fearless_simd::Simd;

use super::packet::{LaneMask, Lanes};
use super::ray_space::RaySpace;
use super::space::PacketSpace;
use super::wide_tree::{Block, BlockHead};

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
        block: &Block,
        index: usize,
        lanes: LaneMask,
    ) -> LaneMask;

    /// The parameters of the hits that [`Objects::packet`] found last.
    fn distance(&self) -> &Lanes;

    /// Tests one ray against all items of a block: the index of the nearest hit, of equally near ones
    /// the lowest, and where it is. What `head` says need not be read from `block`.
    fn ray(&mut self, space: &RaySpace, head: &BlockHead, block: &Block) -> Option<(usize, f32)>;

    /// Is told that the rays of `lanes` are tested against the boxes of a node or of a block. For
    /// those who count.
    #[inline(always)]
    fn visited(&mut self, _lanes: LaneMask) {}

    /// Tests one ray against the `index`th item of a block.
    fn ray_against_one(&mut self, space: &RaySpace, block: &Block, index: usize) -> Option<f32>;
}
