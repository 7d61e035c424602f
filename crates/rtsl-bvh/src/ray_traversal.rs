//! Traversal by single rays: the eight boxes of a node are tested at once, closer children come first, and all objects
//! of a leaf are tested by one call.

use fearless_simd::Simd;
use fearless_simd::prelude::*;
use rtsl_math::SIMD_LANES;

use super::bvh8::{Bvh8, Child, INSTANCE, Leaf};
use super::interleaved_traversal::{
    FEW_INTERLEAVED, InterleavedTraversal, MAX_INTERLEAVED, NodeVisits, Waiting,
};
use super::objects::{LoadedRay, Objects, RayLeafTest};
use super::packet::{LANES, is_wide};
use super::ray_space::TraversalRay;
use super::traversal::{InstanceContext, Search, Traversal, TraversalStack};

/// The instance whose group is traversed, with the rays in the scene's space.
pub type RaysOuter<'a> = InstanceContext<'a, [TraversalRay]>;

type RayOuter<'a> = InstanceContext<'a, TraversalRay>;

/// Rays in a group.
struct RayGroup<'a, 'r> {
    tree: &'a Bvh8,
    rays: &'r [LoadedRay],
    outer: Option<&'r RaysOuter<'r>>,
}

impl<'a, O: Objects> Traversal<'a, O> {
    /// Traverses the subtree below `root` with at most [`MAX_INTERLEAVED`] rays.
    #[inline(always)]
    pub fn visit_tree_with_rays<S: Simd>(
        &mut self,
        simd: S,
        tree: &'a Bvh8,
        root: Child,
        rays: &[LoadedRay],
        outer: Option<&RaysOuter<'_>>,
    ) {
        let group = RayGroup { tree, rays, outer };
        match rays.len() {
            ..=FEW_INTERLEAVED => self.interleave::<S, FEW_INTERLEAVED>(simd, &group, root),
            _ => self.interleave::<S, MAX_INTERLEAVED>(simd, &group, root),
        }
    }

    /// Traverses a subtree with at most `N` rays.
    fn interleave<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        group: &RayGroup<'a, '_>,
        root: Child,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let (stacks, count) = (&mut self.visits.rays, group.rays.len());
                let mut interleaved =
                    InterleavedTraversal::<N>::new(stacks, group.tree, root, count);
                let mut of_node = NodeVisits::NONE;
                while !interleaved.is_over() {
                    self.visit_nodes_with_rays(simd, group, &mut interleaved, &mut of_node);
                    self.visit_leaves_with_rays(simd, group, &mut interleaved);
                }
                interleaved.end(&mut self.visits.rays);
            },
        );
    }

    /// Visits a node with every ray whose next visit is a node.
    #[inline(always)]
    fn visit_nodes_with_rays<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        group: &RayGroup<'a, '_>,
        interleaved: &mut InterleavedTraversal<N>,
        of_node: &mut NodeVisits,
    ) {
        let nodes = group.tree.nodes.as_slice();
        let stacks = &mut self.visits.rays;
        for index in interleaved.take_at_nodes() {
            let ray = &group.rays[index];
            let limit = self.hits.distance[ray.lane % LANES];
            self.objects.visited(1 << ray.lane);
            let node = &nodes[interleaved.next(index).index()];
            let (met, entries) = ray.test_node(simd, node, limit);
            if is_wide::<S>() {
                interleaved.push_in_register(simd, stacks, index, met, node, entries);
            } else {
                of_node.set(simd, node, entries);
                interleaved.push(stacks, index, met.to_bitmask(), of_node);
            }
            interleaved.queue_next(stacks, group.tree, index, limit);
        }
    }

    /// Visits a leaf with every ray whose next visit is a leaf; one call performs all tests.
    #[inline(always)]
    fn visit_leaves_with_rays<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        group: &RayGroup<'a, '_>,
        interleaved: &mut InterleavedTraversal<N>,
    ) {
        let at_leaves = interleaved.take_at_leaves();
        // Rays of instances that are visited meanwhile have theirs behind these.
        let first = self.visits.tests.len();
        self.add_tests_at_leaves(simd, group, interleaved, at_leaves);
        self.make_tests(group, first);
        for ray_index in at_leaves {
            let (lane, index) =
                (group.rays[ray_index].lane % LANES, interleaved.next(ray_index).index());
            if self.open(1 << lane) == 0 {
                continue;
            }
            if group.tree.heads[index].is_last {
                interleaved.queue_next(
                    &self.visits.rays,
                    group.tree,
                    ray_index,
                    self.hits.distance[lane],
                );
            } else {
                interleaved.queue(ray_index, Child::leaf(index as u32 + 1));
            }
        }
    }

    /// Adds the tests of the rays at leaves. Instances are visited at once.
    #[inline(always)]
    fn add_tests_at_leaves<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        group: &RayGroup<'a, '_>,
        interleaved: &mut InterleavedTraversal<N>,
        at_leaves: Waiting,
    ) {
        for ray_index in at_leaves {
            if !interleaved.is_new_leaf(ray_index) {
                continue;
            }
            let (ray, index) = (&group.rays[ray_index], interleaved.next(ray_index).index());
            let head = group.tree.heads[index];
            self.objects.visited(1 << ray.lane);
            if head.class == INSTANCE {
                self.visit_instances_with_ray(simd, &group.tree.leaves[index], ray);
            } else {
                self.objects.prefetch(&head);
                self.visits.tests.push(RayLeafTest::new(ray_index, index, head));
            }
        }
    }

    /// Tests rays against all items of one leaf.
    #[inline(always)]
    pub fn visit_leaf_with_rays<S: Simd>(
        &mut self,
        simd: S,
        tree: &'a Bvh8,
        leaf: usize,
        rays: &[LoadedRay],
        outer: Option<&RaysOuter<'_>>,
    ) {
        let head = tree.heads[leaf];
        if head.class == INSTANCE {
            let leaf = &tree.leaves[leaf];
            rays.iter().for_each(|ray| self.visit_instances_with_ray(simd, leaf, ray));
            return;
        }
        let first = self.visits.tests.len();
        let tests = (0..rays.len()).map(|ray| RayLeafTest::new(ray, leaf, head));
        self.visits.tests.extend(tests);
        self.make_tests(&RayGroup { tree, rays, outer }, first);
    }

    /// Performs the tests from `first` on and removes them.
    #[inline(always)]
    fn make_tests(&mut self, group: &RayGroup<'a, '_>, first: usize) {
        let RayGroup { tree, rays, outer } = *group;
        let TraversalStack { tests, closer, .. } = &mut *self.visits;
        let made = &mut tests[first..];
        if made.is_empty() {
            return;
        }
        self.objects.leaves(rays, &tree.leaves, made);
        closer.clear();
        closer.resize(made.len(), 0);
        let mut count = 0;
        for (index, RayLeafTest { ray, nearest, distance, .. }) in (0..).zip(&*made) {
            let farthest = self.hits.distance[rays[*ray as usize].lane % LANES];
            let is_closer = *nearest != RayLeafTest::NO_ITEM && *distance <= farthest;
            closer[count] = index;
            count += usize::from(is_closer);
        }
        for place in 0..count {
            let index = first + self.visits.closer[place] as usize;
            let RayLeafTest { ray, leaf, nearest, distance, .. } = self.visits.tests[index];
            let (ray, leaf) = (&rays[ray as usize], &tree.leaves[leaf as usize]);
            let outer = outer.map(|outer| outer.of(ray));
            self.keep_closest_of_leaf(leaf, nearest as usize, distance, ray, outer.as_ref());
        }
        self.visits.tests.truncate(first);
    }

    #[inline(always)]
    fn keep_closest_of_leaf(
        &mut self,
        leaf: &Leaf,
        index: usize,
        distance: f32,
        ray: &LoadedRay,
        outer: Option<&RayOuter<'_>>,
    ) {
        if is_held(leaf, index, ray, distance, outer) {
            self.keep(leaf.items[index], distance, ray.lane, outer);
        } else {
            self.test_objects_with_ray(leaf, ray, outer);
        }
    }

    /// Tests the objects of a leaf one by one: if the closest hit does not count, another may.
    #[cold]
    fn test_objects_with_ray(
        &mut self,
        leaf: &Leaf,
        ray: &LoadedRay,
        outer: Option<&RayOuter<'_>>,
    ) {
        for index in 0..usize::from(leaf.count) {
            let distance = self.objects.ray_against_one(ray, leaf, index);
            let held = distance.filter(|distance| is_held(leaf, index, ray, *distance, outer));
            if let Some(distance) = held {
                self.keep(leaf.items[index], distance, ray.lane, outer);
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

    /// Visits the instances of a leaf whose own boxes a ray meets. This is a function of its own, because a group is
    /// traversed within, and so it enables the instruction set of `simd` again: without, each operation is a call.
    fn visit_instances_with_ray<S: Simd>(&mut self, simd: S, leaf: &'a Leaf, ray: &TraversalRay) {
        simd.vectorize(
            #[inline(always)]
            || {
                let limit = self.hits.distance[ray.lane];
                let (mut met, entries) = ray.test(simd, &leaf.boxes, u32::from(leaf.count), limit);
                let entries = entries.to_array();
                while met != 0 && self.open(1 << ray.lane) != 0 {
                    let index = met.trailing_zeros() as usize % SIMD_LANES;
                    met &= met - 1;
                    if entries[index] <= self.hits.distance[ray.lane] {
                        self.visit_instance_with_ray(simd, leaf, index, ray);
                    }
                }
            },
        );
    }

    #[inline(always)]
    fn visit_instance_with_ray<S: Simd>(
        &mut self,
        simd: S,
        leaf: &'a Leaf,
        index: usize,
        ray: &TraversalRay,
    ) {
        let item = leaf.items[index];
        let Some((group, instance)) = self.instance(item) else { return };
        let Some(moved) = instance.moved_ray(ray) else { return };
        let moved = LoadedRay::alone(self.objects, moved);
        let (moved, space) = (std::slice::from_ref(&moved), std::slice::from_ref(ray));
        let outer = InstanceContext { item, bounds: leaf.boxes.get(index), space };
        let tree = &group.tree;
        for leaf in tree.first_unbounded as usize..tree.leaves.len() {
            self.objects.visited(1 << ray.lane);
            self.visit_leaf_with_rays(simd, tree, leaf, moved, Some(&outer));
        }
        if let Some(root) = tree.root {
            self.visit_tree_with_rays(simd, tree, root, moved, Some(&outer));
        }
    }
}

/// True if a hit lies in its object's own box, and in that of the instance.
#[inline(always)]
fn is_held(
    leaf: &Leaf,
    index: usize,
    ray: &TraversalRay,
    distance: f32,
    outer: Option<&RayOuter<'_>>,
) -> bool {
    ray.holds(&leaf.boxes.get(index), distance)
        && outer.is_none_or(|outer| outer.space.holds(&outer.bounds, distance))
}
