//! A sample of GGX's visible normals.

use std::f32::consts::{PI, TAU};

use super::Chunk;
use super::lanes::Floats;
use super::math::{sin_cos, sin_cos_of_turn};
use super::precision::Precision;
use super::vector::Vec3;
use crate::kernels::Ggx;
use crate::packet::Packet;

impl Chunk for Ggx {
    #[inline(always)]
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet) {
        // Safety: the race has these arrays and parameters.
        unsafe {
            let d = Vec3::<F>::load(packet.state(0));
            let normal = Vec3::load(packet.state(3));
            let tangent = Vec3::load(packet.state(6));
            let across = Vec3::load(packet.state(9));
            let (alpha_x, alpha_y) = (packet.parameter(0), packet.parameter(1));
            let alpha = [F::splat(alpha_x), F::splat(alpha_y)];
            let view = Vec3::new(-d.dot(tangent), -d.dot(across), -d.dot(normal));
            let (zero, one, four) = (F::splat(0.0), F::splat(1.0), F::splat(4.0));

            let seed = [F::load(packet.state(12)), F::load(packet.state(13))];
            let halfway = visible_normal::<F, P>(view, alpha, seed);
            let cosine = view.dot(halfway);
            let twice = F::splat(2.0) * cosine;
            let light = Vec3::new(
                twice.mul_sub(halfway.x, view.x),
                twice.mul_sub(halfway.y, view.y),
                twice.mul_sub(halfway.z, view.z),
            );
            let lit = view.z.greater(zero) & light.z.greater(zero);

            let (x, y) = if P::TUNED {
                (halfway.x * F::splat(1.0 / alpha_x), halfway.y * F::splat(1.0 / alpha_y))
            } else {
                (halfway.x / alpha[0], halfway.y / alpha[1])
            };
            let square = halfway.z.mul_add(halfway.z, y.mul_add(y, x * x));
            let own = lambda::<F, P>(view, alpha);
            let other = lambda::<F, P>(light, alpha);
            let widths = F::splat(PI * alpha_x * alpha_y) * square * square;
            let m = one - cosine;
            let m2 = m * m;
            let schlick = m2 * m2 * m;
            // The tuned form divides once for all three quotients.
            let towards = four * view.z;
            let (visible, both) = ((one + own) * towards, (one + own + other) * towards * light.z);
            let (pdf, scale) = if P::TUNED {
                let inverse = P::reciprocal(widths * visible * both);
                (inverse * both, inverse * visible)
            } else {
                let density = one / widths;
                (density / visible, density / both)
            };
            let reflectance = Vec3::<F>::parameter(packet, 2);
            let fresnel = Vec3::new(
                (one - reflectance.x).mul_add(schlick, reflectance.x),
                (one - reflectance.y).mul_add(schlick, reflectance.y),
                (one - reflectance.z).mul_add(schlick, reflectance.z),
            );
            let direction = tangent.scale_add(light.x, across.scale_add(light.y, normal * light.z));
            Vec3::select(lit, direction, Vec3::new(zero, zero, one)).store(packet.state(15));
            Vec3::select(lit, fresnel * scale, Vec3::new(zero, zero, zero)).store(packet.state(18));
            F::select(lit, pdf, zero).store(packet.state(21));
        }
    }
}

/// By a point on the spherical cap that the view sees (Dupuy and Benyoub, HPG 2023).
#[inline(always)]
fn visible_normal<F: Floats, P: Precision>(view: Vec3<F>, alpha: [F; 2], u: [F; 2]) -> Vec3<F> {
    let one = F::splat(1.0);
    let stretched = normalize::<F, P>(Vec3::new(view.x * alpha[0], view.y * alpha[1], view.z));
    let z = (one - u[0]).mul_sub(one + stretched.z, stretched.z);
    let radius = P::sqrt(z.neg_mul_add(z, one).max(F::splat(0.0)));
    let (sine, cosine) =
        if P::TUNED { sin_cos_of_turn(u[1]) } else { sin_cos(u[1] * F::splat(TAU)) };
    let x = radius.mul_add(cosine, stretched.x);
    let y = radius.mul_add(sine, stretched.y);
    let z = (z + stretched.z).max(F::splat(1e-6));
    normalize::<F, P>(Vec3::new(x * alpha[0], y * alpha[1], z))
}

#[inline(always)]
fn normalize<F: Floats, P: Precision>(v: Vec3<F>) -> Vec3<F> {
    v * P::inverse_sqrt(v.dot(v))
}

/// Smith's auxiliary function.
#[inline(always)]
fn lambda<F: Floats, P: Precision>(v: Vec3<F>, alpha: [F; 2]) -> F {
    let (one, half) = (F::splat(1.0), F::splat(0.5));
    let inverse = P::reciprocal(v.z);
    let (x, y) = (alpha[0] * v.x * inverse, alpha[1] * v.y * inverse);
    half.mul_sub(P::sqrt(y.mul_add(y, x.mul_add(x, one))), half)
}
