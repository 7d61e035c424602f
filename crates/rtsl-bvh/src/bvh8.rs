//! The hierarchy: nodes of up to eight children, leaves of up to eight items.
//!
//! One tree serves packets and single rays. A ray alone tests the eight boxes of a node at once; a
//! packet tests them with the interval that holds its rays, then each that is left with every ray.

use rtsl_math::SIMD_LANES;

use super::bounds::Bounds;
use super::geometry::INSTANCE;

/// A tree over items, which are numbers.
#[derive(Clone, Debug, Default)]
pub struct Bvh8 {
    /// The nodes, parents before their children.
    pub nodes: Vec<Node8>,
    /// The blocks of items, leaf after leaf; those of items without bounds at the end.
    pub blocks: Vec<Leaf>,
    /// The head of each block.
    pub heads: Vec<LeafHead>,
    /// Where the walk begins; `None` if no item has bounds.
    pub root: Option<Child>,
    /// The box of all items with bounds.
    pub bounds: Bounds,
    /// The first block of items without bounds.
    pub first_unbounded: u32,
    /// How many classes its items have; instances have none.
    pub classes: u32,
    /// The most nodes on a way from the root to a leaf.
    pub depth: usize,
    /// What [`Bvh8::visits`] was when it was built.
    pub(super) visits_when_built: f64,
}

/// Eight boxes, coordinate by coordinate.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Boxes {
    /// The least coordinates, axis by axis, then the greatest.
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
    /// Of each child that is a leaf, the items of its block that are its own, as bits: leaves of a node share
    /// blocks. All where the leaf has several blocks.
    pub items: [u8; SIMD_LANES],
    /// How many children there are.
    pub count: u32,
}

/// A node or a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Child(u32);

/// Items of one class, in ascending order.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    /// The items' own boxes; boundless for items without bounds.
    pub boxes: Boxes,
    /// The items.
    pub items: [u32; SIMD_LANES],
    /// The number of this block among those of its class.
    pub of_class: u32,
    /// What the items have in common: see [`Item`].
    pub class: u32,
    /// How many items there are.
    pub count: u8,
    /// Whether it is the last of its leaf.
    pub is_last: bool,
}

/// What a ray reads of a block that it does not hit. These lie apart from the boxes, which are much more, so
/// that caches hold them.
#[derive(Clone, Copy, Debug)]
pub struct LeafHead {
    /// As in the [`Leaf`].
    pub of_class: u32,
    /// As in the [`Leaf`].
    pub class: u32,
    /// As in the [`Leaf`].
    pub count: u8,
    /// As in the [`Leaf`].
    pub is_last: bool,
}

/// What a tree is built over.
#[derive(Clone, Copy, Debug)]
pub struct Item {
    /// Its own box; `None` where it is unbounded.
    pub bounds: Option<Bounds>,
    /// Blocks hold items of one class only, so that one call can test all of them.
    pub class: u32,
}

impl Child {
    const LEAF: u32 = 1 << 31;

    /// The node with this number.
    pub const fn node(index: u32) -> Self {
        Child(index)
    }

    /// The leaf that begins with this block.
    pub const fn leaf(block: u32) -> Self {
        Child(block | Child::LEAF)
    }

    /// Neither: there is nothing left to visit.
    pub const END: Child = Child::node(Child::LEAF - 1);

    /// Whether it is a node.
    #[inline(always)]
    pub const fn is_node(self) -> bool {
        self.0 < Child::END.0
    }

    /// As a number of its own.
    #[inline(always)]
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// The child with these bits.
    #[inline(always)]
    pub const fn from_bits(bits: u32) -> Self {
        Child(bits)
    }

    /// Whether it is a leaf.
    #[inline(always)]
    pub const fn is_leaf(self) -> bool {
        self.0 & Child::LEAF != 0
    }

    /// The number of the node, or of the leaf's first block.
    #[inline(always)]
    pub const fn index(self) -> usize {
        (self.0 & !Child::LEAF) as usize
    }
}

impl Node8 {
    /// No children.
    pub const EMPTY: Node8 = Node8 {
        boxes: Boxes::EMPTY,
        children: [Child::node(0); SIMD_LANES],
        items: [0; SIMD_LANES],
        count: 0,
    };

    /// All items of a block.
    pub const ALL_ITEMS: u8 = 0xFF;
}

impl Leaf {
    /// What a ray reads of it first.
    pub fn head(&self) -> LeafHead {
        let Leaf { boxes: _, items: _, of_class, class, count, is_last } = *self;
        LeafHead { of_class, class, count, is_last }
    }

    /// Its items.
    pub fn items(&self) -> &[u32] {
        &self.items[..usize::from(self.count)]
    }
}

impl Boxes {
    /// No boxes: such as no ray meets.
    pub const EMPTY: Boxes = {
        let (least, greatest) = ([f32::INFINITY; SIMD_LANES], [f32::NEG_INFINITY; SIMD_LANES]);
        Boxes { planes: [least, least, least, greatest, greatest, greatest] }
    };

    /// The least coordinates along an axis.
    #[inline(always)]
    pub fn min(&self, axis: usize) -> &[f32; SIMD_LANES] {
        &self.planes[axis]
    }

    /// The greatest coordinates along an axis.
    #[inline(always)]
    pub fn max(&self, axis: usize) -> &[f32; SIMD_LANES] {
        &self.planes[3 + axis]
    }

    /// One of the boxes.
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

    /// The smallest box that holds those of `which`, as bits, that are below `count`.
    pub fn union(&self, which: u8, count: usize) -> Bounds {
        let indices = (0..count).filter(|index| which >> index & 1 != 0);
        indices.fold(Bounds::EMPTY, |all, index| all.union(&self.get(index)))
    }
}

impl Bvh8 {
    /// The blocks of a leaf.
    pub fn leaf(&self, first: usize) -> &[Leaf] {
        let rest = &self.blocks[first..];
        let count = rest.iter().position(|block| block.is_last).map_or(rest.len(), |last| last + 1);
        &rest[..count]
    }

    /// The blocks of items without bounds.
    pub fn unbounded(&self) -> &[Leaf] {
        &self.blocks[self.first_unbounded as usize..]
    }

    /// The tree for items that moved since it was built: with their boxes, and those of nodes computed
    /// anew. `None` where it does not serve any more: an item got bounds or lost them, or rays would visit
    /// many more nodes than when it was built.
    pub fn refitted(&self, items: &[Item]) -> Option<Bvh8> {
        const MAX_VISITS: f64 = 1.5;
        let is_bounded = |item: &u32| items.get(*item as usize).map(|it| it.bounds.is_some());
        let keep = |blocks: &[Leaf], bounded: bool| {
            let mut items = blocks.iter().flat_map(Leaf::items);
            items.all(|item| is_bounded(item) == Some(bounded))
        };
        let (bounded, unbounded) = self.blocks.split_at(self.first_unbounded as usize);
        if !(keep(bounded, true) && keep(unbounded, false)) {
            return None;
        }
        let mut tree = self.clone();
        for block in &mut tree.blocks[..self.first_unbounded as usize] {
            for index in 0..usize::from(block.count) {
                let bounds = items[block.items[index] as usize].bounds;
                block.boxes.set(index, &bounds.unwrap_or_default());
            }
        }
        tree.bound_nodes();
        (tree.visits() <= MAX_VISITS * self.visits_when_built).then_some(tree)
    }

    /// Computes the boxes of nodes from those of items. Backwards, every child is done before its
    /// parent.
    pub(super) fn bound_nodes(&mut self) {
        for index in (0..self.nodes.len()).rev() {
            let node = self.nodes[index];
            for child in 0..node.count as usize {
                let bounds = self.bounds_of(node.children[child], node.items[child]);
                self.nodes[index].boxes.set(child, &bounds);
            }
        }
        self.bounds =
            self.root.map_or(Bounds::EMPTY, |root| self.bounds_of(root, Node8::ALL_ITEMS));
    }

    /// Finds out how many classes there are.
    pub(super) fn count_classes(&mut self) {
        let classes = self.blocks.iter().map(|block| block.class);
        let last = classes.filter(|class| *class != INSTANCE).max();
        self.classes = last.map_or(0, |last| last + 1);
    }

    /// Finds out how deep the tree is.
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
            let blocks = self.leaf(child.index()).iter();
            let bounds = blocks.map(|block| block.boxes.union(items, usize::from(block.count)));
            bounds.fold(Bounds::EMPTY, |all, bounds| all.union(&bounds))
        } else {
            let node = &self.nodes[child.index()];
            node.boxes.union(Node8::ALL_ITEMS, node.count as usize)
        }
    }

    /// How many of its children a ray through its box meets on average, if children are met by their
    /// surfaces' share.
    pub fn visits(&self) -> f64 {
        let of_node = |node: &Node8| {
            let children = (0..node.count as usize).map(|child| node.boxes.get(child).area());
            children.sum::<f64>()
        };
        self.nodes.iter().map(of_node).sum::<f64>() / self.bounds.area().max(f64::MIN_POSITIVE)
    }
}
