//! Selection of the subtrees of a binary BVH that become leaves, and of the nodes that become nodes of the
//! [`Bvh8`](super::bvh8::Bvh8).
//!
//! The plan has the least cost by the surface area heuristic, found bottom up as Ylitie, Karras and Laine do
//! ("Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", 2017, section 3.3): for each node and
//! each number of trees, it holds the least cost of covering the items below the node by at most that many trees.

use std::sync::atomic::{AtomicU64, Ordering};

use obvhs::bvh2::Bvh2;
use rtsl_math::SIMD_LANES;

/// The cost of visiting a leaf, relative to that of visiting a node.
const LEAF_COST: f32 = 2.0;

/// The depth below which each subtree is planned by a single thread.
const PARALLEL_DEPTH: u32 = 8;

/// The plan for collapsing a binary tree.
pub struct CollapsePlan {
    /// For each inner node of the binary tree, one byte for each number of trees.
    choices: Vec<AtomicU64>,
}

/// The cheapest way to cover a subtree by at most n trees: the number of them that the first child gets, or one of the
/// constants below.
type Choice = u8;
/// Cover it by at most n - 1 trees.
const FEWER: Choice = 0xFF;
/// Cover it by one leaf.
const LEAF: Choice = 0xFE;

/// The least costs of covering a subtree by at most 1 to 8 trees, and the number of its items.
#[derive(Clone, Copy)]
struct Cover {
    costs: [f32; SIMD_LANES],
    items: u32,
}

impl CollapsePlan {
    /// Computes the plan of least cost.
    pub fn new(binary: &Bvh2) -> Self {
        let choices = std::iter::repeat_with(|| AtomicU64::new(0)).take(binary.nodes.len());
        let plan = CollapsePlan { choices: choices.collect() };
        if !binary.nodes.is_empty() {
            plan.cover(binary, 0, PARALLEL_DEPTH);
        }
        plan
    }

    /// True if the subtree below a node becomes a leaf when it is covered by one tree.
    pub fn is_leaf(&self, binary: &Bvh2, node: usize) -> bool {
        binary.nodes[node].is_leaf() || self.choice(node, 1) == LEAF
    }

    /// Adds the binary nodes that become the children of the node made from `node`.
    pub fn add_children(&self, binary: &Bvh2, node: usize, children: &mut Vec<usize>) {
        let mut stack = self.split(binary, node, self.choice(node, 1), SIMD_LANES).to_vec();
        while let Some((node, mut trees)) = stack.pop() {
            while trees > 1 && !binary.nodes[node].is_leaf() && self.choice(node, trees) == FEWER {
                trees -= 1;
            }
            if trees == 1 || binary.nodes[node].is_leaf() {
                children.push(node);
            } else {
                stack.extend(self.split(binary, node, self.choice(node, trees), trees));
            }
        }
    }

    /// Returns the children of a node, the second first, and the number of trees that each gets.
    fn split(
        &self,
        binary: &Bvh2,
        node: usize,
        first: Choice,
        trees: usize,
    ) -> [(usize, usize); 2] {
        let child = binary.nodes[node].first_index as usize;
        [(child + 1, trees - usize::from(first)), (child, usize::from(first))]
    }

    fn choice(&self, node: usize, trees: usize) -> Choice {
        self.choices[node].load(Ordering::Relaxed).to_le_bytes()[trees - 1]
    }

    fn cover(&self, binary: &Bvh2, node: usize, parallel_depth: u32) -> Cover {
        let first = binary.nodes[node].first_index as usize;
        if parallel_depth == 0 || binary.nodes[node].is_leaf() {
            return self.cover_alone(binary, node);
        }
        let below = |child| self.cover(binary, child, parallel_depth - 1);
        let (first, second) = rayon::join(|| below(first), || below(first + 1));
        self.join(binary, node, &first, &second)
    }

    /// Iterative, because trees may be deep.
    fn cover_alone(&self, binary: &Bvh2, root: usize) -> Cover {
        let mut stack = vec![(root, false)];
        let mut done: Vec<Cover> = Vec::new();
        while let Some((index, children_done)) = stack.pop() {
            let node = &binary.nodes[index];
            let first = node.first_index as usize;
            if node.is_leaf() {
                let cost = node.aabb().half_area() * LEAF_COST;
                done.push(Cover { costs: [cost; SIMD_LANES], items: node.prim_count });
            } else if !children_done {
                stack.extend([(index, true), (first + 1, false), (first, false)]);
            } else if let (Some(second), Some(first)) = (done.pop(), done.pop()) {
                done.push(self.join(binary, index, &first, &second));
            }
        }
        done.pop().unwrap_or(Cover { costs: [0.0; SIMD_LANES], items: 0 })
    }

    /// Chooses the cover of a node from those of its children.
    fn join(&self, binary: &Bvh2, node: usize, first: &Cover, second: &Cover) -> Cover {
        let area = binary.nodes[node].aabb().half_area();
        let items = first.items + second.items;
        let mut costs = [f32::INFINITY; SIMD_LANES];
        let mut choices = [FEWER; SIMD_LANES];
        for trees in 2..=SIMD_LANES {
            for of_first in 1..trees {
                let cost = first.costs[of_first - 1] + second.costs[trees - of_first - 1];
                if cost < costs[trees - 1] {
                    costs[trees - 1] = cost;
                    choices[trees - 1] = of_first as Choice;
                }
            }
        }
        let as_node = area + costs[SIMD_LANES - 1];
        let as_leaf = if items as usize <= SIMD_LANES { area * LEAF_COST } else { f32::INFINITY };
        let is_leaf = as_leaf <= as_node;
        (costs[0], choices[0]) =
            if is_leaf { (as_leaf, LEAF) } else { (as_node, choices[SIMD_LANES - 1]) };
        for trees in 2..=SIMD_LANES {
            if costs[trees - 2] <= costs[trees - 1] {
                costs[trees - 1] = costs[trees - 2];
                choices[trees - 1] = FEWER;
            }
        }
        self.choices[node].store(u64::from_le_bytes(choices), Ordering::Relaxed);
        Cover { costs, items }
    }
}
