//! Interleaved traversal: several single rays take turns in one tree.
//!
//! A single ray waits for memory to deliver a node, then for the comparisons that select the next child. Interleaved
//! rays fill each other's waits. The next node or leaf of a ray is known one round before its turn and is prefetched;
//! the computations that depend on the path of the ray are free of branches, because no processor could predict them.
//! The exception is the search for the next visit: comparisons of eight entries at once take 1.1 to 1.2 times as long
//! (Zen 5), because vectors of entries that were stored in parts are slow to load.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x8, mask64x4, mask64x8, u8x64, u32x8, u64x4, u64x8};
use rtsl_math::SIMD_LANES;

use super::bvh8::{Bvh8, Child, Node8};
use super::packet::LANES;

/// The greatest number of rays that are interleaved: all of a packet. With half as many, rays that leave surfaces took
/// 1.09 times as long on a million triangles, and 1.04 times on ten thousand spheres (Zen 4).
pub const MAX_INTERLEAVED: usize = LANES;

/// At most so many rays are interleaved in a small state, which takes less time to set up: rays in instances are alone.
/// Rays that leave surfaces of instances took 1.15 times as long in one state for 32 rays (Zen 4).
pub const FEW_INTERLEAVED: usize = 4;

/// The bytes of pairs of one number each of two vectors, given one after the other.
const BY_SLOT: [u8; 8 * SIMD_LANES] = {
    let mut bytes = [0; 8 * SIMD_LANES];
    let mut byte = 0;
    while byte < bytes.len() {
        let (slot, is_second) = (byte / 8, byte / 4 % 2);
        bytes[byte] = ((slot + is_second * SIMD_LANES) * 4 + byte % 4) as u8;
        byte += 1;
    }
    bytes
};

/// Up to so many children are sorted without branches; rays rarely meet more children of a node.
const MAX_BRANCHLESS_SORT: usize = 3;

/// A child that a ray meets. The upper half is the distance at which the ray enters its box, so that entries are
/// ordered by it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct StackEntry(u64);

impl StackEntry {
    /// The entry that sorts after all others.
    const NONE: StackEntry = StackEntry(0);

    /// The bottom of a stack: no limit skips it.
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

/// The stacks of interleaved rays: empty between searches, kept to reuse its memory.
#[derive(Debug, Default)]
pub struct RayStacks {
    entries: Vec<StackEntry>,
    /// The length of the part of `entries` that is in use.
    in_use: usize,
}

/// The entries of the children of a node, by slot, followed by as many of [`StackEntry::NONE`].
pub struct NodeVisits([StackEntry; 2 * SIMD_LANES]);

impl NodeVisits {
    /// No entries.
    pub const NONE: NodeVisits = NodeVisits([StackEntry::NONE; 2 * SIMD_LANES]);

    /// Sets the entries of the children of a node from the distances at which a ray enters them.
    #[inline(always)]
    pub fn set<S: Simd>(&mut self, simd: S, node: &Node8, entries: f32x8<S>) {
        let (low, high) = entries_by_slot(simd, node, entries);
        let (low, high): ([u32; SIMD_LANES], [u32; SIMD_LANES]) = (low.to_array(), high.to_array());
        let visit = |pair: &[u32]| StackEntry(u64::from(pair[1]) << 32 | u64::from(pair[0]));
        for slot in 0..SIMD_LANES / 2 {
            self.0[slot] = visit(&low[2 * slot..2 * slot + 2]);
            self.0[slot + SIMD_LANES / 2] = visit(&high[2 * slot..2 * slot + 2]);
        }
    }
}

/// Returns the encoded entries of the children of a node, by slot, the first four and the last four.
#[inline(always)]
fn entries_by_slot<S: Simd>(simd: S, node: &Node8, entries: f32x8<S>) -> (u32x8<S>, u32x8<S>) {
    let children = u32x8::load_array(simd, node.children.map(Child::bits));
    children.interleave(entries.bitcast::<u32x8<S>>())
}

/// A set of interleaved rays, as a bit mask.
#[derive(Clone, Copy, Default)]
pub struct Waiting(u64);

impl Iterator for Waiting {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let first = self.0.trailing_zeros() as usize % MAX_INTERLEAVED;
        let is_any = self.0 != 0;
        self.0 &= self.0.wrapping_sub(1);
        is_any.then_some(first)
    }
}

impl Waiting {
    #[inline(always)]
    fn add_if(&mut self, ray: usize, is_added: bool) {
        self.0 |= u64::from(is_added) << ray;
    }
}

/// The state of at most `N` interleaved rays.
pub struct InterleavedTraversal<const N: usize> {
    /// The next node or leaf of each ray.
    next: [Child; N],
    /// The leaf that each ray visited last.
    last_leaf: [Child; N],
    /// For each ray, the end of its stack in [`RayStacks`].
    ends: [usize; N],
    /// The rays whose next visit is a node.
    at_nodes: Waiting,
    /// The rays whose next visit is a leaf.
    at_leaves: Waiting,
    /// The start of the first ray's stack.
    base: usize,
}

impl<const N: usize> InterleavedTraversal<N> {
    /// Begins the traversal of `count` rays at `root`, at most `N`. [`InterleavedTraversal::end`] must follow.
    pub fn new(stacks: &mut RayStacks, tree: &Bvh8, root: Child, count: usize) -> Self {
        // Room for the bottom entry and for the vector of entries that is written beyond the end.
        let room = 1 + SIMD_LANES + tree.depth * (SIMD_LANES - 1);
        let base = stacks.in_use;
        stacks.in_use += count * room;
        if stacks.entries.len() < stacks.in_use {
            stacks.entries.resize(stacks.in_use, StackEntry::NONE);
        }
        let mut interleaved = InterleavedTraversal::<N> {
            next: [root; N],
            last_leaf: [Child::END; N],
            ends: [0; N],
            at_nodes: Waiting::default(),
            at_leaves: Waiting::default(),
            base,
        };
        for ray in 0..count {
            stacks.entries[base + ray * room] = StackEntry::END;
            interleaved.ends[ray % N] = base + ray * room + 1;
            interleaved.queue(ray, root);
        }
        interleaved
    }

    /// Frees the stacks.
    pub fn end(self, stacks: &mut RayStacks) {
        stacks.in_use = self.base;
    }

    /// True if no ray has anything left to visit.
    #[inline(always)]
    pub fn is_over(&self) -> bool {
        self.at_nodes.0 | self.at_leaves.0 == 0
    }

    /// Returns the next node or leaf of a ray.
    #[inline(always)]
    pub fn next(&self, ray: usize) -> Child {
        self.next[ray % N]
    }

    /// Takes the rays whose next visit is a node.
    #[inline(always)]
    pub fn take_at_nodes(&mut self) -> Waiting {
        std::mem::take(&mut self.at_nodes)
    }

    /// Takes the rays whose next visit is a leaf.
    #[inline(always)]
    pub fn take_at_leaves(&mut self) -> Waiting {
        std::mem::take(&mut self.at_leaves)
    }

    /// False if the ray has just visited the leaf. Of the leaf children that share a leaf, the first tests all items.
    #[inline(always)]
    pub fn is_new_leaf(&mut self, ray: usize) -> bool {
        std::mem::replace(&mut self.last_leaf[ray % N], self.next[ray % N]) != self.next[ray % N]
    }

    /// Pushes the children of a node that a ray meets, the closest on top.
    #[inline(always)]
    pub fn push(&mut self, stacks: &mut RayStacks, ray: usize, met: u64, of_node: &NodeVisits) {
        let count = met.count_ones() as usize;
        let end = self.ends[ray % N];
        let NodeVisits(of_node) = of_node;
        // The entries of the children met are followed by empty ones.
        let mut rest = met as u32 | 0xFF00;
        let mut take = || {
            let visit = of_node[rest.trailing_zeros() as usize % (2 * SIMD_LANES)];
            rest &= rest.wrapping_sub(1);
            visit
        };
        if count <= MAX_BRANCHLESS_SORT {
            let Some(places) = stacks.entries[end..].first_chunk_mut::<MAX_BRANCHLESS_SORT>()
            else {
                return;
            };
            let (a, b, c) = (take(), take(), take());
            let (a, b) = (a.max(b), a.min(b));
            let (b, c) = (b.max(c), b.min(c));
            let (a, b) = (a.max(b), a.min(b));
            *places = [a, b, c];
        } else {
            let places = &mut stacks.entries[end..end + count];
            places.fill_with(take);
            sort(places);
        }
        self.ends[ray % N] = end + count;
    }

    /// The same for processors with instructions that move the numbers of a mask's lanes together: all entries are
    /// sorted in one register.
    #[inline(always)]
    pub fn push_in_register<S: Simd>(
        &mut self,
        simd: S,
        stacks: &mut RayStacks,
        ray: usize,
        met: mask32x8<S>,
        node: &Node8,
        entries: f32x8<S>,
    ) {
        let met = met.to_bitmask();
        let children = u32x8::load_array(simd, node.children.map(Child::bits));
        let order = u8x64::load_array(simd, BY_SLOT);
        let all = children.combine(entries.bitcast::<u32x8<S>>()).swizzle_dyn(order);
        let all: u64x8<S> = all.bitcast();
        let all = all.compress(mask64x8::from_bitmask(simd, met));
        let count = met.count_ones() as usize;
        let end = self.ends[ray % N];
        if count <= SIMD_LANES / 2 {
            let (first, _) = all.split();
            let sorted = sorted_four(simd, first).to_array();
            if let Some(places) = stacks.entries[end..].first_chunk_mut() {
                *places = sorted.map(StackEntry);
            }
        } else if let Some(places) = stacks.entries[end..].first_chunk_mut() {
            *places = all.to_array().map(StackEntry);
            sort(&mut stacks.entries[end..end + count]);
        }
        self.ends[ray % N] = end + count;
    }

    /// Pops the next visit of a ray that is not beyond `limit` and queues it.
    #[inline(always)]
    pub fn queue_next(&mut self, stacks: &RayStacks, tree: &Bvh8, ray: usize, limit: f32) {
        let mut end = self.ends[ray % N];
        let visit = loop {
            end -= 1;
            let visit = stacks.entries[end];
            // The bottom entry is never skipped, even if `limit` is NaN.
            let is_behind = visit.entry() > limit;
            if !is_behind {
                break visit;
            }
        };
        self.ends[ray % N] = end;
        self.queue(ray, visit.child());
        tree.prefetch(visit.child());
    }

    /// Queues a ray for its next visit.
    #[inline(always)]
    pub fn queue(&mut self, ray: usize, next: Child) {
        self.next[ray % N] = next;
        self.at_nodes.add_if(ray, next.is_node());
        self.at_leaves.add_if(ray, next.is_leaf());
    }
}

/// Sorts four numbers in descending order, by the bitonic network (Batcher, "Sorting Networks and Their Applications",
/// 1968).
#[inline(always)]
fn sorted_four<S: Simd>(simd: S, numbers: u64x4<S>) -> u64x4<S> {
    let numbers = sorted_pairs(simd, numbers);
    let reversed = numbers.reverse();
    let is_first = mask64x4::from_bitmask(simd, 0b0011);
    sorted_pairs(simd, is_first.select(numbers.max(reversed), numbers.min(reversed)))
}

/// Sorts the first two of four numbers and the last two in descending order.
#[inline(always)]
fn sorted_pairs<S: Simd>(simd: S, numbers: u64x4<S>) -> u64x4<S> {
    let swapped = numbers.slide_within_blocks::<1>(numbers);
    let is_first = mask64x4::from_bitmask(simd, 0b0101);
    is_first.select(numbers.max(swapped), numbers.min(swapped))
}

/// Sorts a short slice in descending order.
fn sort(few: &mut [StackEntry]) {
    for end in 1..few.len() {
        let mut place = end;
        while place > 0 && few[place] > few[place - 1] {
            few.swap(place, place - 1);
            place -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[test]
    fn four_numbers_are_sorted() {
        for code in 0..256_u64 {
            let numbers = [code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6 | 1 << 40];
            let mut expected = numbers;
            expected.sort_unstable_by(|one, other| other.cmp(one));
            let sorted = dispatch!(Level::new(), simd => {
                sorted_four(simd, u64x4::load_array(simd, numbers)).to_array()
            });
            assert_eq!(sorted, expected);
        }
    }

    #[test]
    fn both_ways_of_pushing_leave_the_same_stack() {
        let mut node = Node8::EMPTY;
        node.children = std::array::from_fn(|slot| Child::node(10 + slot as u32));
        let entries = [4.0, 0.5, 7.0, 0.0, 4.0, 1.0, f32::INFINITY, 2.0];
        for met in 0..256 {
            let tree = Bvh8 { depth: 2, ..Bvh8::default() };
            let mut both = [RayStacks::default(), RayStacks::default()];
            let [one, other] = &mut both;
            let mut first = InterleavedTraversal::<1>::new(one, &tree, Child::node(0), 1);
            let mut second = InterleavedTraversal::<1>::new(other, &tree, Child::node(0), 1);
            dispatch!(Level::new(), simd => {
                let entries = f32x8::load_array(simd, entries);
                let mut of_node = NodeVisits::NONE;
                of_node.set(simd, &node, entries);
                first.push(one, 0, met, &of_node);
                let met = mask32x8::from_bitmask(simd, met);
                second.push_in_register(simd, other, 0, met, &node, entries);
            });
            let end = first.ends[0];
            assert_eq!(end, second.ends[0]);
            assert_eq!(one.entries[..end], other.entries[..end]);
        }
    }
}
