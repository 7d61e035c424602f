//! Single rays on their way through a tree: a node's eight boxes are tested at once, nearer children
//! come first, and a block's objects are tested by one call.

use fearless_simd::Simd;

use super::geometry::{Group, INSTANCE};
use super::objects::Objects;
use super::packet_traversal::insertion_sort;
use super::ray_space::{RayBoxTest, RaySpace};
use super::traversal::{Outer, Search, Traversal, Visits};
use super::wide_tree::{Block, BlockHead, Child, WIDTH, WideNode, WideTree};

/// A child that a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct RayVisit {
    child: Child,
    /// Where, at the earliest.
    entry: f32,
}

type RayOuter<'a> = Outer<'a, RaySpace>;

impl Visits {
    /// Of the children that a ray meets, the nearest; the others are pushed, the nearest of them last.
    #[inline(always)]
    fn push_farther(
        &mut self,
        node: &WideNode,
        mut met: u64,
        entries: &[f32; WIDTH],
    ) -> Option<Child> {
        let mut take = || {
            let slot = met.trailing_zeros() as usize % WIDTH;
            let visit = RayVisit { child: node.children[slot], entry: entries[slot] };
            let is_any = met != 0;
            met &= met.wrapping_sub(1);
            is_any.then_some(visit)
        };
        let mut nearest = take()?;
        let base = self.rays.len();
        while let Some(visit) = take() {
            let is_nearer = visit.entry < nearest.entry;
            self.rays.push(if is_nearer { nearest } else { visit });
            nearest = if is_nearer { visit } else { nearest };
        }
        if self.rays.len() > base + 1 {
            insertion_sort(&mut self.rays[base..], |one, other| one.entry > other.entry);
        }
        Some(nearest.child)
    }

    /// The next child above `base` whose entry is not behind `limit`.
    #[inline(always)]
    fn next_of_ray(&mut self, base: usize, limit: f32) -> Option<Child> {
        while self.rays.len() > base {
            let visit = self.rays.pop()?;
            if visit.entry <= limit {
                return Some(visit.child);
            }
        }
        None
    }
}

impl<'a, O: Objects> Traversal<'a, O> {
    /// Takes the ray of a lane through the part of a group's tree that begins with `root`.
    pub fn visit_tree_with_ray<S: Simd>(
        &mut self,
        simd: S,
        group: &'a Group,
        root: Child,
        ray: &RaySpace,
        lane: usize,
        outer: Option<&RayOuter<'_>>,
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                let tree = &group.tree;
                let test = RayBoxTest::new(simd, ray);
                let base = self.visits.rays.len();
                let mut next = Some(root);
                let mut last = None;
                while let Some(leaf) = self.next_leaf(tree, &test, next, lane, base) {
                    // Of leaves that share a block the first tests all items.
                    if last != Some(leaf) {
                        last = Some(leaf);
                        self.visit_leaf_with_ray(simd, tree, leaf.index(), ray, lane, outer);
                        if self.is_done(lane) {
                            self.visits.rays.truncate(base);
                            break;
                        }
                    }
                    next = self.visits.next_of_ray(base, self.hits.distance[lane]);
                }
            },
        );
    }

    #[inline(always)]
    fn is_done(&self, lane: usize) -> bool {
        self.open(1 << lane) == 0
    }

    /// The nearest leaf that is reached from `next` on and met before the nearest hit so far.
    #[inline(always)]
    fn next_leaf<S: Simd>(
        &mut self,
        tree: &WideTree,
        test: &RayBoxTest<S>,
        mut next: Option<Child>,
        lane: usize,
        base: usize,
    ) -> Option<Child> {
        let limit = self.hits.distance[lane];
        let nodes = tree.nodes.as_slice();
        while let Some(child) = next
            && !child.is_leaf()
        {
            self.objects.visited(1 << lane);
            let node = &nodes[child.index()];
            let (met, entries) = test.test(&node.boxes, limit);
            let nearest = self.visits.push_farther(node, met, &entries);
            next = nearest.or_else(|| self.visits.next_of_ray(base, limit));
        }
        next
    }

    #[inline(always)]
    fn visit_leaf_with_ray<S: Simd>(
        &mut self,
        simd: S,
        tree: &'a WideTree,
        first: usize,
        ray: &RaySpace,
        lane: usize,
        outer: Option<&RayOuter<'_>>,
    ) {
        for (head, block) in tree.heads[first..].iter().zip(&tree.blocks[first..]) {
            self.visit_block_with_ray(simd, head, block, ray, lane, outer);
            if head.is_last {
                return;
            }
        }
    }

    #[inline(always)]
    fn visit_block_with_ray<S: Simd>(
        &mut self,
        simd: S,
        head: &BlockHead,
        block: &'a Block,
        ray: &RaySpace,
        lane: usize,
        outer: Option<&RayOuter<'_>>,
    ) {
        self.objects.visited(1 << lane);
        if head.class == INSTANCE {
            self.visit_instances_with_ray(simd, block, ray, lane);
            return;
        }
        let Some((index, distance)) = self.objects.ray(ray, head, block) else { return };
        if distance > self.hits.distance[lane] {
            return;
        }
        if is_held(block, index, ray, distance, outer) {
            self.keep(block.items[index], distance, lane, outer);
        } else {
            self.test_objects_with_ray(block, ray, lane, outer);
        }
    }

    /// Tests the objects of a block one by one: where the nearest hit does not count, another may.
    #[cold]
    fn test_objects_with_ray(
        &mut self,
        block: &Block,
        ray: &RaySpace,
        lane: usize,
        outer: Option<&RayOuter<'_>>,
    ) {
        for index in 0..usize::from(block.count) {
            let distance = self.objects.ray_against_one(ray, block, index);
            let held = distance.filter(|distance| is_held(block, index, ray, *distance, outer));
            if let Some(distance) = held {
                self.keep(block.items[index], distance, lane, outer);
            }
        }
    }

    #[inline(always)]
    fn keep(&mut self, item: u32, distance: f32, lane: usize, outer: Option<&RayOuter<'_>>) {
        let id = Outer::id(outer, item);
        match self.search {
            Search::Any => self.hits.mark(1 << lane),
            Search::Nearest if self.hits.is_nearer(lane, distance, id) => {
                self.hits.set(lane, distance, id);
            }
            Search::Nearest => {}
        }
    }

    fn visit_instances_with_ray<S: Simd>(
        &mut self,
        simd: S,
        block: &'a Block,
        ray: &RaySpace,
        lane: usize,
    ) {
        let test = RayBoxTest::new(simd, ray);
        let (mut met, entries) = test.test(&block.boxes, self.hits.distance[lane]);
        while met != 0 && !self.is_done(lane) {
            let index = met.trailing_zeros() as usize % WIDTH;
            met &= met - 1;
            if entries[index] > self.hits.distance[lane] {
                continue;
            }
            let item = block.items[index];
            let Some((group, instance)) = self.instance(item) else { continue };
            let Some(moved) = instance.moved_ray(ray, self.next_serial()) else { continue };
            let outer = Outer { item, bounds: block.boxes.get(index), space: ray };
            for block in group.tree.unbounded() {
                self.visit_block_with_ray(simd, &block.head(), block, &moved, lane, Some(&outer));
            }
            if let Some(root) = group.tree.root {
                self.visit_tree_with_ray(simd, group, root, &moved, lane, Some(&outer));
            }
        }
    }
}

/// Whether a hit lies in its object's own box, and in that of the instance.
#[inline(always)]
fn is_held(
    block: &Block,
    index: usize,
    ray: &RaySpace,
    distance: f32,
    outer: Option<&RayOuter<'_>>,
) -> bool {
    ray.holds(&block.boxes.get(index), distance)
        && outer.is_none_or(|outer| outer.space.holds(&outer.bounds, distance))
}
