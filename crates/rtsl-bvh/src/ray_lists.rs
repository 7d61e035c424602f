//! Lists of the rays of a stream that are to visit a node or leaf.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, mask32x8, u32x8};
use rtsl_math::SIMD_LANES;

use super::bvh8::{Child, Node8};

/// The pending visits of a stream: empty between searches, kept to reuse its memory.
#[derive(Debug, Default)]
pub struct RayLists {
    /// The visits, the next last.
    visits: Vec<Visit>,
    /// The rays of all visits, by their index in the stream, those of the next visit last, followed by room for one
    /// vector.
    rays: Vec<u32>,
    /// The rays of the visit taken last.
    pub taken: Vec<u32>,
    /// For each eight of these, the children that they meet: bit `SIMD_LANES * slot + index`.
    met: Vec<u64>,
}

/// The target of a visit: a child and, for a leaf, the mask of its items.
pub type Target = (Child, u8);

/// A visit.
#[derive(Clone, Copy, Debug)]
struct Visit {
    target: Target,
    /// The start of its rays in [`RayLists::rays`].
    start: usize,
    /// The end of its rays.
    end: usize,
}

impl RayLists {
    /// Begins a search with `count` rays, which count as taken.
    pub fn begin(&mut self, count: usize) {
        self.visits.clear();
        self.rays.clear();
        self.taken.clear();
        self.taken.extend(0..count as u32);
    }

    /// Schedules a visit of a target by all rays taken.
    pub fn push_all(&mut self, target: Target) {
        let start = self.rays.len();
        self.rays.extend_from_slice(&self.taken);
        self.visits.push(Visit { target, start, end: self.rays.len() });
    }

    /// Takes the next visit: returns its target and fills [`RayLists::taken`] with its rays.
    #[inline(always)]
    pub fn take(&mut self) -> Option<Target> {
        let Visit { target, start, end } = self.visits.pop()?;
        self.taken.clear();
        self.taken.extend_from_slice(&self.rays[start..end]);
        self.rays.truncate(start);
        Some(target)
    }

    /// Computes, for each of the rays taken, the mask of the children of a node that it meets.
    #[inline(always)]
    pub fn meet(&mut self, mut children_met_by: impl FnMut(u32) -> u64) {
        self.met.clear();
        for rays in self.taken.chunks(SIMD_LANES) {
            let mut by_ray = 0;
            for (index, ray) in rays.iter().enumerate() {
                by_ray |= children_met_by(*ray) << (SIMD_LANES * index);
            }
            self.met.push(transposed(by_ray));
        }
        self.taken.resize(self.met.len() * SIMD_LANES, 0);
    }

    /// Schedules a visit of the child in a `slot` of a node by the rays that meet it.
    #[inline(always)]
    pub fn push<S: Simd>(&mut self, simd: S, node: &Node8, slot: usize) {
        let target = (node.children[slot], node.items[slot]);
        let start = self.rays.len();
        self.rays.resize(start + self.taken.len(), 0);
        let mut end = start;
        for (rays, met) in self.taken.chunks_exact(SIMD_LANES).zip(&self.met) {
            let met = met >> (SIMD_LANES * slot % u64::BITS as usize) & 0xFF;
            let rays = u32x8::from_slice(simd, rays).compress(mask32x8::from_bitmask(simd, met));
            rays.store_slice(&mut self.rays[end..end + SIMD_LANES]);
            end += met.count_ones() as usize;
        }
        self.rays.truncate(end);
        self.visits.push(Visit { target, start, end });
    }
}

/// Transposes an 8 by 8 bit matrix: moves bit `8 * a + b` to bit `8 * b + a` (Warren, "Hacker's Delight", 2nd edition,
/// section 7-3).
#[inline(always)]
fn transposed(bits: u64) -> u64 {
    let swap = |bits: u64, by: u32, which: u64| {
        let differing = (bits ^ bits >> by) & which;
        bits ^ differing ^ differing << by
    };
    let bits = swap(bits, 7, 0x00AA_00AA_00AA_00AA);
    let bits = swap(bits, 14, 0x0000_CCCC_0000_CCCC);
    swap(bits, 28, 0x0000_0000_F0F0_F0F0)
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[test]
    fn bits_are_transposed() {
        for place in 0..64 {
            assert_eq!(transposed(1 << place), 1 << (place % 8 * 8 + place / 8));
        }
    }

    #[test]
    fn rays_come_to_the_children_that_they_meet_and_the_last_child_comes_first() {
        let (leaf, inner) = ((Child::leaf(7), 0b11), (Child::node(4), Node8::ALL_ITEMS));
        let mut node = Node8::EMPTY;
        (node.children[2], node.items[2]) = leaf;
        (node.children[0], node.items[0]) = inner;
        let mut lists = RayLists::default();
        lists.begin(21);
        lists.push_all((Child::node(0), Node8::ALL_ITEMS));
        assert_eq!(lists.take(), Some((Child::node(0), Node8::ALL_ITEMS)));
        assert_eq!(lists.taken, Vec::from_iter(0..21));
        lists.meet(|ray| if ray % 3 == 0 { 0b101 } else { 0b100 });
        dispatch!(Level::new(), simd => {
            lists.push(simd, &node, 2);
            lists.push(simd, &node, 0);
        });
        assert_eq!(lists.take(), Some(inner));
        assert_eq!(lists.taken, [0, 3, 6, 9, 12, 15, 18]);
        assert_eq!(lists.take(), Some(leaf));
        assert_eq!(lists.taken, Vec::from_iter(0..21));
        assert_eq!(lists.take(), None);
    }
}
