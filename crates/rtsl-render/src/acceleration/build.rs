//! Building the hierarchy: a library makes a binary tree, which is folded into one of wide nodes.
//!
//! The library's builder (parallel locally-ordered clustering, then reinsertion) is
//! deterministic, on any number of threads. Folding opens the largest child of a node until there
//! are eight, as Wald, Benthin and Boulos do ("Getting Rid of Packets", 2008, section 4); a subtree
//! of at most eight items becomes a leaf, since one test of eight objects costs about what one of
//! eight boxes does.

use std::collections::BTreeMap;
use std::time::Duration;

use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use super::bounds::Bounds;
use super::wide_tree::{Block, Boxes, Child, Item, WIDTH, WideNode, WideTree};

impl WideTree {
    /// Over items, which are numbered in their order.
    pub fn build(items: &[Item]) -> WideTree {
        let bounded = items.iter().enumerate().filter(|(_, item)| item.bounds.is_some());
        let numbers: Vec<u32> = bounded.map(|(number, _)| number as u32).collect();
        let mut builder = Builder {
            items,
            binary: binary_tree(items, &numbers),
            numbers,
            items_below: Vec::new(),
            blocks_of_class: BTreeMap::new(),
            tree: WideTree::default(),
        };
        builder.fold();
        builder.add_unbounded();
        builder.tree.bound_nodes();
        builder.tree.visits_when_built = builder.tree.visits();
        builder.tree
    }
}

fn binary_tree(items: &[Item], numbers: &[u32]) -> Bvh2 {
    let own_box = |number: &u32| items[*number as usize].bounds.unwrap_or(Bounds::EMPTY);
    let boxes = numbers.iter().map(own_box);
    let boxes: Vec<Aabb> =
        boxes.map(|bounds| Aabb::new(bounds.min.into(), bounds.max.into())).collect();
    // Leaves are made in folding.
    let parameters = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
    if boxes.is_empty() {
        return Bvh2::default();
    }
    build_bvh2(&boxes, parameters, &mut Duration::default())
}

struct Builder<'a> {
    items: &'a [Item],
    binary: Bvh2,
    /// The items with bounds, as the binary tree counts them.
    numbers: Vec<u32>,
    /// For each node of the binary tree.
    items_below: Vec<u32>,
    /// How many blocks each class has so far.
    blocks_of_class: BTreeMap<u32, u32>,
    tree: WideTree,
}

/// A node whose child is to be set.
struct Link {
    /// The node of the binary tree that the child is made of.
    source: usize,
    /// The parent and which child; `None` for the root.
    parent: Option<(usize, usize)>,
}

impl Builder<'_> {
    fn fold(&mut self) {
        if self.numbers.is_empty() {
            return;
        }
        self.count_items();
        let mut stack = vec![Link { source: 0, parent: None }];
        while let Some(Link { source, parent }) = stack.pop() {
            let child = if self.items_below[source] as usize <= WIDTH {
                self.add_leaf(source)
            } else {
                let index = self.tree.nodes.len();
                let sources = self.open(source);
                let children = [Child::node(0); WIDTH];
                let count = sources.len() as u32;
                self.tree.nodes.push(WideNode { boxes: Boxes::EMPTY, children, count });
                let links = sources.into_iter().enumerate().rev();
                stack.extend(
                    links.map(|(slot, source)| Link { source, parent: Some((index, slot)) }),
                );
                Child::node(index as u32)
            };
            match parent {
                Some((node, slot)) => self.tree.nodes[node].children[slot] = child,
                None => self.tree.root = Some(child),
            }
        }
    }

    fn count_items(&mut self) {
        let nodes = &self.binary.nodes;
        self.items_below = vec![0; nodes.len()];
        let mut stack = vec![(0_usize, false)];
        while let Some((index, children_done)) = stack.pop() {
            let node = &nodes[index];
            let first = node.first_index as usize;
            if node.is_leaf() {
                self.items_below[index] = node.prim_count;
            } else if children_done {
                self.items_below[index] = self.items_below[first] + self.items_below[first + 1];
            } else {
                stack.extend([(index, true), (first, false), (first + 1, false)]);
            }
        }
    }

    /// The nodes of the binary tree that become the children of one that is made of `source`.
    fn open(&self, source: usize) -> Vec<usize> {
        let mut children = Vec::with_capacity(WIDTH);
        let first = self.binary.nodes[source].first_index as usize;
        children.extend([first, first + 1]);
        while children.len() < WIDTH {
            let can_open = |index: &usize| self.items_below[children[*index]] as usize > WIDTH;
            let area = |index: &usize| self.binary.nodes[children[*index]].aabb().half_area();
            let largest = (0..children.len())
                .filter(can_open)
                .max_by(|a, b| area(a).total_cmp(&area(b)).then(b.cmp(a)));
            let Some(index) = largest else { break };
            let first = self.binary.nodes[children[index]].first_index as usize;
            children[index] = first;
            children.insert(index + 1, first + 1);
        }
        children
    }

    fn add_leaf(&mut self, source: usize) -> Child {
        let mut items = Vec::with_capacity(WIDTH);
        let mut stack = vec![source];
        while let Some(index) = stack.pop() {
            let node = &self.binary.nodes[index];
            let first = node.first_index as usize;
            if node.is_leaf() {
                let positions =
                    &self.binary.primitive_indices[first..first + node.prim_count as usize];
                items.extend(positions.iter().map(|position| self.numbers[*position as usize]));
            } else {
                stack.extend([first, first + 1]);
            }
        }
        let first = self.tree.blocks.len() as u32;
        self.add_blocks(items);
        Child::leaf(first)
    }

    /// Adds the blocks of a leaf of these items.
    fn add_blocks(&mut self, mut items: Vec<u32>) {
        let class = |item: &u32| self.items[*item as usize].class;
        items.sort_unstable_by_key(|item| (class(item), *item));
        let runs: Vec<&[u32]> = items.chunk_by(|a, b| class(a) == class(b)).collect();
        for run in runs.into_iter().flat_map(|run| run.chunks(WIDTH)) {
            let block = self.block(run);
            self.tree.blocks.push(block);
        }
        if let Some(last) = self.tree.blocks.last_mut() {
            last.is_last = true;
        }
    }

    fn block(&mut self, items: &[u32]) -> Block {
        const BOUNDLESS: Bounds = Bounds { min: [f32::NEG_INFINITY; 3], max: [f32::INFINITY; 3] };
        let class = self.items[items[0] as usize].class;
        let of_class = self.blocks_of_class.entry(class).or_default();
        *of_class += 1;
        let mut block = Block {
            boxes: Boxes::EMPTY,
            items: [items[0]; WIDTH],
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
