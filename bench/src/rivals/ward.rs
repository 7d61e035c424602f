//! Ward's highlight.

use std::f32::consts::{FRAC_1_PI, PI};

use super::Chunk;
use super::lanes::Floats;
use super::math::exp;
use super::precision::Precision;
use super::vector::Vec3;
use crate::kernels::Ward;
use crate::packet::Packet;

impl Chunk for Ward {
    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the race has these arrays and parameters.
        unsafe {
            let ray = Vec3::<F>::load(packet.state(0));
            let light = Vec3::<F>::load(packet.state(3));
            let normal = Vec3::<F>::load(packet.state(6));
            let h = light - ray;
            let (light_cosine, view_cosine) = (normal.dot(light), -normal.dot(ray));
            let z = h.dot(normal);
            let x = h.dot(Vec3::load(packet.state(9)));
            let y = h.dot(Vec3::load(packet.state(12)));
            let (alpha_u, alpha_v) = (packet.parameter(0), packet.parameter(1));
            let widths = 4.0 * PI * alpha_u * alpha_v;
            let cosines = light_cosine * view_cosine;
            let highlight = if P::TUNED {
                let (x, y) = (x * F::splat(1.0 / alpha_u), y * F::splat(1.0 / alpha_v));
                let slope = y.mul_add(y, x * x) * P::reciprocal(z * z);
                exp(-slope) * F::splat(1.0 / widths) * P::inverse_sqrt(cosines)
            } else {
                let (x, y) = (x / F::splat(alpha_u), y / F::splat(alpha_v));
                let slope = y.mul_add(y, x * x) / (z * z);
                exp(-slope) / (F::splat(widths) * P::sqrt(cosines))
            };
            let zero = F::splat(0.0);
            let diffuse = Vec3::parameter(packet, 2) * F::splat(FRAC_1_PI);
            let specular = Vec3::parameter(packet, 5);
            let value = specular.scale_add(highlight, diffuse) * light_cosine;
            let lit = light_cosine.greater(zero) & view_cosine.greater(zero);
            Vec3::select(lit, value, Vec3::new(zero, zero, zero)).store(packet.state(15));
        }
    }
}
