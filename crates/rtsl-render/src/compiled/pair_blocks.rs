//! Tests of rays of a stream against one object each, by `intersect` in the stream call mode.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8, u32x8};
use rtsl::host::NoHost;
use rtsl::{CallArguments, Instances, LaneBlock, LaneIndices, LaneMask as MaskBlock, new_state};
use rtsl_bvh::{Pair, PairHit, RayStream};
use rtsl_math::SIMD_LANES;

use super::calls::Callee;
use super::fours::fours;
use super::object_class::ObjectClass;
use super::variables::variables;

/// The greatest number of pairs in a call.
const MAX_PAIRS: usize = 256;

/// The memory of one thread for such tests.
pub struct PairBlocks {
    state: LaneBlock,
    scratch: LaneBlock,
    objects: LaneIndices,
    accepted: MaskBlock,
}

impl PairBlocks {
    /// Allocates the memory for shaders with at most so many scratch arrays.
    pub fn new(scratch_arrays: usize) -> Self {
        PairBlocks {
            state: new_state(MAX_PAIRS),
            scratch: LaneBlock::new(scratch_arrays, MAX_PAIRS),
            objects: LaneIndices::new(MAX_PAIRS),
            accepted: MaskBlock::new(MAX_PAIRS),
        }
    }

    /// Tests pairs with objects of a class; adds those that hit to `found`.
    pub fn test(
        &mut self,
        class: &ObjectClass,
        intersect: Callee<'_>,
        stream: &RayStream,
        pairs: &[Pair],
        found: &mut Vec<PairHit>,
    ) {
        let stream_kernel = class.stream_kernel();
        // Without a stream kernel, pairs are tested one by one.
        let step = if stream_kernel.is_some() { MAX_PAIRS } else { 1 };
        for (start, pairs) in (0..).step_by(step).zip(pairs.chunks(step)) {
            self.load(stream, pairs);
            let objects = &class.objects;
            let (kernel, instances) = match stream_kernel {
                Some(kernel) => (kernel, Instances::Many(objects, &self.objects)),
                None => (class.packet_kernel(false), Instances::Object(objects, pairs[0].object)),
            };
            let (state, scratch) = (&mut self.state, &mut self.scratch);
            let (count, mask, accepted) = (pairs.len(), None, Some(&mut self.accepted));
            let host = &mut NoHost;
            let call = CallArguments { state, scratch, count, mask, accepted, instances, host };
            intersect.call(kernel, call);
            dispatch!(Level::new(), simd => self.add_accepted(simd, start, pairs.len(), found));
        }
    }

    /// Adds the accepted ones of the first `count` lanes; lane 0 is the pair `first`.
    #[inline(always)]
    fn add_accepted<S: Simd>(&self, simd: S, first: u32, count: usize, found: &mut Vec<PairHit>) {
        let accepted = self.accepted.words().chunks_exact(SIMD_LANES);
        let distances = self.state.floats(variables().hit_distance).chunks_exact(SIMD_LANES);
        for (start, (accepted, distances)) in
            (0..count).step_by(SIMD_LANES).zip(accepted.zip(distances))
        {
            let accepted = !u32x8::from_slice(simd, accepted).simd_eq(0);
            // Lanes after the last pair contain old values.
            let mut accepted =
                accepted.to_bitmask() & !(u64::MAX << (count - start).min(SIMD_LANES));
            while accepted != 0 {
                let lane = accepted.trailing_zeros() as usize % SIMD_LANES;
                accepted &= accepted - 1;
                found.push(PairHit {
                    pair: first + (start + lane) as u32,
                    distance: distances[lane],
                });
            }
        }
    }

    fn load(&mut self, stream: &RayStream, pairs: &[Pair]) {
        let objects = self.objects.as_mut_slice();
        let (used, rest) = objects.split_at_mut(pairs.len());
        used.iter_mut().zip(pairs).for_each(|(object, pair)| *object = pair.object);
        // Kernels require valid indices in all lanes.
        rest.fill(0);
        dispatch!(Level::new(), simd => self.load_rays(simd, stream, pairs));
    }

    #[inline(always)]
    fn load_rays<S: Simd>(&mut self, simd: S, stream: &RayStream, pairs: &[Pair]) {
        simd.vectorize(
            #[inline(always)]
            || {
                let v = variables();
                for (step, pairs) in pairs.chunks(SIMD_LANES).enumerate() {
                    // Lanes after the last pair repeat its ray.
                    let ray = |lane: usize| pairs[lane.min(pairs.len() - 1)].ray as usize;
                    let origins = fours(simd, |lane| stream.rays()[ray(lane)].start);
                    let along = fours(simd, |lane| stream.lines()[ray(lane)].along);
                    let mut times = [0.0; SIMD_LANES];
                    for (lane, time) in times.iter_mut().enumerate() {
                        *time = stream.times()[ray(lane)];
                    }
                    let mut rows = Rows { state: &mut self.state, start: step * SIMD_LANES };
                    for axis in 0..3 {
                        rows.set(v.ray_origin + axis, origins[axis]);
                        rows.set(v.ray_direction + axis, along[axis]);
                        let inverse = f32x8::splat(simd, 1.0) / along[axis];
                        rows.set(v.inverse_ray_direction + axis, inverse);
                    }
                    rows.set(v.epsilon, origins[3]);
                    rows.set(v.hit_distance, along[3]);
                    rows.set(v.time_seed, f32x8::load_array(simd, times));
                }
            },
        );
    }
}

/// Eight consecutive lanes of all components.
struct Rows<'a> {
    state: &'a mut LaneBlock,
    start: usize,
}

impl Rows<'_> {
    /// Sets a component.
    #[inline(always)]
    fn set<S: Simd>(&mut self, component: usize, values: f32x8<S>) {
        let lanes = self.state.floats_mut(component);
        values.store_slice(&mut lanes[self.start..self.start + SIMD_LANES]);
    }
}
