//! Single rays on their way through a tree: a node's eight boxes are tested at once, nearer children
//! come first, and a block's objects are tested by one call.

use fearless_simd::Simd;

use super::geometry::{Group, INSTANCE};
use super::objects::Objects;
use super::packet_traversal::insertion_sort;
use super::space::RaySpace;
use super::traversal::{Outer, Search, Traversal};
use super::wide_tree::{Block, Child, WIDTH};

/// A child that a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct RayVisit {
    child: Child,
    /// Where, at the earliest.
    entry: f32,
}

type RayOuter<'a> = Outer<'a, RaySpace>;

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
                let base = self.visits.rays.len();
                self.visits.rays.push(RayVisit { child: root, entry: f32::NEG_INFINITY });
                while self.visits.rays.len() > base {
                    let Some(RayVisit { child, entry }) = self.visits.rays.pop() else { break };
                    if entry > self.hits.distance[lane] {
                        continue;
                    }
                    if !child.is_leaf() {
                        self.visit_node_with_ray(simd, group, child, ray, lane);
                        continue;
                    }
                    for block in group.tree.leaf(child.index()) {
                        self.visit_block_with_ray(simd, block, ray, lane, outer);
                    }
                    if self.is_done(lane) {
                        self.visits.rays.truncate(base);
                    }
                }
            },
        );
    }

    #[inline(always)]
    fn is_done(&self, lane: usize) -> bool {
        self.open(1 << lane) == 0
    }

    #[inline(always)]
    fn visit_node_with_ray<S: Simd>(
        &mut self,
        simd: S,
        group: &Group,
        child: Child,
        ray: &RaySpace,
        lane: usize,
    ) {
        self.objects.visited(1 << lane);
        let node = &group.tree.nodes[child.index()];
        let limit = self.hits.distance[lane];
        let (mut met, entries) = ray.test(simd, &node.boxes, node.count as usize, limit);
        let base = self.visits.rays.len();
        while met != 0 {
            let slot = met.trailing_zeros() as usize % WIDTH;
            met &= met - 1;
            self.visits.rays.push(RayVisit { child: node.children[slot], entry: entries[slot] });
        }
        insertion_sort(&mut self.visits.rays[base..], |one, other| one.entry > other.entry);
    }

    #[inline(always)]
    fn visit_block_with_ray<S: Simd>(
        &mut self,
        simd: S,
        block: &'a Block,
        ray: &RaySpace,
        lane: usize,
        outer: Option<&RayOuter<'_>>,
    ) {
        self.objects.visited(1 << lane);
        if block.class == INSTANCE {
            self.visit_instances_with_ray(simd, block, ray, lane);
            return;
        }
        let Some((index, distance)) = self.objects.ray(ray, block) else { return };
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
        let count = usize::from(block.count);
        let (mut met, entries) = ray.test(simd, &block.boxes, count, self.hits.distance[lane]);
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
                self.visit_block_with_ray(simd, block, &moved, lane, Some(&outer));
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
