//! A torus found by steps of the distance to it.

use super::Rival;
use super::lanes::{Floats, Mask};
use super::precision::Precision;
use super::vector::Vec3;
use crate::kernels::Torus;
use crate::packet::{Packet, RAYS};

impl Rival for Torus {
    #[inline(always)]
    unsafe fn packet<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the race has these arrays and parameters, as the caller promises.
        unsafe {
            if P::TUNED {
                step::<F, P, 4>(packet);
            } else {
                step::<F, P, 1>(packet);
            }
        }
    }
}

/// Goes through the packet, `G` vectors at a time.
///
/// # Safety
/// As for the kernel.
#[inline(always)]
unsafe fn step<F: Floats, P: Precision, const G: usize>(packet: Packet) {
    // Safety: the caller's promise.
    unsafe {
        let major = F::splat(packet.parameter(0));
        let minor = F::splat(packet.parameter(1));
        let tolerance = F::splat(packet.parameter(2));
        let id = F::splat(packet.parameter(3));
        let (on, off) = (F::Mask::splat(true), F::Mask::splat(false));
        let zero = F::splat(0.0);
        let mut first = 0;
        while first < RAYS {
            let packet = packet.at(first);
            let mut origin = [Vec3::new(zero, zero, zero); G];
            let mut direction = origin;
            let (mut t, mut limit) = ([zero; G], [zero; G]);
            let (mut active, mut hit) = ([on; G], [off; G]);
            for g in 0..G {
                let packet = packet.at(g * F::LANES);
                origin[g] = Vec3::load(packet.state(0));
                direction[g] = Vec3::load(packet.state(3));
                limit[g] = F::load(packet.state(6));
            }
            for _ in 0..64 {
                let mut live = off;
                for g in 0..G {
                    let q = direction[g].scale_add(t[g], origin[g]);
                    let across = P::sqrt(q.z.mul_add(q.z, q.x * q.x)) - major;
                    let distance = P::sqrt(across.mul_add(across, q.y * q.y)) - minor;
                    let near = distance.less(tolerance);
                    hit[g] = hit[g] | (active[g] & near);
                    active[g] = active[g].without(near);
                    t[g] = F::select(active[g], t[g] + distance, t[g]);
                    active[g] = active[g] & t[g].less(limit[g]);
                    live = live | active[g];
                }
                if !live.any() {
                    break;
                }
            }
            for g in 0..G {
                let packet = packet.at(g * F::LANES);
                P::store_where(t[g], hit[g], packet.state(6));
                P::store_where(id, hit[g], packet.scratch(0));
            }
            first += G * F::LANES;
        }
    }
}
