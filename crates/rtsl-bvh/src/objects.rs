//! The interface through which the traversal tests items, whose types it does not know.

use std::ops::Deref;

use fearless_simd::Simd;
use smallvec::SmallVec;

use super::bvh8::{Leaf, LeafHead};
use super::interleaved_traversal::MAX_INTERLEAVED;
use super::packet::{LaneMask, Lanes, lanes_of};
use super::ray_space::TraversalRay;
use super::space::PacketSpace;
use super::stream::{Pair, PairHit, RayStream};

/// Tests of single objects. A result must be a function of the ray and the object alone: the limit is the ray's own,
/// never the distance of an earlier hit. The order and the number of the tests therefore have no influence on the hit.
pub trait Objects {
    /// Tests the rays of `lanes` against the item of a leaf with this index; returns those that hit it.
    /// [`Objects::distance`] then returns the distances.
    fn packet<S: Simd>(
        &mut self,
        simd: S,
        space: &PacketSpace<'_>,
        leaf: &Leaf,
        index: usize,
        lanes: LaneMask,
    ) -> LaneMask;

    /// Returns the distances of the hits that [`Objects::packet`] found last.
    fn distance(&self) -> &Lanes;

    /// Loads the rays of a packet, in its [frame](super::RayFrame::Packet), before they are tested against leaves.
    fn load_packet<S: Simd>(&mut self, simd: S, space: &PacketSpace<'_>);

    /// Loads a ray [alone](super::RayFrame::Alone) before it is tested against leaves.
    fn load_ray(&mut self, ray: &TraversalRay);

    /// Prefetches the data for tests against a leaf.
    #[inline(always)]
    fn prefetch(&self, _head: &LeafHead) {}

    /// Tests rays of a stream against one object each, all of one class. Adds to `found` those that hit.
    fn pairs(&mut self, stream: &RayStream, class: u32, pairs: &[Pair], found: &mut Vec<PairHit>);

    /// Performs tests of loaded rays of one frame against leaves of one tree, at most one for each ray.
    fn leaves(&mut self, rays: &[LoadedRay], leaves: &[Leaf], tests: &mut [RayLeafTest]);

    /// Tests one loaded ray against the item of a leaf with this index.
    fn ray_against_one(&mut self, ray: &LoadedRay, leaf: &Leaf, index: usize) -> Option<f32>;

    /// Counts a test of the rays of `lanes` against the boxes of a node or leaf, for implementations that collect
    /// statistics.
    #[inline(always)]
    fn visited(&mut self, _lanes: LaneMask) {}
}

/// A test of one ray against all items of a leaf.
#[derive(Clone, Copy, Debug)]
pub struct RayLeafTest {
    /// The index of the ray.
    pub ray: u32,
    /// The index of the leaf.
    pub leaf: u32,
    /// The leaf's head.
    pub head: LeafHead,
    /// The result: the index of the closest hit, of equally close ones the lowest, or [`RayLeafTest::NO_ITEM`]. No
    /// option, because no processor can predict what a ray hits: neither setting nor reading it takes a branch.
    pub nearest: u32,
    /// The distance of that hit; arbitrary without one.
    pub distance: f32,
}

impl RayLeafTest {
    /// The index that stands for none.
    pub const NO_ITEM: u32 = u32::MAX;

    /// Returns a test of a ray against a leaf, both given by their index.
    #[inline(always)]
    pub fn new(ray: usize, leaf: usize, head: LeafHead) -> RayLeafTest {
        let (ray, leaf) = (ray as u32, leaf as u32);
        RayLeafTest { ray, leaf, head, nearest: RayLeafTest::NO_ITEM, distance: 0.0 }
    }
}

/// A ray that objects have loaded in its frame. Only such rays can be tested against leaves.
#[derive(Clone, Copy, Debug)]
pub struct LoadedRay(TraversalRay);

impl Deref for LoadedRay {
    type Target = TraversalRay;

    #[inline(always)]
    fn deref(&self) -> &TraversalRay {
        &self.0
    }
}

impl LoadedRay {
    /// Loads a packet and adds the rays of some lanes to `rays`. These take two kilobytes, which are not worth moving.
    #[inline(always)]
    pub(super) fn add_of_packet<S: Simd>(
        rays: &mut SmallVec<[LoadedRay; MAX_INTERLEAVED]>,
        simd: S,
        objects: &mut impl Objects,
        space: &PacketSpace<'_>,
        lanes: LaneMask,
    ) {
        objects.load_packet(simd, space);
        for lane in lanes_of(lanes) {
            rays.push(LoadedRay(space.ray(lane)));
        }
    }

    /// Loads a ray that is alone in its space.
    pub(super) fn alone(objects: &mut impl Objects, ray: TraversalRay) -> LoadedRay {
        objects.load_ray(&ray);
        LoadedRay(ray)
    }
}
