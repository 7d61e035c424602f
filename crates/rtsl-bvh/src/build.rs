//! Construction of the hierarchy: a library builds a binary BVH, which is collapsed into one with eight children a
//! node.
//!
//! The library's builder (parallel locally-ordered clustering, then reinsertion) is deterministic on any number of
//! threads. The module `collapse` chooses the subtrees that become leaves of at most eight items. The nodes near the
//! root are made first; the subtrees below them, which all threads make at once, follow one another.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::time::Duration;

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};
use rayon::prelude::*;
use rtsl_math::SIMD_LANES;
use rtsl_memory::{Amount, in_huge_pages, on_all_processors, with_capacity_in_huge_pages};

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
        let (top, subtrees) = on_all_processors(|| parts(items, &bounded));
        let mut tree = add_unbounded(joined(top, subtrees), items);
        tree.count_classes();
        tree.measure_depth();
        let visits_when_built = tree.visits();
        let heads = in_huge_pages(tree.leaves.iter().map(Leaf::head).collect());
        Bvh8 { heads, visits_when_built, ..tree }
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

/// The least number of items of a tree in parts.
const MIN_IN_PARTS: usize = 1 << 14;

/// The depth of the nodes at which subtrees become parts, from the root on: some hundreds, for many threads.
const DEPTH_OF_PARTS: u32 = 3;

/// Returns the nodes near the root, and the subtrees below them. What is in which part depends on the items alone.
fn parts<'a>(items: &'a [Item], bounded: &[u32]) -> (Builder<'a>, Vec<Builder<'a>>) {
    let binary = binary_tree(items, bounded);
    let plan = CollapsePlan::new(&binary);
    let source = Source { binary: &binary, plan: &plan, bounded };
    let mut top = Builder::new(items);
    if bounded.is_empty() {
        return (top, Vec::new());
    }
    let depth = if items.len() < MIN_IN_PARTS { u32::MAX } else { DEPTH_OF_PARTS };
    top.fold(source, 0, depth);
    let subtree = |open: &OpenChild| {
        let mut subtree = Builder::new(items);
        subtree.fold(source, open.source, u32::MAX);
        subtree.tree.bound_nodes();
        subtree
    };
    let subtrees = top.open.par_iter().map(subtree).collect();
    (top, subtrees)
}

/// Returns the tree of parts, in which the subtrees follow the nodes near the root in order.
fn joined(top: Builder<'_>, subtrees: Vec<Builder<'_>>) -> Bvh8 {
    let parts = || std::iter::once(&top).chain(&subtrees).map(|part| &part.tree);
    let count = |of: fn(&Bvh8) -> usize| parts().map(of).sum();
    let mut nodes = with_capacity_in_huge_pages(count(|tree| tree.nodes.len()));
    let mut leaves = with_capacity_in_huge_pages(count(|tree| tree.leaves.len()));
    let (top_nodes, root, open) = (top.tree.nodes.len(), top.tree.root, top.open.clone());
    let mut leaves_of_class: BTreeMap<u32, u32> = BTreeMap::new();
    let mut roots = Vec::with_capacity(subtrees.len());
    for Builder { tree, leaves_of_class: of_part, .. } in std::iter::once(top).chain(subtrees) {
        let (first_node, first_leaf) = (nodes.len() as u32, leaves.len() as u32);
        roots.push(Child::node(first_node));
        nodes.extend(tree.nodes.into_iter().map(|mut node| {
            for child in &mut node.children[..node.count as usize] {
                *child = child.after(first_node, first_leaf);
            }
            node
        }));
        leaves.extend(tree.leaves.into_iter().map(|leaf| {
            let before = leaves_of_class.get(&leaf.class).copied().unwrap_or(0);
            Leaf { index_in_class: before + leaf.index_in_class, ..leaf }
        }));
        of_part.into_iter().for_each(|(class, count)| {
            *leaves_of_class.entry(class).or_default() += count;
        });
    }
    for (OpenChild { node, slot, .. }, root) in open.iter().zip(&roots[1..]) {
        nodes[*node].children[*slot] = *root;
    }
    let mut tree = Bvh8 { nodes, leaves, root, ..Bvh8::default() };
    tree.bound_first_nodes(top_nodes);
    tree
}

/// Appends the items without bounds.
fn add_unbounded(tree: Bvh8, items: &[Item]) -> Bvh8 {
    let mut builder = Builder { tree, ..Builder::new(items) };
    builder.tree.first_unbounded = builder.tree.leaves.len() as u32;
    let unbounded = items.iter().enumerate().filter(|(_, item)| item.bounds.is_none());
    let unbounded: Vec<u32> = unbounded.map(|(index, _)| index as u32).collect();
    if !unbounded.is_empty() {
        for leaf in &builder.tree.leaves {
            *builder.leaves_of_class.entry(leaf.class).or_default() += 1;
        }
        builder.add_leaves(unbounded);
    }
    builder.tree
}

/// The binary tree with the plan for it.
#[derive(Clone, Copy)]
struct Source<'a> {
    binary: &'a Bvh2,
    plan: &'a CollapsePlan,
    /// The indices of the items with bounds, in the order of the binary tree's primitives.
    bounded: &'a [u32],
}

/// Makes a part of the tree.
struct Builder<'a> {
    items: &'a [Item],
    /// The number of leaves of each class so far.
    leaves_of_class: BTreeMap<u32, u32>,
    tree: Bvh8,
    /// The children that other parts are to be.
    open: Vec<OpenChild>,
}

/// A child of a node that is the root of another part.
#[derive(Clone, Copy)]
struct OpenChild {
    /// The index of the node in the binary tree.
    source: usize,
    /// The index of the parent.
    node: usize,
    /// The child's slot there.
    slot: usize,
}

/// A node of the binary tree whose counterpart is to be linked into its parent.
struct Link {
    /// The index of the node in the binary tree.
    source: usize,
    /// The index of the parent and the child's slot there; `None` for the root.
    parent: Option<(usize, usize)>,
    /// The number of nodes above it in this part.
    depth: u32,
}

/// An item below the child `slot` of a node.
#[derive(Clone, Copy)]
struct LeafItem {
    item: u32,
    slot: usize,
}

impl<'a> Builder<'a> {
    fn new(items: &'a [Item]) -> Builder<'a> {
        let (leaves_of_class, open) = (BTreeMap::new(), Vec::new());
        Builder { items, leaves_of_class, tree: Bvh8::default(), open }
    }

    /// Makes the nodes below one of the binary tree, down to a depth.
    fn fold(&mut self, from: Source<'_>, root: usize, max_depth: u32) {
        let Source { binary, plan, .. } = from;
        if plan.is_leaf(binary, root) {
            self.tree.root = Some(Child::leaf(0));
            self.add_leaves(from.items(root).collect());
            return;
        }
        let (mut sources, mut leaf_items) = (Vec::new(), Vec::new());
        let mut stack = vec![Link { source: root, parent: None, depth: 0 }];
        while let Some(Link { source, parent, depth }) = stack.pop() {
            let index = self.tree.nodes.len();
            match parent {
                Some((node, slot)) if depth == max_depth => {
                    self.open.push(OpenChild { source, node, slot });
                    continue;
                }
                Some((node, slot)) => {
                    self.tree.nodes[node].children[slot] = Child::node(index as u32);
                }
                None => self.tree.root = Some(Child::node(index as u32)),
            }
            sources.clear();
            plan.add_children(binary, source, &mut sources);
            self.tree.nodes.push(Node8 { count: sources.len() as u32, ..Node8::EMPTY });
            for (slot, source) in sources.iter().enumerate() {
                if plan.is_leaf(binary, *source) {
                    self.add_leaf(index, slot, from.items(*source), &mut leaf_items);
                }
            }
            self.place(index, &mut leaf_items);
            let inner = sources.iter().enumerate().rev();
            let inner = inner.filter(|(_, source)| !plan.is_leaf(binary, **source));
            stack.extend(inner.map(|(slot, source)| Link {
                source: *source,
                parent: Some((index, slot)),
                depth: depth + 1,
            }));
        }
    }

    /// Adds the items of a leaf child to those of its node that are not stored yet. Leaf children of one node share a
    /// `Leaf` if they fit: this takes less memory, and a ray that meets several of them tests their items by one call.
    fn add_leaf(
        &mut self,
        node: usize,
        slot: usize,
        items: impl Iterator<Item = u32>,
        waiting: &mut Vec<LeafItem>,
    ) {
        let before = waiting.len();
        waiting.extend(items.map(|item| LeafItem { item, slot }));
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
}

impl Source<'_> {
    /// Returns the items below a node of the binary tree.
    fn items(&self, node: usize) -> impl Iterator<Item = u32> {
        let Source { binary, bounded, .. } = *self;
        let mut stack = vec![node];
        let nodes = std::iter::from_fn(move || {
            loop {
                let node = &binary.nodes[stack.pop()?];
                let first = node.first_index as usize;
                if node.is_leaf() {
                    return Some(first..first + node.prim_count as usize);
                }
                stack.extend([first, first + 1]);
            }
        });
        nodes.flatten().map(move |index| bounded[binary.primitive_indices[index] as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Small boxes in disorder, of three classes; each hundredth without bounds.
    fn disorder(count: usize) -> Vec<Item> {
        let item = |index: usize| {
            let part = |prime: usize| (index * prime % 9973) as f32;
            let min = [part(7919), part(6007), part(4513)];
            let bounds = Bounds::new(min, min.map(|it| it + 40.0));
            Item { bounds: bounds.filter(|_| index % 100 != 7), class: (index % 3) as u32 }
        };
        (0..count).map(item).collect()
    }

    #[test]
    fn a_tree_of_parts_has_each_item_once_in_the_boxes_above_it() {
        for count in [MIN_IN_PARTS - 1, MIN_IN_PARTS, 3 * MIN_IN_PARTS] {
            let items = disorder(count);
            let tree = Bvh8::build(&items);
            let mut seen = vec![0; count];
            let mut of_class = [0; 3];
            for leaf in &tree.leaves {
                assert_eq!(leaf.index_in_class, of_class[leaf.class as usize]);
                of_class[leaf.class as usize] += 1;
                leaf.items().iter().for_each(|item| seen[*item as usize] += 1);
            }
            assert!(seen.iter().all(|count| *count == 1));
            let mut reached = vec![false; tree.nodes.len()];
            let mut stack = vec![(tree.root.unwrap(), Node8::ALL_ITEMS, tree.bounds)];
            while let Some((child, which, outer)) = stack.pop() {
                if child.is_leaf() {
                    for leaf in tree.leaf_run(child.index()) {
                        let boxes = leaf.boxes.union(which, usize::from(leaf.count));
                        assert_eq!(outer.union(&boxes), outer);
                    }
                    continue;
                }
                let node = &tree.nodes[child.index()];
                assert!(!std::mem::replace(&mut reached[child.index()], true));
                for slot in 0..node.count as usize {
                    let bounds = node.boxes.get(slot);
                    assert_eq!(outer.union(&bounds), outer);
                    assert!(
                        node.children[slot].is_leaf()
                            || node.children[slot].index() > child.index()
                    );
                    stack.push((node.children[slot], node.items[slot], bounds));
                }
            }
            assert!(reached.iter().all(|reached| *reached));
        }
    }

    #[test]
    fn threads_do_not_matter() {
        let items = disorder(2 * MIN_IN_PARTS);
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let [one, many] = [1, 7].map(|threads| {
            let bounded: Vec<u32> =
                (0..items.len() as u32).filter(|it| items[*it as usize].bounds.is_some()).collect();
            pool(threads).install(|| {
                let (top, subtrees) = parts(&items, &bounded);
                joined(top, subtrees)
            })
        });
        assert_eq!(format!("{:?}", one.nodes), format!("{:?}", many.nodes));
        assert_eq!(format!("{:?}", one.leaves), format!("{:?}", many.leaves));
    }

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
