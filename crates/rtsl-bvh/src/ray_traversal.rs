//! Single rays on their way through a tree: a node's eight boxes are tested at once, nearer children
//! come first, and a block's objects are tested by one call.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use rtsl_math::SIMD_LANES;
use smallvec::SmallVec;

use super::bvh8::{Bvh8, Child, Leaf};
use super::geometry::{Group, INSTANCE};
use super::interleaved_traversal::{MAX_IN_TURN, NodeVisits, Turns, Waiting};
use super::objects::{BlockTest, Objects};
use super::packet::LANES;
use super::ray_space::TraversalRay;
use super::traversal::{InstanceContext, Search, Traversal};

/// The instance whose group rays visit, with the rays in the scene's space.
pub type RaysOuter<'a> = InstanceContext<'a, [TraversalRay]>;

type RayOuter<'a> = InstanceContext<'a, TraversalRay>;

type BlockTests<'r> = SmallVec<[BlockTest<'r>; MAX_IN_TURN]>;

/// Rays on their way through a group.
struct RayGroup<'a, 'r> {
    tree: &'a Bvh8,
    rays: &'r [TraversalRay],
    outer: Option<&'r RaysOuter<'r>>,
}

impl<'a, O: Objects> Traversal<'a, O> {
    /// Takes rays, at most [`MAX_IN_TURN`] and loaded, through what is below `root` in a group's tree.
    pub fn visit_tree_with_rays<S: Simd>(
        &mut self,
        simd: S,
        group: &'a Group,
        root: Child,
        rays: &[TraversalRay],
        outer: Option<&RaysOuter<'_>>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let group = RayGroup { tree: &group.tree, rays, outer };
                let mut turns = Turns::new(self.visits, group.tree, root, rays.len());
                let mut of_node = NodeVisits::NONE;
                while !turns.is_over() {
                    self.visit_nodes_with_rays(simd, &group, &mut turns, &mut of_node);
                    self.visit_leaves_with_rays(simd, &group, &mut turns);
                }
                turns.end(self.visits);
            },
        );
    }

    /// Every ray that is at a node has its turn.
    #[inline(always)]
    fn visit_nodes_with_rays<S: Simd>(
        &mut self,
        simd: S,
        group: &RayGroup<'a, '_>,
        turns: &mut Turns,
        of_node: &mut NodeVisits,
    ) {
        let nodes = group.tree.nodes.as_slice();
        for turn in turns.take_at_nodes() {
            let ray = &group.rays[turn];
            let limit = self.hits.distance[ray.lane % LANES];
            self.objects.visited(1 << ray.lane);
            let node = &nodes[turns.next(turn).index()];
            let (met, entries) = ray.test(simd, &node.boxes, node.count, limit);
            of_node.set(simd, node, entries);
            turns.push(self.visits, turn, met, of_node);
            turns.queue_next(self.visits, group.tree, turn, limit);
        }
    }

    /// Every ray that is at a leaf has its turn: the tests of a block each are made together.
    #[inline(always)]
    fn visit_leaves_with_rays<S: Simd>(
        &mut self,
        simd: S,
        group: &RayGroup<'a, '_>,
        turns: &mut Turns,
    ) {
        let at_leaves = turns.take_at_leaves();
        let mut tests = self.tests_at_leaves(simd, group, turns, at_leaves);
        self.make_tests(&mut tests, group.outer);
        for turn in at_leaves {
            let (lane, index) = (group.rays[turn].lane % LANES, turns.next(turn).index());
            if self.open(1 << lane) == 0 {
                continue;
            }
            if group.tree.heads[index].is_last {
                turns.queue_next(self.visits, group.tree, turn, self.hits.distance[lane]);
            } else {
                turns.queue(turn, Child::leaf(index as u32 + 1));
            }
        }
    }

    /// The tests of rays that are at leaves. Instances are visited at once.
    #[inline(always)]
    fn tests_at_leaves<'r, S: Simd>(
        &mut self,
        simd: S,
        group: &RayGroup<'a, 'r>,
        turns: &mut Turns,
        at_leaves: Waiting,
    ) -> BlockTests<'r>
    where
        'a: 'r,
    {
        let mut tests = BlockTests::new();
        for turn in at_leaves {
            if !turns.is_new_leaf(turn) {
                continue;
            }
            let (ray, index) = (&group.rays[turn], turns.next(turn).index());
            let (head, block) = (group.tree.heads[index], &group.tree.blocks[index]);
            self.objects.visited(1 << ray.lane);
            if head.class == INSTANCE {
                self.visit_instances_with_ray(simd, block, ray);
            } else {
                self.objects.prefetch(&head);
                tests.push(BlockTest { ray, head, block, nearest: None });
            }
        }
        tests
    }

    #[inline(always)]
    fn make_tests(&mut self, tests: &mut [BlockTest<'_>], outer: Option<&RaysOuter<'_>>) {
        if tests.is_empty() {
            return;
        }
        self.objects.blocks(tests);
        for BlockTest { ray, head: _, block, nearest } in tests {
            let Some((index, distance)) = *nearest else { continue };
            let outer = outer.map(|outer| outer.of(ray));
            self.keep_nearest_of_block(block, index, distance, ray, outer.as_ref());
        }
    }

    /// Tests a ray against all items of a block.
    fn visit_block_with_ray<S: Simd>(
        &mut self,
        simd: S,
        block: &'a Leaf,
        ray: &TraversalRay,
        outer: Option<&RayOuter<'_>>,
    ) {
        self.objects.visited(1 << ray.lane);
        if block.class == INSTANCE {
            self.visit_instances_with_ray(simd, block, ray);
            return;
        }
        let mut test = [BlockTest { ray, head: block.head(), block, nearest: None }];
        self.objects.blocks(&mut test);
        if let [BlockTest { nearest: Some((index, distance)), .. }] = test {
            self.keep_nearest_of_block(block, index, distance, ray, outer);
        }
    }

    #[inline(always)]
    fn keep_nearest_of_block(
        &mut self,
        block: &Leaf,
        index: usize,
        distance: f32,
        ray: &TraversalRay,
        outer: Option<&RayOuter<'_>>,
    ) {
        if distance > self.hits.distance[ray.lane] {
            return;
        }
        if is_held(block, index, ray, distance, outer) {
            self.keep(block.items[index], distance, ray.lane, outer);
        } else {
            self.test_objects_with_ray(block, ray, outer);
        }
    }

    /// Tests the objects of a block one by one: where the nearest hit does not count, another may.
    #[cold]
    fn test_objects_with_ray(
        &mut self,
        block: &Leaf,
        ray: &TraversalRay,
        outer: Option<&RayOuter<'_>>,
    ) {
        for index in 0..usize::from(block.count) {
            let distance = self.objects.ray_against_one(ray, block, index);
            let held = distance.filter(|distance| is_held(block, index, ray, *distance, outer));
            if let Some(distance) = held {
                self.keep(block.items[index], distance, ray.lane, outer);
            }
        }
    }

    #[inline(always)]
    fn keep(&mut self, item: u32, distance: f32, lane: usize, outer: Option<&RayOuter<'_>>) {
        let id = InstanceContext::id(outer, item);
        match self.search {
            Search::Any => self.hits.mark(1 << lane),
            Search::Closest if self.hits.is_nearer(lane, distance, id) => {
                self.hits.set(lane, distance, id);
            }
            Search::Closest => {}
        }
    }

    fn visit_instances_with_ray<S: Simd>(&mut self, simd: S, block: &'a Leaf, ray: &TraversalRay) {
        let lane = ray.lane;
        let (mut met, entries) =
            ray.test(simd, &block.boxes, u32::from(block.count), self.hits.distance[lane]);
        let entries = entries.to_array();
        while met != 0 && self.open(1 << lane) != 0 {
            let index = met.trailing_zeros() as usize % SIMD_LANES;
            met &= met - 1;
            if entries[index] > self.hits.distance[lane] {
                continue;
            }
            let item = block.items[index];
            let Some((group, instance)) = self.instance(item) else { continue };
            let Some(moved) = instance.moved_ray(ray) else { continue };
            self.objects.load_ray(&moved);
            let bounds = block.boxes.get(index);
            for block in group.tree.unbounded() {
                let outer = InstanceContext { item, bounds, space: ray };
                self.visit_block_with_ray(simd, block, &moved, Some(&outer));
            }
            if let Some(root) = group.tree.root {
                let (moved, space) = (std::slice::from_ref(&moved), std::slice::from_ref(ray));
                let outer = InstanceContext { item, bounds, space };
                self.visit_tree_with_rays(simd, group, root, moved, Some(&outer));
            }
        }
    }
}

/// Whether a hit lies in its object's own box, and in that of the instance.
#[inline(always)]
fn is_held(
    block: &Leaf,
    index: usize,
    ray: &TraversalRay,
    distance: f32,
    outer: Option<&RayOuter<'_>>,
) -> bool {
    ray.holds(&block.boxes.get(index), distance)
        && outer.is_none_or(|outer| outer.space.holds(&outer.bounds, distance))
}
