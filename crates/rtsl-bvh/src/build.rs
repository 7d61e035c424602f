//! Building the hierarchy: a library makes a binary tree, which is folded into one of wide nodes.
//!
//! The library's builder (parallel locally-ordered clustering, then reinsertion) is
//! deterministic, on any number of threads. Which of its subtrees become leaves, of at most eight items, is
//! the plan's to say: see the module `collapse`.

use std::collections::BTreeMap;
use std::time::Duration;

use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use rtsl_abi::in_huge_pages;
use rtsl_math::SIMD_LANES;

use super::bounds::Bounds;
use super::bvh8::{Boxes, Bvh8, Child, Item, Leaf, Node8};
use super::collapse::CollapsePlan;

/// About so many nodes the first pass of reinsertion tries to place better, but at least this part of all.
/// In small trees that is all of them, for which rays visit a tenth fewer nodes; a million items take a
/// second that way, and half of that as it is.
const REINSERTED_NODES: f32 = 30_000.0;
const MIN_REINSERTED: f32 = 0.03;

impl Bvh8 {
    /// Over items, which are numbered in their order.
    pub fn build(items: &[Item]) -> Bvh8 {
        let bounded = items.iter().enumerate().filter(|(_, item)| item.bounds.is_some());
        let numbers: Vec<u32> = bounded.map(|(number, _)| number as u32).collect();
        let binary = binary_tree(items, &numbers);
        let mut builder = Builder {
            items,
            plan: CollapsePlan::new(&binary),
            binary,
            numbers,
            blocks_of_class: BTreeMap::new(),
            tree: Bvh8::default(),
        };
        builder.fold();
        builder.add_unbounded();
        builder.tree.bound_nodes();
        builder.tree.count_classes();
        builder.tree.measure_depth();
        let tree = builder.tree;
        let visits_when_built = tree.visits();
        Bvh8 {
            heads: in_huge_pages(tree.blocks.iter().map(Leaf::head).collect()),
            nodes: in_huge_pages(tree.nodes),
            blocks: in_huge_pages(tree.blocks),
            visits_when_built,
            ..tree
        }
    }
}

fn binary_tree(items: &[Item], numbers: &[u32]) -> Bvh2 {
    let own_box = |number: &u32| items[*number as usize].bounds.unwrap_or(Bounds::EMPTY);
    let boxes = numbers.iter().map(own_box);
    let boxes: Vec<Aabb> =
        boxes.map(|bounds| Aabb::new(bounds.min.into(), bounds.max.into())).collect();
    // Leaves are made in folding. After it nothing is reinserted: that takes as long again, and random rays
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
    build_bvh2(&boxes, parameters, &mut Duration::default())
}

struct Builder<'a> {
    items: &'a [Item],
    binary: Bvh2,
    plan: CollapsePlan,
    /// The items with bounds, as the binary tree counts them.
    numbers: Vec<u32>,
    /// How many blocks each class has so far.
    blocks_of_class: BTreeMap<u32, u32>,
    tree: Bvh8,
}

/// A node whose child is to be set.
struct Link {
    /// The node of the binary tree that the child is made of.
    source: usize,
    /// The parent and which child; `None` for the root.
    parent: Option<(usize, usize)>,
}

/// An item of the leaf that is the child `slot` of a node.
#[derive(Clone, Copy)]
struct LeafItem {
    item: u32,
    slot: usize,
}

impl Builder<'_> {
    fn fold(&mut self) {
        if self.numbers.is_empty() {
            return;
        }
        if self.plan.is_leaf(&self.binary, 0) {
            let mut items = Vec::new();
            self.add_items(0, |item| items.push(item));
            self.tree.root = Some(Child::leaf(0));
            self.add_blocks(items);
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

    /// Adds a leaf to those of a node that wait for a block. They share one where they fit: it takes less
    /// memory, and a ray that meets several of them tests their items by one call.
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

    /// Makes the blocks of leaves of a node.
    fn place(&mut self, node: usize, leaves: &mut Vec<LeafItem>) {
        if leaves.is_empty() {
            return;
        }
        let first = self.tree.blocks.len();
        self.add_blocks(leaves.iter().map(|it| it.item).collect());
        let is_one = self.tree.blocks.len() == first + 1;
        for LeafItem { item, slot } in leaves.drain(..) {
            let parent = &mut self.tree.nodes[node];
            parent.children[slot] = Child::leaf(first as u32);
            let position = self.tree.blocks[first].items.iter().position(|it| *it == item);
            let bit = position.filter(|_| is_one).map_or(Node8::ALL_ITEMS, |it| 1 << it);
            parent.items[slot] |= bit;
        }
    }

    /// The items below a node of the binary tree.
    fn add_items(&self, source: usize, mut add: impl FnMut(u32)) {
        let mut stack = vec![source];
        while let Some(index) = stack.pop() {
            let node = &self.binary.nodes[index];
            let first = node.first_index as usize;
            if node.is_leaf() {
                let positions =
                    &self.binary.primitive_indices[first..first + node.prim_count as usize];
                positions.iter().for_each(|position| add(self.numbers[*position as usize]));
            } else {
                stack.extend([first, first + 1]);
            }
        }
    }

    /// Adds the blocks of these items, which are one leaf or several.
    fn add_blocks(&mut self, mut items: Vec<u32>) {
        let class = |item: &u32| self.items[*item as usize].class;
        items.sort_unstable_by_key(|item| (class(item), *item));
        let runs: Vec<&[u32]> = items.chunk_by(|a, b| class(a) == class(b)).collect();
        for run in runs.into_iter().flat_map(|run| run.chunks(SIMD_LANES)) {
            let block = self.block(run);
            self.tree.blocks.push(block);
        }
        if let Some(last) = self.tree.blocks.last_mut() {
            last.is_last = true;
        }
    }

    fn block(&mut self, items: &[u32]) -> Leaf {
        const BOUNDLESS: Bounds = Bounds { min: [f32::NEG_INFINITY; 3], max: [f32::INFINITY; 3] };
        let class = self.items[items[0] as usize].class;
        let of_class = self.blocks_of_class.entry(class).or_default();
        *of_class += 1;
        let mut block = Leaf {
            boxes: Boxes::EMPTY,
            items: [items[0]; SIMD_LANES],
            of_class: *of_class - 1,
            class,
            count: items.len() as u8,
            is_last: false,
        };
        for (index, item) in items.iter().enumerate() {
            block.items[index] = *item;
            let bounds = self.items[*item as usize].bounds;
            block.boxes.set(index, &bounds.unwrap_or(BOUNDLESS));
        }
        block
    }

    fn add_unbounded(&mut self) {
        self.tree.first_unbounded = self.tree.blocks.len() as u32;
        let unbounded = self.items.iter().enumerate().filter(|(_, item)| item.bounds.is_none());
        let unbounded: Vec<u32> = unbounded.map(|(number, _)| number as u32).collect();
        if !unbounded.is_empty() {
            self.add_blocks(unbounded);
        }
    }
}
