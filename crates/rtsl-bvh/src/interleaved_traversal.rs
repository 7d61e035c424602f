//! Rays that go through one tree in turns.
//!
//! A ray alone waits: for a node from memory, then for the comparison that says which of its children
//! come next. Rays that take turns fill each other's waits. What a ray visits next is known a round before its
//! turn, and is fetched by then; and what depends on the ray's own way is computed without branches, which no
//! processor could predict.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, u32x8};
use rtsl_abi::prefetch;
use rtsl_math::SIMD_LANES;

use super::bvh8::{Bvh8, Child, Node8};
use super::traversal::TraversalStack;

/// So many rays take turns at most.
pub const MAX_IN_TURN: usize = 32;

/// So many children are put in order without a branch; few nodes have more that a ray meets.
const MIN_IN_TURN: usize = 3;

/// A child that a ray meets, and where, at the earliest, in the upper half: ordered by that.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct StackEntry(u64);

impl StackEntry {
    /// Not behind any other.
    const NONE: StackEntry = StackEntry(0);

    /// What is visited last, behind no limit.
    const END: StackEntry =
        StackEntry((f32::NEG_INFINITY.to_bits() as u64) << 32 | Child::END.bits() as u64);

    #[inline(always)]
    fn child(self) -> Child {
        Child::from_bits(self.0 as u32)
    }

    #[inline(always)]
    fn entry(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }
}

/// The visits of the children of a node, by slot, and as many of [`StackEntry::NONE`].
pub struct NodeVisits([StackEntry; 2 * SIMD_LANES]);

impl NodeVisits {
    /// None.
    pub const NONE: NodeVisits = NodeVisits([StackEntry::NONE; 2 * SIMD_LANES]);

    /// Those of a node, where a ray enters each.
    #[inline(always)]
    pub fn set<S: Simd>(&mut self, simd: S, node: &Node8, entries: f32x8<S>) {
        let children = node.children.map(Child::bits);
        let children = u32x8::load_array(simd, children);
        let entries: u32x8<S> = entries.bitcast();
        let (low, high) = children.interleave(entries);
        let (low, high): ([u32; SIMD_LANES], [u32; SIMD_LANES]) = (low.to_array(), high.to_array());
        let visit = |pair: &[u32]| StackEntry(u64::from(pair[1]) << 32 | u64::from(pair[0]));
        for slot in 0..SIMD_LANES / 2 {
            self.0[slot] = visit(&low[2 * slot..2 * slot + 2]);
            self.0[slot + SIMD_LANES / 2] = visit(&high[2 * slot..2 * slot + 2]);
        }
    }
}

/// Some of the rays that take turns, as bits.
#[derive(Clone, Copy, Default)]
pub struct Waiting(u32);

impl Iterator for Waiting {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let first = self.0.trailing_zeros() as usize % MAX_IN_TURN;
        let is_any = self.0 != 0;
        self.0 &= self.0.wrapping_sub(1);
        is_any.then_some(first)
    }
}

impl Waiting {
    #[inline(always)]
    fn add_if(&mut self, ray: usize, is_added: bool) {
        self.0 |= u32::from(is_added) << ray;
    }
}

/// Where rays that take turns have got to.
pub struct Turns {
    /// What each visits next.
    next: [Child; MAX_IN_TURN],
    /// The leaf that each visited last.
    last_leaf: [Child; MAX_IN_TURN],
    /// For each ray, the place behind the visits that it has left, the next of which is the last.
    ends: [usize; MAX_IN_TURN],
    /// The rays that are to visit a node.
    at_nodes: Waiting,
    /// The rays that are to visit a leaf.
    at_leaves: Waiting,
    /// The first place of all.
    base: usize,
}

impl Turns {
    /// So many rays, which are to visit `root`. [`Turns::end`] must follow.
    pub fn new(visits: &mut TraversalStack, tree: &Bvh8, root: Child, count: usize) -> Turns {
        // The end, and what is written before it is known to be of use.
        let room = 1 + MIN_IN_TURN + tree.depth * (SIMD_LANES - 1);
        let base = visits.rays_in_use;
        visits.rays_in_use += count * room;
        if visits.rays.len() < visits.rays_in_use {
            visits.rays.resize(visits.rays_in_use, StackEntry::NONE);
        }
        let mut turns = Turns {
            next: [root; MAX_IN_TURN],
            last_leaf: [Child::END; MAX_IN_TURN],
            ends: [0; MAX_IN_TURN],
            at_nodes: Waiting::default(),
            at_leaves: Waiting::default(),
            base,
        };
        for ray in 0..count {
            visits.rays[base + ray * room] = StackEntry::END;
            turns.ends[ray] = base + ray * room + 1;
            turns.queue(ray, root);
        }
        turns
    }

    /// Gives back the memory.
    pub fn end(self, visits: &mut TraversalStack) {
        visits.rays_in_use = self.base;
    }

    /// Whether no ray has anything left to visit.
    #[inline(always)]
    pub fn is_over(&self) -> bool {
        self.at_nodes.0 | self.at_leaves.0 == 0
    }

    /// What a ray visits next.
    #[inline(always)]
    pub fn next(&self, ray: usize) -> Child {
        self.next[ray]
    }

    /// The rays that are to visit a node.
    #[inline(always)]
    pub fn take_at_nodes(&mut self) -> Waiting {
        std::mem::take(&mut self.at_nodes)
    }

    /// The rays that are to visit a leaf.
    #[inline(always)]
    pub fn take_at_leaves(&mut self) -> Waiting {
        std::mem::take(&mut self.at_leaves)
    }

    /// Whether a ray has not just visited the leaf that it is at: of leaves that share a block the first tests
    /// all items.
    #[inline(always)]
    pub fn is_new_leaf(&mut self, ray: usize) -> bool {
        std::mem::replace(&mut self.last_leaf[ray], self.next[ray]) != self.next[ray]
    }

    /// Notes which children of a node a ray meets.
    #[inline(always)]
    pub fn push(
        &mut self,
        visits: &mut TraversalStack,
        ray: usize,
        met: u64,
        of_node: &NodeVisits,
    ) {
        let count = met.count_ones() as usize;
        let end = self.ends[ray];
        let NodeVisits(of_node) = of_node;
        // Behind those that are met come some that are none.
        let mut rest = met as u32 | 0xFF00;
        let mut take = || {
            let visit = of_node[rest.trailing_zeros() as usize % (2 * SIMD_LANES)];
            rest &= rest.wrapping_sub(1);
            visit
        };
        if count <= MIN_IN_TURN {
            let Some(places) = visits.rays[end..].first_chunk_mut::<MIN_IN_TURN>() else { return };
            let (a, b, c) = (take(), take(), take());
            let (a, b) = (a.max(b), a.min(b));
            let (b, c) = (b.max(c), b.min(c));
            let (a, b) = (a.max(b), a.min(b));
            *places = [a, b, c];
        } else {
            let places = &mut visits.rays[end..end + count];
            places.fill_with(take);
            sort(places);
        }
        self.ends[ray] = end + count;
    }

    /// Finds what a ray visits next, before `limit`, and queues it.
    #[inline(always)]
    pub fn queue_next(&mut self, visits: &TraversalStack, tree: &Bvh8, ray: usize, limit: f32) {
        let mut end = self.ends[ray];
        let visit = loop {
            end -= 1;
            let visit = visits.rays[end];
            // The end is behind nothing, not even a NaN.
            let is_behind = visit.entry() > limit;
            if !is_behind {
                break visit;
            }
        };
        self.ends[ray] = end;
        self.queue(ray, visit.child());
        if let Some(node) = tree.nodes.get(visit.child().index()) {
            prefetch(node);
        }
    }

    /// Queues a ray where it visits what `next` says.
    #[inline(always)]
    pub fn queue(&mut self, ray: usize, next: Child) {
        self.next[ray] = next;
        self.at_nodes.add_if(ray, next.is_node());
        self.at_leaves.add_if(ray, next.is_leaf());
    }
}

/// Sorts a few, the greatest first.
fn sort(few: &mut [StackEntry]) {
    for end in 1..few.len() {
        let mut place = end;
        while place > 0 && few[place] > few[place - 1] {
            few.swap(place, place - 1);
            place -= 1;
        }
    }
}
