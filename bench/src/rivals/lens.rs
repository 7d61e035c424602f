//! A camera with a thin lens.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use super::Chunk;
use super::lanes::Floats;
use super::math::{sin_cos, sin_cos_reduced};
use super::precision::Precision;
use super::vector::Vec3;
use crate::kernels::Lens;
use crate::packet::Packet;

impl Chunk for Lens {
    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the race has these arrays and parameters.
        unsafe {
            let load = |array| F::load(packet.state(array));
            let parameter = |index| F::splat(packet.parameter(index));
            let (one, two) = (F::splat(1.0), F::splat(2.0));
            let eye = Vec3::<F>::parameter(packet, 0);
            let right = Vec3::<F>::parameter(packet, 3);
            let up = Vec3::<F>::parameter(packet, 6);
            let forward = Vec3::<F>::parameter(packet, 9);
            let x = load(0).mul_sub(parameter(14), one) * parameter(12);
            let y = load(1).mul_sub(parameter(15), one) * parameter(13);
            let towards = up.scale_add(y, right.scale_add(x, forward));
            let focus = towards.scale_add(parameter(17), eye);

            let (a, b) = (two.mul_sub(load(2), one), two.mul_sub(load(3), one));
            let wide = a.abs().greater(b.abs());
            let radius = F::select(wide, a, b);
            let other = F::select(wide, b, a);
            let divisor = F::select(radius.equal(F::splat(0.0)), one, radius);
            let angle = F::splat(FRAC_PI_4) * P::divide(other, divisor);
            let (sine, cosine) = if P::TUNED {
                let (s, c) = sin_cos_reduced(angle);
                (F::select(wide, s, c), F::select(wide, c, s))
            } else {
                sin_cos(F::select(wide, angle, F::splat(FRAC_PI_2) - angle))
            };
            let lens = parameter(16);
            let across = right.scale_add(radius * cosine * lens, eye);
            let origin = up.scale_add(radius * sine * lens, across);
            origin.store(packet.state(4));
            let direction = focus - origin;
            (direction * P::inverse_sqrt(direction.dot(direction))).store(packet.state(7));
        }
    }
}
