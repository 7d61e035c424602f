//! A triangle after Moeller and Trumbore.

use super::Chunk;
use super::lanes::Floats;
use super::precision::Precision;
use super::vector::Vec3;
use crate::kernels::Triangle;
use crate::packet::Packet;

impl Chunk for Triangle {
    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the race has these arrays and parameters.
        unsafe {
            let d = Vec3::<F>::load(packet.state(3));
            let (edge1, edge2) = (Vec3::parameter(packet, 3), Vec3::parameter(packet, 6));
            let tolerance = F::splat(packet.parameter(9));
            let p = d.cross(edge2);
            let o = Vec3::load(packet.state(0)) - Vec3::parameter(packet, 0);
            let q = o.cross(edge1);
            let determinant = edge1.dot(p);
            let inverse = P::reciprocal(determinant);
            let u = o.dot(p) * inverse;
            let v = d.dot(q) * inverse;
            let t = edge2.dot(q) * inverse;
            let (zero, one) = (F::splat(0.0), F::splat(1.0));
            let distance = packet.state(6);
            let hit = determinant.abs().greater_equal(tolerance)
                & u.greater_equal(zero)
                & u.less_equal(one)
                & v.greater_equal(zero)
                & (u + v).less_equal(one)
                & t.greater(tolerance)
                & t.less(F::load(distance));
            P::store_where(t, hit, distance);
            P::store_where(F::splat(packet.parameter(10)), hit, packet.scratch(0));
            P::store_where(u, hit, packet.scratch(1));
            P::store_where(v, hit, packet.scratch(2));
        }
    }
}
