//! Hits of rays.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, f32x16, mask32x16, mask64x8, u64x8};

use super::packet::{LANES, LaneMask, Lanes, RayPacket, is_wide, lanes_of, load, vectors_of};

/// The identity of the object that was hit: the item of the scene and, for an instance, the item of its group. The
/// lower id wins ties.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct HitId(u64);

impl HitId {
    /// No object; greater than every object's.
    pub const NONE: HitId = HitId(u64::MAX);

    /// The item `inner` of the group that the item `outer` of the scene places; for an item of the scene itself `inner`
    /// is 0.
    pub fn new(outer: u32, inner: u32) -> Self {
        HitId(u64::from(outer) << 32 | u64::from(inner))
    }

    /// Returns the index of the item of the scene.
    pub fn outer(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// Returns the index of the item of the instance's group, if the item of the scene is an instance.
    pub fn inner(self) -> u32 {
        self.0 as u32
    }
}

/// The closest hits of the rays of a packet.
#[repr(C, align(64))]
#[derive(Clone, Debug)]
pub struct Hits {
    /// The distances, in multiples of the direction; without a hit, the ray's limit.
    pub distance: Lanes,
    /// The objects.
    pub id: [HitId; LANES],
    /// The lanes that hit something.
    found: LaneMask,
}

impl Hits {
    /// Returns the state before the search: no hits.
    pub fn new(rays: &RayPacket) -> Self {
        Hits { distance: rays.limit, id: [HitId::NONE; LANES], found: 0 }
    }

    /// Returns the lanes of `mask` that hit something.
    pub fn lanes(&self, mask: LaneMask) -> LaneMask {
        self.found & mask
    }

    /// True if a hit is closer than the closest hit so far of its lane. Of equally close hits, the one with the lower
    /// id is closer.
    #[inline(always)]
    pub fn is_nearer(&self, lane: usize, distance: f32, id: HitId) -> bool {
        let nearest = self.distance[lane];
        distance < nearest || (distance == nearest && id < self.id[lane])
    }

    /// Records the hits of one object in the lanes for which they are closer than the closest so far.
    #[inline(always)]
    pub fn keep_nearer<S: Simd>(&mut self, simd: S, lanes: LaneMask, found: &Lanes, id: HitId) {
        if is_wide::<S>() {
            self.keep_nearer_of_sixteen(simd, lanes, found, id);
        } else {
            self.keep_nearer_of_eight(simd, lanes, found, id);
        }
    }

    /// Selects distances and ids in registers.
    #[inline(always)]
    fn keep_nearer_of_sixteen<S: Simd>(
        &mut self,
        simd: S,
        lanes: LaneMask,
        found: &Lanes,
        id: HitId,
    ) {
        for (start, valid) in vectors_of::<S, f32x16<S>>(lanes) {
            let new: f32x16<S> = load(simd, found, start);
            let old: f32x16<S> = load(simd, &self.distance, start);
            let is_nearer = new.simd_lt(old) & mask32x16::from_bitmask(simd, valid);
            let equal = new.simd_eq(old).to_bitmask() & valid;
            is_nearer.select(new, old).store_slice(&mut self.distance[start..start + 16]);
            let nearer = is_nearer.to_bitmask();
            self.found |= nearer << start;
            let ids = &mut self.id[start..start + 16];
            for (first, ids) in (0..).step_by(8).zip(ids.as_chunks_mut::<8>().0) {
                set_ids(simd, ids, nearer >> first & 0xFF, id);
            }
            for lane in lanes_of(equal) {
                if id < ids[lane] {
                    ids[lane] = id;
                    self.found |= 1 << (start + lane);
                }
            }
        }
    }

    /// Stores a full vector at once, and lane by lane else.
    #[inline(always)]
    fn keep_nearer_of_eight<S: Simd>(
        &mut self,
        simd: S,
        lanes: LaneMask,
        found: &Lanes,
        id: HitId,
    ) {
        for (start, valid) in vectors_of::<S, f32x8<S>>(lanes) {
            let new: f32x8<S> = load(simd, found, start);
            let old: f32x8<S> = load(simd, &self.distance, start);
            let nearer = new.simd_lt(old).to_bitmask() & valid;
            let equal = new.simd_eq(old).to_bitmask() & valid;
            if nearer == 0xFF {
                new.store_slice(&mut self.distance[start..start + 8]);
                self.id[start..start + 8].fill(id);
                self.found |= 0xFF << start;
                continue;
            }
            for lane in lanes_of(nearer | equal) {
                if nearer >> lane & 1 != 0 || id < self.id[start + lane] {
                    self.set(start + lane, found[start + lane], id);
                }
            }
        }
    }

    /// Records a hit of one lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, distance: f32, id: HitId) {
        self.distance[lane] = distance;
        self.id[lane] = id;
        self.found |= 1 << lane;
    }

    /// Records that lanes hit something, without a distance.
    #[inline(always)]
    pub fn mark(&mut self, lanes: LaneMask) {
        self.found |= lanes;
    }
}

/// Sets the ids of some of eight lanes.
#[inline(always)]
fn set_ids<S: Simd>(simd: S, ids: &mut [HitId; 8], lanes: LaneMask, id: HitId) {
    let old = u64x8::load_array(simd, ids.map(|id| id.0));
    let is_set = mask64x8::from_bitmask(simd, lanes);
    *ids = is_set.select(u64x8::splat(simd, id.0), old).to_array().map(HitId);
}
