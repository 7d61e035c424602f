//! Traversal by streams.
//!
//! A node is visited once by all rays that meet it: its eight boxes stay in registers, and each ray is appended without
//! a branch to the lists of the children that it meets. Children are ordered by the average distance at which their
//! rays enter them. Rays that meet the own boxes of objects are paired with them, and tested when there are enough
//! pairs to fill whole vectors: the rays may come from any leaves, with objects of one class.
//!
//! Rays are not sorted by direction: on a thousand spheres that saves no visits.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};
use rtsl_math::SIMD_LANES;

use super::bvh8::{Bvh8, Leaf, Node8};
use super::geometry::Geometry;
use super::hit::HitId;
use super::objects::Objects;
use super::packet_traversal::MAX_NODES_FOR_PACKETS;
use super::stream::{Pair, PairHit, RAYS_OF_STREAM, RayStream};
use super::traversal::{Search, TraversalStack};

/// The least number of a stream's rays for each node of the tree.
const MIN_RAYS_OF_NODE: usize = 4;

/// The number of pending pairs at which objects are tested.
const ENOUGH_PAIRS: usize = 128;

impl Geometry {
    /// True if a search for this many incoherent rays is faster as a stream than in packets, and the geometry has no
    /// instances, which streams do not support.
    ///
    /// With few rays for each node the lists get short before rays reach leaves. A thousand spheres, of some sixty
    /// nodes, rendered 1.14 times as fast by streams of a thousand rays as by packets, and ten thousand as fast; a book
    /// of 21,000 triangles, of nearly a thousand nodes, 0.86 times as fast (Zen 5).
    pub fn suits_stream(&self, rays: usize) -> bool {
        let nodes = self.groups.first().map_or(0, |scene| scene.tree.nodes.len());
        let is_small = MIN_RAYS_OF_NODE * nodes <= rays.min(RAYS_OF_STREAM);
        self.instances.is_empty() && nodes > MAX_NODES_FOR_PACKETS && is_small
    }

    /// Finds the hits of the rays of a stream of any length. The geometry must not have instances.
    pub fn search_stream<O: Objects>(
        &self,
        stream: &mut RayStream,
        search: Search,
        objects: &mut O,
        visits: &mut TraversalStack,
    ) {
        let empty = Bvh8::default();
        let tree = self.groups.first().map_or(&empty, |scene| &scene.tree);
        visits.pairs.resize_with(tree.classes as usize, Vec::new);
        let mut traversal = StreamTraversal { tree, stream, search, objects, visits };
        dispatch!(Level::new(), simd => traversal.visit_tree(simd));
    }
}

struct StreamTraversal<'a, O> {
    tree: &'a Bvh8,
    stream: &'a mut RayStream,
    search: Search,
    objects: &'a mut O,
    visits: &'a mut TraversalStack,
}

impl<O: Objects> StreamTraversal<'_, O> {
    #[inline(always)]
    fn visit_tree<S: Simd>(&mut self, simd: S) {
        simd.vectorize(
            #[inline(always)]
            || {
                self.stream.begin(simd);
                self.visits.lists.begin(self.stream.len());
                let all = Node8::ALL_ITEMS;
                self.visit_leaves(simd, self.tree.unbounded(), all);
                self.tree.root.iter().for_each(|root| self.visits.lists.push_all((*root, all)));
                while let Some((child, items)) = self.visits.lists.take() {
                    if child.is_leaf() {
                        self.visit_leaves(simd, self.tree.leaf_run(child.index()), items);
                    } else {
                        self.visit_node(simd, &self.tree.nodes[child.index()]);
                    }
                }
                (0..self.tree.classes).for_each(|class| self.test_pairs(class));
            },
        );
    }

    /// Appends the rays taken to the lists of the children of a node.
    #[inline(always)]
    fn visit_node<S: Simd>(&mut self, simd: S, node: &Node8) {
        let none = f32x8::splat(simd, 0.0);
        let (mut entries, mut counts) = (none, none);
        let rays = self.stream.rays();
        self.visits.lists.meet(|ray| {
            let (met, entry) = rays[ray as usize].test(simd, &node.boxes);
            entries += met.select(entry, none);
            counts += met.select(f32x8::splat(simd, 1.0), none);
            met.to_bitmask()
        });
        let (order, count) = order(node, (entries / counts).to_array(), counts.to_array());
        for slot in &order[..count] {
            self.visits.lists.push(simd, node, *slot);
        }
    }

    /// Pairs the rays taken with those of these items of leaves whose own boxes they meet.
    #[inline(always)]
    fn visit_leaves<S: Simd>(&mut self, simd: S, leaves: &[Leaf], items: u8) {
        for leaf in leaves {
            let TraversalStack { lists, pairs, .. } = &mut *self.visits;
            let pairs = &mut pairs[leaf.class as usize];
            let items = u64::from(items) & !(u64::MAX << leaf.count);
            for ray in &lists.taken {
                let (met, entries) = self.stream.rays()[*ray as usize].test(simd, &leaf.boxes);
                let entries = entries.to_array();
                let mut met = met.to_bitmask() & items;
                while met != 0 {
                    let index = met.trailing_zeros() as usize % SIMD_LANES;
                    met &= met - 1;
                    pairs.push(Pair {
                        ray: *ray,
                        object: leaf.index_in_class * SIMD_LANES as u32 + index as u32,
                        item: leaf.items[index],
                        entry: entries[index],
                    });
                }
            }
            if pairs.len() >= ENOUGH_PAIRS {
                self.test_pairs(leaf.class);
            }
        }
    }

    /// Tests all pending pairs of a class.
    fn test_pairs(&mut self, class: u32) {
        let TraversalStack { pairs, found, .. } = &mut *self.visits;
        let pairs = &mut pairs[class as usize];
        found.clear();
        self.objects.pairs(self.stream, class, pairs, found);
        for PairHit { pair, distance } in &*found {
            let Pair { ray, item, entry, .. } = pairs[*pair as usize];
            let (ray, id) = (ray as usize, HitId::new(item, 0));
            match self.search {
                _ if entry > *distance => {}
                Search::Closest => self.stream.keep_nearer(ray, *distance, id),
                Search::Any => self.stream.mark(ray, id),
            }
        }
        pairs.clear();
    }
}

/// Returns the slots of the children of a node that rays meet, the farthest first, and their number.
#[inline(always)]
fn order(
    node: &Node8,
    entries: [f32; SIMD_LANES],
    rays: [f32; SIMD_LANES],
) -> ([usize; SIMD_LANES], usize) {
    let mut order = [0; SIMD_LANES];
    let mut count = 0;
    for slot in (0..SIMD_LANES).filter(|slot| rays[*slot] > 0.0 && *slot < node.count as usize) {
        let mut place = count;
        while place > 0 && entries[slot] > entries[order[place - 1]] {
            order[place] = order[place - 1];
            place -= 1;
        }
        order[place] = slot;
        count += 1;
    }
    (order, count)
}
