//! The bounding volume hierarchy: built by a library, kept in a form of our own.

use std::time::Duration;

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use super::bounds::Bounds;

/// A binary tree of boxes over items, in depth-first order.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    /// The nodes; the first is the root, if there is any.
    pub nodes: Vec<Node>,
    /// The items of the leaves.
    pub items: Vec<u32>,
}

/// A node.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Holds the boxes of all items below, exactly.
    pub bounds: Bounds,
    /// What is below.
    pub kind: NodeKind,
}

/// What is below a node.
#[derive(Clone, Copy, Debug)]
pub enum NodeKind {
    /// Two nodes: `lower` lies before `upper` along the axis.
    Inner {
        /// The axis along which the middles of the two lie furthest apart.
        axis: u8,
        /// The node that comes first along the axis.
        lower: u32,
        /// The other.
        upper: u32,
    },
    /// `count` items from `first` on in [`Bvh::items`], in ascending order.
    Leaf {
        /// The place of the first item.
        first: u32,
        /// How many there are.
        count: u32,
    },
}

/// Leaves hold no more items: each item's own box is tested, so more would gain nothing.
const MOST_ITEMS_OF_A_LEAF: u32 = 4;

impl Bvh {
    /// Over the items `(box, item)`.
    pub fn build(items: &[(Bounds, u32)]) -> Self {
        if items.is_empty() {
            return Bvh::default();
        }
        let boxes: Vec<Aabb> = items
            .iter()
            .map(|(bounds, _)| Aabb::new(bounds.min.into(), bounds.max.into()))
            .collect();
        let parameters = obvhs::BvhBuildParams {
            max_prims_per_leaf: MOST_ITEMS_OF_A_LEAF,
            ..obvhs::BvhBuildParams::medium_build()
        };
        let tree = build_bvh2(&boxes, parameters, &mut Duration::default());
        Converter { tree: &tree, items, bvh: Bvh::default() }.convert()
    }
}

/// Copies the library's tree, with boxes computed anew so that they are exact unions.
struct Converter<'a> {
    tree: &'a Bvh2,
    items: &'a [(Bounds, u32)],
    bvh: Bvh,
}

/// Which link of a parent leads to a node.
#[derive(Clone, Copy)]
enum Link {
    Root,
    Lower(usize),
    Upper(usize),
}

impl Converter<'_> {
    fn convert(mut self) -> Bvh {
        let mut stack = vec![(0_usize, Link::Root)];
        while let Some((source, link)) = stack.pop() {
            let index = self.bvh.nodes.len();
            self.link(link, index as u32);
            let node = self.tree.nodes[source];
            let (kind, bounds) = if node.is_leaf() {
                self.leaf(node.first_index as usize, node.prim_count as usize)
            } else {
                let first = node.first_index as usize;
                stack.push((first + 1, Link::Upper(index)));
                stack.push((first, Link::Lower(index)));
                (NodeKind::Inner { axis: 0, lower: 0, upper: 0 }, Bounds::EMPTY)
            };
            self.bvh.nodes.push(Node { bounds, kind });
        }
        self.bound_inner_nodes();
        self.bvh
    }

    fn link(&mut self, link: Link, index: u32) {
        let (Link::Lower(parent) | Link::Upper(parent)) = link else { return };
        if let NodeKind::Inner { lower, upper, .. } = &mut self.bvh.nodes[parent].kind {
            *(if matches!(link, Link::Lower(_)) { lower } else { upper }) = index;
        }
    }

    fn leaf(&mut self, first: usize, count: usize) -> (NodeKind, Bounds) {
        let positions = &self.tree.primitive_indices[first..first + count];
        let members = positions.iter().map(|position| self.items[*position as usize]);
        let bounds = members.clone().fold(Bounds::EMPTY, |bounds, (own, _)| bounds.union(&own));
        let start = self.bvh.items.len();
        self.bvh.items.extend(members.map(|(_, item)| item));
        self.bvh.items[start..].sort_unstable();
        (NodeKind::Leaf { first: start as u32, count: count as u32 }, bounds)
    }

    /// Children stand behind their parents, so backwards every child is done before its parent.
    fn bound_inner_nodes(&mut self) {
        for index in (0..self.bvh.nodes.len()).rev() {
            let NodeKind::Inner { lower, upper, .. } = self.bvh.nodes[index].kind else { continue };
            let (first, second) =
                (self.bvh.nodes[lower as usize].bounds, self.bvh.nodes[upper as usize].bounds);
            let gap = |axis: usize| second.twice_middle(axis) - first.twice_middle(axis);
            let axis = (1..3)
                .fold(0, |best, axis| if gap(axis).abs() > gap(best).abs() { axis } else { best });
            let (lower, upper) = if gap(axis) < 0.0 { (upper, lower) } else { (lower, upper) };
            self.bvh.nodes[index] = Node {
                bounds: first.union(&second),
                kind: NodeKind::Inner { axis: axis as u8, lower, upper },
            };
        }
    }
}
