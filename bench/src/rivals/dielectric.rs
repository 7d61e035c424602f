//! Glass.

use super::Rival;
use super::lanes::{Floats, Mask};
use super::math::{exp2, log2, pow};
use super::precision::Precision;
use super::vector::Vec3;
use crate::kernels::Dielectric;
use crate::packet::{Packet, RAYS};

impl Rival for Dielectric {
    #[inline(always)]
    unsafe fn packet<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the race has these arrays and parameters, as the caller promises.
        unsafe {
            let absorption = Vec3::<F>::parameter(packet, 1);
            let base = if P::TUNED {
                Vec3::new(log2(absorption.x), log2(absorption.y), log2(absorption.z))
            } else {
                absorption
            };
            let mut lane = 0;
            while lane < RAYS {
                chunk::<F, P>(packet.at(lane), base);
                lane += F::LANES;
            }
        }
    }
}

/// # Safety
/// As for the kernel.
#[inline(always)]
unsafe fn chunk<F: Floats, P: Precision>(packet: Packet, base: Vec3<F>) {
    // Safety: the caller's promise.
    unsafe {
        let d = Vec3::<F>::load(packet.state(0));
        let normal = Vec3::<F>::load(packet.state(3));
        let signed = -d.dot(normal);
        let eta = packet.parameter(0);
        let r0 = ((eta - 1.0) / (eta + 1.0)) * ((eta - 1.0) / (eta + 1.0));
        let (zero, one) = (F::splat(0.0), F::splat(1.0));
        let inside = signed.less(zero);
        let cosine = signed.abs();
        let ratio = F::select(inside, F::splat(eta), F::splat(1.0 / eta));
        let normal = normal * F::select(inside, F::splat(-1.0), one);
        normal.scale_add(F::splat(2.0) * cosine, d).store(packet.state(7));

        let k = (ratio * ratio).neg_mul_add(cosine.neg_mul_add(cosine, one), one);
        let transmitted = P::sqrt(k);
        let total = k.less(zero);
        let bent = normal.scale_add(ratio.mul_sub(cosine, transmitted), d * ratio);
        Vec3::select(total, Vec3::new(zero, zero, zero), bent).store(packet.scratch(0));

        let m = one - F::select(inside, transmitted, cosine);
        let m2 = m * m;
        let schlick = (F::splat(1.0 - r0) * m2 * m2).mul_add(m, F::splat(r0));
        F::select(total, one, schlick).store(packet.state(13));

        let clear = Vec3::new(one, one, one);
        let mut transmittance = clear;
        if inside.any() {
            let t = F::load(packet.state(6));
            let absorbed = if P::TUNED {
                Vec3::new(exp2(t * base.x), exp2(t * base.y), exp2(t * base.z))
            } else {
                Vec3::new(pow(base.x, t), pow(base.y, t), pow(base.z, t))
            };
            transmittance = Vec3::select(inside, absorbed, clear);
        }
        transmittance.store(packet.state(10));
    }
}
