//! A bounding volume hierarchy whose nodes have up to eight children and whose leaves have up to eight items.
//!
//! Packets and single rays traverse the same tree. A single ray is tested against the eight boxes of a node at once; a
//! packet is tested against them with the interval that bounds its rays, then against each remaining box ray by ray.

use rtsl_math::SIMD_LANES;
use rtsl_memory::prefetch_values;

use super::bounds::Bounds;

/// A tree over items, which are identified by their index.
///
/// ```
/// use rtsl_bvh::{Bounds, Bvh8, Item};
///
/// let cube = |x: f32| Bounds::new([x, 0.0, 0.0], [x + 1.0, 1.0, 1.0]);
/// let items = (0..100).map(|index| Item { bounds: cube(2.0 * index as f32), class: 0 });
/// let tree = Bvh8::build(&items.collect::<Vec<_>>());
/// assert_eq!((tree.bounds.min, tree.bounds.max), ([0.0; 3], [199.0, 1.0, 1.0]));
/// let known: u32 = tree.leaves.iter().map(|leaf| u32::from(leaf.count)).sum();
/// assert_eq!(known, 100);
/// ```
#[derive(Clone, Debug, Default)]
pub struct Bvh8 {
    /// The nodes, parents before their children.
    pub nodes: Vec<Node8>,
    /// The leaves. Each leaf child of a node refers to a run of them, which ends with the first leaf for which
    /// `is_last` is true. The items without bounds come last.
    pub leaves: Vec<Leaf>,
    /// The head of each leaf.
    pub heads: Vec<LeafHead>,
    /// The root; `None` if no item has bounds.
    pub root: Option<Child>,
    /// The box of all items with bounds.
    pub bounds: Bounds,
    /// The index of the first leaf of items without bounds.
    pub first_unbounded: u32,
    /// The number of classes of items, [`INSTANCE`] not counted.
    pub classes: u32,
    /// The greatest number of nodes on a path from the root to a leaf.
    pub depth: usize,
    /// The value of [`Bvh8::visits`] right after the build.
    pub(super) visits_when_built: f64,
}

/// Eight boxes in structure-of-arrays form.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Boxes {
    /// The minima, axis by axis, then the maxima.
    pub planes: [[f32; SIMD_LANES]; 6],
}

/// A node.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Node8 {
    /// The exact unions of the items' own boxes below each child.
    pub boxes: Boxes,
    /// The children.
    pub children: [Child; SIMD_LANES],
    /// For each leaf child, a mask of the items of its leaf that belong to it, because leaf children of one node may
    /// share a leaf. All ones if the child has several leaves.
    pub items: [u8; SIMD_LANES],
    /// The number of children.
    pub count: u32,
}

/// A reference to a node or to a run of leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Child(u32);

/// Up to eight items of one class, in ascending order.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    /// The items' own boxes; infinite for items without bounds.
    pub boxes: Boxes,
    /// The items.
    pub items: [u32; SIMD_LANES],
    /// The index of this leaf among those of its class.
    pub index_in_class: u32,
    /// The class of the items: see [`Item`].
    pub class: u32,
    /// The number of items.
    pub count: u8,
    /// True if this is the last leaf of its run.
    pub is_last: bool,
}

/// The part of a leaf that is read for a ray that hits none of its items. Heads are stored apart from the boxes, which
/// are much larger, so that caches hold them.
#[derive(Clone, Copy, Debug)]
pub struct LeafHead {
    /// See [`Leaf::index_in_class`].
    pub index_in_class: u32,
    /// See [`Leaf::class`].
    pub class: u32,
    /// See [`Leaf::count`].
    pub count: u8,
    /// See [`Leaf::is_last`].
    pub is_last: bool,
}

/// An input of the build.
#[derive(Clone, Copy, Debug)]
pub struct Item {
    /// The item's own box; `None` if it is unbounded.
    pub bounds: Option<Bounds>,
    /// The class of the item. All items of a leaf have one class, so that one call can test them.
    pub class: u32,
}

/// The class of items that are instances.
pub const INSTANCE: u32 = u32::MAX;

impl Child {
    const LEAF: u32 = 1 << 31;

    /// Returns the reference to the node with this index.
    pub const fn node(index: u32) -> Self {
        Child(index)
    }

    /// Returns the reference to the run that begins with the leaf of this index.
    pub const fn leaf(leaf: u32) -> Self {
        Child(leaf | Child::LEAF)
    }

    /// Returns the reference in tables in which so many nodes and leaves come before.
    pub(super) const fn after(self, nodes: u32, leaves: u32) -> Self {
        Child(self.0 + if self.is_leaf() { leaves } else { nodes })
    }

    /// Neither a node nor a leaf: the end of a traversal stack.
    pub const END: Child = Child::node(Child::LEAF - 1);

    /// True if this is a node.
    #[inline(always)]
    pub const fn is_node(self) -> bool {
        self.0 < Child::END.0
    }

    /// Returns the encoded reference.
    #[inline(always)]
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Decodes a reference.
    #[inline(always)]
    pub const fn from_bits(bits: u32) -> Self {
        Child(bits)
    }

    /// True if this is a leaf.
    #[inline(always)]
    pub const fn is_leaf(self) -> bool {
        self.0 & Child::LEAF != 0
    }

    /// Returns the index of the node, or of the first leaf of the run.
    #[inline(always)]
    pub const fn index(self) -> usize {
        (self.0 & !Child::LEAF) as usize
    }
}

impl Node8 {
    /// A node without children.
    pub const EMPTY: Node8 = Node8 {
        boxes: Boxes::EMPTY,
        children: [Child::END; SIMD_LANES],
        items: [0; SIMD_LANES],
        count: 0,
    };

    /// The mask of all items of a leaf.
    pub const ALL_ITEMS: u8 = 0xFF;
}

impl Leaf {
    /// Returns the leaf's head.
    #[inline(always)]
    pub fn head(&self) -> LeafHead {
        let Leaf { boxes: _, items: _, index_in_class, class, count, is_last } = *self;
        LeafHead { index_in_class, class, count, is_last }
    }

    /// Returns the leaf's items.
    pub fn items(&self) -> &[u32] {
        &self.items[..usize::from(self.count)]
    }
}

impl Boxes {
    /// Eight empty boxes, which no ray meets.
    pub const EMPTY: Boxes = {
        let (least, greatest) = ([f32::INFINITY; SIMD_LANES], [f32::NEG_INFINITY; SIMD_LANES]);
        Boxes { planes: [least, least, least, greatest, greatest, greatest] }
    };

    /// Returns the minima along an axis.
    #[inline(always)]
    pub fn min(&self, axis: usize) -> &[f32; SIMD_LANES] {
        &self.planes[axis]
    }

    /// Returns the maxima along an axis.
    #[inline(always)]
    pub fn max(&self, axis: usize) -> &[f32; SIMD_LANES] {
        &self.planes[3 + axis]
    }

    /// Returns one of the boxes.
    #[inline(always)]
    pub fn get(&self, index: usize) -> Bounds {
        let [x, y, z, far_x, far_y, far_z] = &self.planes;
        Bounds {
            min: [x[index], y[index], z[index]],
            max: [far_x[index], far_y[index], far_z[index]],
        }
    }

    /// Sets one of the boxes.
    pub fn set(&mut self, index: usize, bounds: &Bounds) {
        for axis in 0..3 {
            self.planes[axis][index] = bounds.min[axis];
            self.planes[3 + axis][index] = bounds.max[axis];
        }
    }

    /// Returns the union of the boxes selected by the bits of `which` whose indices are below `count`.
    pub fn union(&self, which: u8, count: usize) -> Bounds {
        let indices = (0..count).filter(|index| which >> index & 1 != 0);
        indices.fold(Bounds::EMPTY, |all, index| all.union(&self.get(index)))
    }
}

impl Bvh8 {
    /// Returns the run of leaves that begins at the index `first`.
    #[inline]
    pub fn leaf_run(&self, first: usize) -> &[Leaf] {
        let rest = &self.leaves[first..];
        let count = rest.iter().position(|leaf| leaf.is_last).map_or(rest.len(), |last| last + 1);
        &rest[..count]
    }

    /// Prefetches a node, or the first leaf of a run. There is no branch, because no processor could predict it.
    #[inline(always)]
    pub(super) fn prefetch(&self, child: Child) {
        const SIZE: usize = size_of::<Node8>();
        const { assert!(size_of::<Leaf>() == SIZE) };
        let node: *const u8 = self.nodes.as_ptr().wrapping_add(child.index()).cast();
        let leaf: *const u8 = self.leaves.as_ptr().wrapping_add(child.index()).cast();
        prefetch_values(if child.is_leaf() { leaf } else { node }, SIZE);
    }

    /// Returns the leaves of the items without bounds.
    pub fn unbounded(&self) -> &[Leaf] {
        &self.leaves[self.first_unbounded as usize..]
    }

    /// Returns the same topology for items that moved since the build, with the boxes of items and nodes computed anew.
    /// Returns `None` if the tree has to be rebuilt: an item gained or lost its bounds, or rays would visit many more
    /// nodes than after the build.
    pub fn refitted(&self, items: &[Item]) -> Option<Bvh8> {
        const MAX_VISITS: f64 = 1.5;
        let is_bounded = |item: &u32| items.get(*item as usize).map(|it| it.bounds.is_some());
        let keep = |leaves: &[Leaf], bounded: bool| {
            let mut items = leaves.iter().flat_map(Leaf::items);
            items.all(|item| is_bounded(item) == Some(bounded))
        };
        let (bounded, unbounded) = self.leaves.split_at(self.first_unbounded as usize);
        if !(keep(bounded, true) && keep(unbounded, false)) {
            return None;
        }
        let mut tree = self.clone();
        for leaf in &mut tree.leaves[..self.first_unbounded as usize] {
            for index in 0..usize::from(leaf.count) {
                let bounds = items[leaf.items[index] as usize].bounds;
                leaf.boxes.set(index, &bounds.unwrap_or_default());
            }
        }
        tree.bound_nodes();
        (tree.visits() <= MAX_VISITS * self.visits_when_built).then_some(tree)
    }

    /// Computes the boxes of nodes from those of items. Nodes are processed backwards, so every child is done before
    /// its parent.
    pub(super) fn bound_nodes(&mut self) {
        self.bound_first_nodes(self.nodes.len());
    }

    /// The same for the first nodes, if the others are done.
    pub(super) fn bound_first_nodes(&mut self, count: usize) {
        for index in (0..count).rev() {
            let node = self.nodes[index];
            for child in 0..node.count as usize {
                let bounds = self.bounds_of(node.children[child], node.items[child]);
                self.nodes[index].boxes.set(child, &bounds);
            }
        }
        self.bounds =
            self.root.map_or(Bounds::EMPTY, |root| self.bounds_of(root, Node8::ALL_ITEMS));
    }

    /// Counts the classes of the items.
    pub(super) fn count_classes(&mut self) {
        let classes = self.leaves.iter().map(|leaf| leaf.class);
        let last = classes.filter(|class| *class != INSTANCE).max();
        self.classes = last.map_or(0, |last| last + 1);
    }

    /// Computes the depth of the tree.
    pub(super) fn measure_depth(&mut self) {
        let mut depths = vec![0; self.nodes.len()];
        for (index, node) in self.nodes.iter().enumerate().rev() {
            let children = node.children[..node.count as usize].iter();
            let below = children.filter(|child| child.is_node()).map(|child| depths[child.index()]);
            depths[index] = 1 + below.max().unwrap_or(0);
        }
        self.depth = depths.first().copied().unwrap_or(0);
    }

    fn bounds_of(&self, child: Child, items: u8) -> Bounds {
        if child.is_leaf() {
            let leaves = self.leaf_run(child.index()).iter();
            let bounds = leaves.map(|leaf| leaf.boxes.union(items, usize::from(leaf.count)));
            bounds.fold(Bounds::EMPTY, |all, bounds| all.union(&bounds))
        } else {
            let node = &self.nodes[child.index()];
            node.boxes.union(Node8::ALL_ITEMS, node.count as usize)
        }
    }

    /// Returns the expected number of children that a ray through the root's box meets, if the probability of meeting a
    /// child is proportional to its surface area.
    pub fn visits(&self) -> f64 {
        let of_node = |node: &Node8| {
            let children = (0..node.count as usize).map(|child| node.boxes.get(child).area());
            children.sum::<f64>()
        };
        self.nodes.iter().map(of_node).sum::<f64>() / self.bounds.area().max(f64::MIN_POSITIVE)
    }
}
