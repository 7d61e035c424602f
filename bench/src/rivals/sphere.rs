//! Spheres: general, for unit directions, for a common origin.

use super::lanes::Floats;
use super::precision::Precision;
use super::vector::Vec3;
use super::{Chunk, Rival};
use crate::kernels::{CommonOriginSphere, Sphere, UnitSphere};
use crate::packet::Packet;

const CENTER: usize = 0;
const RADIUS: usize = 3;
const EPSILON: usize = 4;
const ID: usize = 5;
const ORIGIN: usize = 6;

impl Chunk for Sphere {
    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the race has these arrays and parameters, as the caller promises.
        unsafe {
            let d = Vec3::<F>::load(packet.state(3));
            let o = Vec3::<F>::load(packet.state(0)) - Vec3::parameter(packet, CENTER);
            let radius = packet.parameter(RADIUS);
            let (a, b) = (d.dot(d), o.dot(d));
            let c = o.dot(o) - F::splat(radius * radius);
            let discriminant = a.neg_mul_add(c, b * b);
            let root = P::sqrt(discriminant);
            let inverse = P::reciprocal(a);
            let (near, far) = ((-b - root) * inverse, (root - b) * inverse);
            accept::<F, P>(packet, discriminant, near, far);
        }
    }
}

impl Chunk for UnitSphere {
    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the caller's promise.
        unsafe {
            let d = Vec3::<F>::load(packet.state(3));
            let o = Vec3::<F>::load(packet.state(0)) - Vec3::parameter(packet, CENTER);
            let radius = packet.parameter(RADIUS);
            let b = o.dot(d);
            let c = o.dot(o) - F::splat(radius * radius);
            let discriminant = b.mul_sub(b, c);
            let root = P::sqrt(discriminant);
            accept::<F, P>(packet, discriminant, -b - root, root - b);
        }
    }
}

impl Rival for CommonOriginSphere {
    #[inline(always)]
    unsafe fn packet<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the caller's promise.
        unsafe {
            let parameter = |index| packet.parameter(index);
            let x = parameter(ORIGIN) - parameter(CENTER);
            let y = parameter(ORIGIN + 1) - parameter(CENTER + 1);
            let z = parameter(ORIGIN + 2) - parameter(CENTER + 2);
            let c = x * x + y * y + z * z - parameter(RADIUS) * parameter(RADIUS);
            let (o, c) = (Vec3::<F>::splat(x, y, z), F::splat(c));
            let mut lane = 0;
            while lane < crate::packet::RAYS {
                let packet = packet.at(lane);
                let b = o.dot(Vec3::load(packet.state(3)));
                let discriminant = b.mul_sub(b, c);
                let root = P::sqrt(discriminant);
                accept::<F, P>(packet, discriminant, -b - root, root - b);
                lane += F::LANES;
            }
        }
    }
}

/// Stores the nearer distance that counts.
///
/// # Safety
/// As for the kernels.
#[inline(always)]
unsafe fn accept<F: Floats, P: Precision>(packet: Packet, discriminant: F, near: F, far: F) {
    // Safety: the caller's promise.
    unsafe {
        let epsilon = F::splat(packet.parameter(EPSILON));
        let t = F::select(near.greater(epsilon), near, far);
        let distance = packet.state(6);
        let hit = discriminant.greater_equal(F::splat(0.0))
            & t.greater(epsilon)
            & t.less(F::load(distance));
        P::store_where(t, hit, distance);
        P::store_where(F::splat(packet.parameter(ID)), hit, packet.scratch(0));
    }
}
