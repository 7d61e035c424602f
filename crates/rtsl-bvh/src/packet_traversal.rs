//! Traversal by packets.
//!
//! A child is tested twice: with the interval of all rays when its node is visited, eight children at once, and ray by
//! ray when it is popped, against the hits found until then. The own box of an object is tested by the interval, and
//! then for the object's hits alone. If few rays remain active, they continue as single rays; at leaves, each is tested
//! against all objects at once.
//!
//! A test of a child against the intervals of all eight vectors of a packet's rays, before those of the rays, does not
//! pay: packets execute a tenth more instructions on ten thousand spheres.
//!
//! Nor does sorting the children of a node in a register, as single rays do: packets took 1.08 times as long on ten
//! thousand spheres (Zen 4).
//!
//! With AVX-512, sixteen rays are tested at once. Packets of which at most 16, 32 or 64 rays reach a child do not gain
//! from being split into 4 by 4 pixels that are tested against all eight children without a branch: camera rays took
//! 1.2 to 2.4 times as long (Zen 5).

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use rtsl_math::SIMD_LANES;
use rtsl_memory::prefetch;
use smallvec::SmallVec;

use super::bounds::Bounds;
use super::bvh8::{Bvh8, Child, INSTANCE, Leaf, Node8};
use super::geometry::Group;
use super::interleaved_traversal::MAX_INTERLEAVED;
use super::objects::{LoadedRay, Objects};
use super::packet::{LaneMask, Lanes, lanes_of};
use super::ray_space::TraversalRay;
use super::ray_traversal::RaysOuter;
use super::space::{PacketSpace, finite_lanes, greatest};
use super::traversal::{InstanceContext, PacketVisit, Search, Traversal};

/// If fewer rays than these reach a node, they continue as single rays. The speed hardly changes between half and four
/// times as many, nor does it help to collect such rays in order to interleave more of them, or to test up to 16 rays
/// of a packet each against all children of a node.
const MIN_AT_NODES: u32 = 6;

/// The same threshold for any-hit searches with a loose interval. In closest-hit searches such rays continue as single
/// rays from the root: each visits the closest nodes first.
const MIN_IF_LOOSE: u32 = 24;

/// If fewer rays than these reach a leaf, each is tested against all its objects by one call. Five camera rays of a
/// packet reach a leaf of a million triangles. With single traversal of fewer than 4 rays instead, they took 1.1 times
/// as long, and 1.05 times on ten thousand spheres (Zen 3, medians of three turns). 12 is as good as 8.
const MIN_AT_LEAVES: u32 = 8;

/// The same threshold for leaves of instances, each of which single rays enter alone.
const MIN_AT_INSTANCES: u32 = 4;

/// In trees with at most so many nodes, incoherent rays stay together for closest hits as well: single traversal would
/// cost more than it saves. A box with 17 surfaces renders in three quarters of the time.
pub(super) const MAX_NODES_FOR_PACKETS: usize = 4;

type PacketOuter<'a> = InstanceContext<'a, PacketSpace<'a>>;

/// A packet in a group.
struct PacketGroup<'a, 'p> {
    tree: &'a Bvh8,
    space: &'p PacketSpace<'p>,
    outer: Option<&'p PacketOuter<'p>>,
}

impl<'a, O: Objects> Traversal<'a, O> {
    /// Traverses a group with a packet.
    pub fn visit_group_with_packet<S: Simd>(
        &mut self,
        simd: S,
        group: &'a Group,
        space: &PacketSpace<'_>,
        lanes: LaneMask,
        outer: Option<&PacketOuter<'_>>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let group = PacketGroup { tree: &group.tree, space, outer };
                for leaf in group.tree.unbounded() {
                    self.visit_leaf_with_packet(simd, &group, leaf, Node8::ALL_ITEMS, lanes);
                }
                let Some(root) = group.tree.root else { return };
                self.visit_tree_with_packet(simd, &group, root, lanes);
            },
        );
    }

    /// Returns the number of rays below which they continue as single rays from a child.
    #[inline(always)]
    fn fewest(&self, group: &PacketGroup<'_, '_>, child: Child) -> u32 {
        let PacketGroup { tree, space, outer: _ } = group;
        if child.is_leaf() {
            let is_instance = tree.heads[child.index()].class == INSTANCE;
            return if is_instance { MIN_AT_INSTANCES } else { MIN_AT_LEAVES };
        }
        match (space.interval.is_loose(), self.search) {
            (false, Search::Closest | Search::Any) => MIN_AT_NODES,
            (true, Search::Any) => MIN_IF_LOOSE,
            (true, Search::Closest) if tree.nodes.len() <= MAX_NODES_FOR_PACKETS => MIN_IF_LOOSE,
            (true, Search::Closest) => u32::MAX,
        }
    }

    #[inline(always)]
    fn visit_tree_with_packet<S: Simd>(
        &mut self,
        simd: S,
        group: &PacketGroup<'a, '_>,
        root: Child,
        lanes: LaneMask,
    ) {
        let PacketGroup { tree, space, outer: _ } = *group;
        let base = self.visits.packets.len();
        // Incoherent rays often miss the whole tree.
        let lanes = match space.interval.is_loose() {
            true => space.test(simd, &tree.bounds, lanes, &self.hits.distance),
            false => lanes,
        };
        if lanes.count_ones() < self.fewest(group, root) {
            return self.visit_with_rays(simd, group, root, lanes);
        }
        self.visit_child_with_packet(simd, group, root, Node8::ALL_ITEMS, lanes);
        // Leaf children of one node may share a leaf, of which few lanes test all items at once.
        let mut tested = (Child::END, 0);
        while self.visits.packets.len() > base {
            let Some(visit) = self.visits.packets.pop() else { break };
            let lanes = self.open(visit.lanes);
            if lanes == 0 {
                continue;
            }
            let node = &tree.nodes[visit.node as usize];
            let slot = visit.child as usize % SIMD_LANES;
            let child = node.children[slot];
            let lanes =
                test_child(simd, &node.boxes.get(slot), child, space, lanes, &self.hits.distance);
            if lanes.count_ones() >= self.fewest(group, child) {
                self.visit_child_with_packet(simd, group, child, node.items[slot], lanes);
            } else if child.is_leaf() {
                let (last_leaf, lanes_of_last) = tested;
                let known = if last_leaf == child { lanes_of_last } else { 0 };
                self.visit_leaves_with_few(simd, group, child, lanes & !known);
                tested = (child, known | lanes);
            } else {
                self.visit_with_rays(simd, group, child, lanes);
            }
        }
    }

    /// Visits a node, or the given items of a leaf, with a packet.
    #[inline(always)]
    fn visit_child_with_packet<S: Simd>(
        &mut self,
        simd: S,
        group: &PacketGroup<'a, '_>,
        child: Child,
        items: u8,
        lanes: LaneMask,
    ) {
        if child.is_leaf() {
            for leaf in group.tree.leaf_run(child.index()) {
                self.visit_leaf_with_packet(simd, group, leaf, items, lanes);
            }
            return;
        }
        self.objects.visited(lanes);
        let node = &group.tree.nodes[child.index()];
        let farthest = self.farthest(simd, lanes);
        let (mut met, entries) =
            group.space.interval.test(simd, &node.boxes, node.count as usize, farthest);
        let entries = entries.to_array();
        let base = self.visits.packets.len();
        while met != 0 {
            let slot = met.trailing_zeros();
            met &= met - 1;
            self.fetch(group.tree, node.children[slot as usize % SIMD_LANES]);
            self.visits.packets.push(PacketVisit {
                node: child.index() as u32,
                child: slot,
                lanes,
            });
        }
        let entry = |visit: &PacketVisit| entries[visit.child as usize % SIMD_LANES];
        // The closest is last, to be visited first.
        insertion_sort(&mut self.visits.packets[base..], |one, other| entry(one) > entry(other));
    }

    /// Prefetches the data of a child.
    #[inline(always)]
    fn fetch(&self, tree: &Bvh8, child: Child) {
        if !child.is_leaf() {
            prefetch(&tree.nodes[child.index()]);
        } else {
            prefetch(&tree.leaves[child.index()]);
            self.objects.prefetch(&tree.heads[child.index()]);
        }
    }

    /// Continues the rays of a packet as single rays.
    #[inline(always)]
    fn visit_with_rays<S: Simd>(
        &mut self,
        simd: S,
        group: &PacketGroup<'a, '_>,
        child: Child,
        lanes: LaneMask,
    ) {
        if lanes == 0 {
            return;
        }
        let PacketGroup { tree, space, outer } = *group;
        let mut scene_rays = SmallVec::new();
        let outer = outer.map(|outer| outer.with_rays(&mut scene_rays, lanes));
        let mut rays = SmallVec::new();
        LoadedRay::add_of_packet(&mut rays, simd, self.objects, space, lanes);
        self.visit_tree_with_rays(simd, tree, child, &rays, outer.as_ref());
    }

    /// Tests a few lanes against all items of a run of leaves, each ray by one call.
    #[inline(always)]
    fn visit_leaves_with_few<S: Simd>(
        &mut self,
        simd: S,
        group: &PacketGroup<'a, '_>,
        child: Child,
        lanes: LaneMask,
    ) {
        if lanes == 0 {
            return;
        }
        let PacketGroup { tree, space, outer } = *group;
        let mut scene_rays = SmallVec::new();
        let outer = outer.map(|outer| outer.with_rays(&mut scene_rays, lanes));
        let mut rays = SmallVec::new();
        LoadedRay::add_of_packet(&mut rays, simd, self.objects, space, lanes);
        for (leaf, head) in tree.heads.iter().enumerate().skip(child.index()) {
            self.objects.visited(lanes);
            self.visit_leaf_with_rays(simd, tree, leaf, &rays, outer.as_ref());
            if head.is_last {
                break;
            }
        }
    }

    #[inline(always)]
    fn visit_leaf_with_packet<S: Simd>(
        &mut self,
        simd: S,
        group: &PacketGroup<'a, '_>,
        leaf: &'a Leaf,
        items: u8,
        lanes: LaneMask,
    ) {
        let space = group.space;
        self.objects.visited(lanes);
        let count = usize::from(leaf.count);
        let farthest = self.farthest(simd, lanes);
        let (met, _) = space.interval.test(simd, &leaf.boxes, count, farthest);
        let mut met = met & u64::from(items);
        while met != 0 {
            let index = met.trailing_zeros() as usize % SIMD_LANES;
            met &= met - 1;
            let lanes = self.open(lanes);
            if lanes == 0 {
                return;
            }
            if leaf.class == INSTANCE {
                let bounds = leaf.boxes.get(index);
                let lanes = space.test(simd, &bounds, lanes, &self.hits.distance);
                if lanes != 0 {
                    self.visit_instance_with_packet(simd, leaf, index, space, lanes);
                }
            } else {
                self.test_object_with_packet(simd, group, leaf, index, lanes);
            }
        }
    }

    fn visit_instance_with_packet<S: Simd>(
        &mut self,
        simd: S,
        leaf: &'a Leaf,
        index: usize,
        space: &PacketSpace<'_>,
        lanes: LaneMask,
    ) {
        let item = leaf.items[index];
        let bounds = leaf.boxes.get(index);
        let Some((group, instance)) = self.instance(item) else { return };
        simd.vectorize(
            #[inline(always)]
            || {
                let moved = instance.moved_packet(space.rays, lanes);
                let lanes = finite_lanes(simd, &moved, lanes);
                if lanes != 0 {
                    let moved = PacketSpace::new(simd, &moved, lanes, self.next_serial());
                    let outer = InstanceContext { item, bounds, space };
                    self.visit_group_with_packet(simd, group, &moved, lanes, Some(&outer));
                }
            },
        );
    }

    /// Tests rays against an object, and those that hit it against its own box: rays that reach a leaf meet the boxes
    /// of most of its objects.
    #[inline(always)]
    fn test_object_with_packet<S: Simd>(
        &mut self,
        simd: S,
        group: &PacketGroup<'_, '_>,
        leaf: &Leaf,
        index: usize,
        lanes: LaneMask,
    ) {
        let PacketGroup { tree: _, space, outer } = *group;
        let hit = self.objects.packet(simd, space, leaf, index, lanes) & lanes;
        if hit == 0 {
            return;
        }
        let distance = self.objects.distance();
        let mut held = space.test(simd, &leaf.boxes.get(index), hit, distance);
        if let Some(outer) = outer {
            held = outer.space.test(simd, &outer.bounds, held, distance);
        }
        match self.search {
            Search::Any => self.hits.mark(held),
            Search::Closest => {
                self.hits.keep_nearer(
                    simd,
                    held,
                    distance,
                    InstanceContext::id(outer, leaf.items[index]),
                );
                self.farthest_of = 0;
            }
        }
    }

    /// Returns a bound of the distances at which any of `lanes`, at least one, still searches: the greatest of them, or
    /// the bound that is known for a set of lanes that contains them. Computed anew for each set of lanes, it would
    /// skip hardly more nodes.
    #[inline(always)]
    fn farthest<S: Simd>(&mut self, simd: S, lanes: LaneMask) -> f32 {
        if lanes & !self.farthest_of != 0 {
            self.farthest = greatest(simd, &self.hits.distance, lanes);
            self.farthest_of = lanes;
        }
        self.farthest
    }
}

/// Returns the rays that are to visit a child. If the interval is tight, a few rays that meet a node represent all.
#[inline(always)]
fn test_child<S: Simd>(
    simd: S,
    bounds: &Bounds,
    child: Child,
    space: &PacketSpace<'_>,
    lanes: LaneMask,
    limit: &Lanes,
) -> LaneMask {
    let is_exact = child.is_leaf() || space.interval.is_loose();
    let enough = if is_exact { u32::MAX } else { MIN_AT_NODES };
    space.test_some(simd, bounds, lanes, limit, enough)
}

impl InstanceContext<'_, PacketSpace<'_>> {
    /// Returns the context for the rays of some lanes, which it stores in `rays`.
    #[inline(always)]
    fn with_rays<'r>(
        &self,
        rays: &'r mut SmallVec<[TraversalRay; MAX_INTERLEAVED]>,
        lanes: LaneMask,
    ) -> RaysOuter<'r> {
        for lane in lanes_of(lanes) {
            rays.push(self.space.ray(lane));
        }
        InstanceContext { item: self.item, bounds: self.bounds, space: rays }
    }
}

/// Sorts a short slice so that `is_before` holds from each element to the next.
#[inline(always)]
fn insertion_sort<T: Copy>(few: &mut [T], is_before: impl Fn(&T, &T) -> bool) {
    for end in 1..few.len() {
        let moving = few[end];
        let mut place = end;
        while place > 0 && is_before(&moving, &few[place - 1]) {
            few[place] = few[place - 1];
            place -= 1;
        }
        few[place] = moving;
    }
}
