//! Construction of the hierarchy: a library builds a binary BVH, which is collapsed into one with eight children a
//! node.
//!
//! The library's builder (parallel locally-ordered clustering, then reinsertion) is deterministic on any number of
//! threads. The module `collapse` chooses the subtrees that become leaves of at most eight items.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::time::Duration;

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};
use rtsl_math::SIMD_LANES;
use rtsl_memory::{Amount, in_huge_pages, on_all_processors};

use super::bounds::Bounds;
use super::bvh8::{Boxes, Bvh8, Child, Item, Leaf, LeafHead, Node8};
use super::collapse::CollapsePlan;

/// The approximate number of nodes that the first pass of reinsertion tries to improve, which is also limited from
/// below by a fraction of all nodes. Small trees are covered entirely, and rays then visit a tenth fewer nodes;
/// covering all of a million items would take a second, against half a second with this limit.
const REINSERTED_NODES: f32 = 30_000.0;
const MIN_REINSERTED: f32 = 0.03;

/// The usual number of items of a leaf, and of leaves of a node.
const ITEMS_OF_LEAF: f64 = 5.5;
const LEAVES_OF_NODE: f64 = 4.0;

impl Bvh8 {
    /// An estimate of the memory of a hierarchy over this many items of surfaces. Items in disorder may take three times
    /// as much.
    pub fn estimated_memory(items: usize) -> Amount {
        let leaves = (items as f64 / ITEMS_OF_LEAF).ceil() as usize;
        let nodes = (leaves as f64 / LEAVES_OF_NODE).ceil() as usize;
        Amount::of::<Leaf>(leaves) + Amount::of::<LeafHead>(leaves) + Amount::of::<Node8>(nodes)
    }

    /// Builds the hierarchy over items, which are identified by their index.
    pub fn build(items: &[Item]) -> Bvh8 {
        let _span = tracing::debug_span!("hierarchy", items = items.len()).entered();
        let bounded = items.iter().enumerate().filter(|(_, item)| item.bounds.is_some());
        let bounded: Vec<u32> = bounded.map(|(index, _)| index as u32).collect();
        // The binary tree ends here, before the tables are moved: it takes more memory than they do.
        let tree = on_all_processors(|| Builder::new(items, bounded).tree());
        let visits_when_built = tree.visits();
        Bvh8 {
            heads: in_huge_pages(tree.leaves.iter().map(Leaf::head).collect()),
            nodes: in_huge_pages(tree.nodes),
            leaves: in_huge_pages(tree.leaves),
            visits_when_built,
            ..tree
        }
    }
}

impl Boundable for Item {
    fn aabb(&self) -> Aabb {
        let Bounds { min, max } = self.bounds.unwrap_or(Bounds::EMPTY);
        Aabb::new(min.into(), max.into())
    }
}

fn binary_tree(items: &[Item], bounded: &[u32]) -> Bvh2 {
    let boxes: Cow<'_, [Item]> = match bounded.len() == items.len() {
        true => Cow::Borrowed(items),
        false => bounded.iter().map(|index| items[*index as usize]).collect(),
    };
    // There is no second pass of reinsertion after collapsing: it would double the build time, and random rays would
    // visit as many nodes.
    let ratio = REINSERTED_NODES / boxes.len().max(1) as f32;
    let parameters = BvhBuildParams {
        max_prims_per_leaf: 1,
        reinsertion_batch_ratio: ratio.clamp(MIN_REINSERTED, 1.0),
        ..BvhBuildParams::fast_build()
    };
    if boxes.is_empty() {
        return Bvh2::default();
    }
    build_bvh2(&boxes[..], parameters, &mut Duration::default())
}

struct Builder<'a> {
    items: &'a [Item],
    binary: Bvh2,
    plan: CollapsePlan,
    /// The indices of the items with bounds, in the order of the binary tree's primitives.
    bounded: Vec<u32>,
    /// The number of leaves of each class so far.
    leaves_of_class: BTreeMap<u32, u32>,
    tree: Bvh8,
}

/// A node of the binary tree whose counterpart is to be linked into its parent.
struct Link {
    /// The index of the node in the binary tree.
    source: usize,
    /// The index of the parent and the child's slot there; `None` for the root.
    parent: Option<(usize, usize)>,
}

/// An item below the child `slot` of a node.
#[derive(Clone, Copy)]
struct LeafItem {
    item: u32,
    slot: usize,
}

impl<'a> Builder<'a> {
    fn new(items: &'a [Item], bounded: Vec<u32>) -> Builder<'a> {
        let binary = binary_tree(items, &bounded);
        Builder {
            items,
            plan: CollapsePlan::new(&binary),
            binary,
            bounded,
            leaves_of_class: BTreeMap::new(),
            tree: Bvh8::default(),
        }
    }

    fn tree(mut self) -> Bvh8 {
        self.fold();
        self.add_unbounded();
        let Builder { mut tree, .. } = self;
        tree.bound_nodes();
        tree.count_classes();
        tree.measure_depth();
        tree
    }

    fn fold(&mut self) {
        if self.bounded.is_empty() {
            return;
        }
        if self.plan.is_leaf(&self.binary, 0) {
            let mut items = Vec::new();
            self.add_items(0, |item| items.push(item));
            self.tree.root = Some(Child::leaf(0));
            self.add_leaves(items);
            return;
        }
        let (mut sources, mut leaf_items) = (Vec::new(), Vec::new());
        let mut stack = vec![Link { source: 0, parent: None }];
        while let Some(Link { source, parent }) = stack.pop() {
            let index = self.tree.nodes.len();
            match parent {
                Some((node, slot)) => {
                    self.tree.nodes[node].children[slot] = Child::node(index as u32);
                }
                None => self.tree.root = Some(Child::node(index as u32)),
            }
            sources.clear();
            self.plan.add_children(&self.binary, source, &mut sources);
            self.tree.nodes.push(Node8 { count: sources.len() as u32, ..Node8::EMPTY });
            for (slot, source) in sources.iter().enumerate() {
                if self.plan.is_leaf(&self.binary, *source) {
                    self.add_leaf(index, slot, *source, &mut leaf_items);
                }
            }
            self.place(index, &mut leaf_items);
            let inner = sources.iter().enumerate().rev();
            let inner = inner.filter(|(_, source)| !self.plan.is_leaf(&self.binary, **source));
            stack.extend(
                inner.map(|(slot, source)| Link { source: *source, parent: Some((index, slot)) }),
            );
        }
    }

    /// Adds the items of a leaf child to those of its node that are not stored yet. Leaf children of one node share a
    /// `Leaf` if they fit: this takes less memory, and a ray that meets several of them tests their items by one call.
    fn add_leaf(&mut self, node: usize, slot: usize, source: usize, waiting: &mut Vec<LeafItem>) {
        let before = waiting.len();
        self.add_items(source, |item| waiting.push(LeafItem { item, slot }));
        let class = |it: &LeafItem| self.items[it.item as usize].class;
        let fits =
            waiting.len() <= SIMD_LANES && waiting.iter().all(|it| class(it) == class(&waiting[0]));
        if !fits && before > 0 {
            let rest = waiting.split_off(before);
            self.place(node, waiting);
            *waiting = rest;
        }
    }

    /// Stores the pending items of a node in leaves and links its children to them.
    fn place(&mut self, node: usize, leaves: &mut Vec<LeafItem>) {
        if leaves.is_empty() {
            return;
        }
        let first = self.tree.leaves.len();
        self.add_leaves(leaves.iter().map(|it| it.item).collect());
        let is_one = self.tree.leaves.len() == first + 1;
        for LeafItem { item, slot } in leaves.drain(..) {
            let parent = &mut self.tree.nodes[node];
            parent.children[slot] = Child::leaf(first as u32);
            let position = self.tree.leaves[first].items.iter().position(|it| *it == item);
            let bit = position.filter(|_| is_one).map_or(Node8::ALL_ITEMS, |it| 1 << it);
            parent.items[slot] |= bit;
        }
    }

    /// Calls `add` for each item below a node of the binary tree.
    fn add_items(&self, source: usize, mut add: impl FnMut(u32)) {
        let mut stack = vec![source];
        while let Some(index) = stack.pop() {
            let node = &self.binary.nodes[index];
            let first = node.first_index as usize;
            if node.is_leaf() {
                let positions =
                    &self.binary.primitive_indices[first..first + node.prim_count as usize];
                positions.iter().for_each(|position| add(self.bounded[*position as usize]));
            } else {
                stack.extend([first, first + 1]);
            }
        }
    }

    /// Appends a run of leaves with these items.
    fn add_leaves(&mut self, mut items: Vec<u32>) {
        let class = |item: &u32| self.items[*item as usize].class;
        items.sort_unstable_by_key(|item| (class(item), *item));
        let runs: Vec<&[u32]> = items.chunk_by(|a, b| class(a) == class(b)).collect();
        for run in runs.into_iter().flat_map(|run| run.chunks(SIMD_LANES)) {
            let leaf = self.new_leaf(run);
            self.tree.leaves.push(leaf);
        }
        if let Some(last) = self.tree.leaves.last_mut() {
            last.is_last = true;
        }
    }

    fn new_leaf(&mut self, items: &[u32]) -> Leaf {
        const BOUNDLESS: Bounds = Bounds { min: [f32::NEG_INFINITY; 3], max: [f32::INFINITY; 3] };
        let class = self.items[items[0] as usize].class;
        let index_in_class = self.leaves_of_class.entry(class).or_default();
        *index_in_class += 1;
        let mut leaf = Leaf {
            boxes: Boxes::EMPTY,
            items: [items[0]; SIMD_LANES],
            index_in_class: *index_in_class - 1,
            class,
            count: items.len() as u8,
            is_last: false,
        };
        for (index, item) in items.iter().enumerate() {
            leaf.items[index] = *item;
            let bounds = self.items[*item as usize].bounds;
            leaf.boxes.set(index, &bounds.unwrap_or(BOUNDLESS));
        }
        leaf
    }

    fn add_unbounded(&mut self) {
        self.tree.first_unbounded = self.tree.leaves.len() as u32;
        let unbounded = self.items.iter().enumerate().filter(|(_, item)| item.bounds.is_none());
        let unbounded: Vec<u32> = unbounded.map(|(index, _)| index as u32).collect();
        if !unbounded.is_empty() {
            self.add_leaves(unbounded);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_estimated_before_the_build() {
        // Triangles of a saddle, and boxes in disorder.
        let surface = |index: usize| {
            let (x, y) = ((index % 100) as f32, (index / 100) as f32);
            let z = 0.01 * (x - 50.0) * (y - 50.0);
            ([x, y, z], [x + 1.0, y + 1.0, z + 0.3])
        };
        let disorder = |index: usize| {
            let part = |prime: usize| (index * prime % 9973) as f32;
            let min = [part(7919), part(6007), part(4513)];
            (min, min.map(|it| it + 40.0))
        };
        let kinds = [(surface as fn(usize) -> ([f32; 3], [f32; 3]), 0.7), (disorder, 0.25)];
        for (item, least) in kinds {
            let items: Vec<Item> = (0..9000)
                .map(|index| {
                    let (min, max) = item(index);
                    Item { bounds: Bounds::new(min, max), class: 0 }
                })
                .collect();
            let tree = Bvh8::build(&items);
            let taken = Amount::of::<Leaf>(tree.leaves.len())
                + Amount::of::<LeafHead>(tree.heads.len())
                + Amount::of::<Node8>(tree.nodes.len());
            let ratio = Bvh8::estimated_memory(items.len()).0 as f64 / taken.0 as f64;
            assert!((least..1.4).contains(&ratio), "{ratio}");
        }
    }
}
