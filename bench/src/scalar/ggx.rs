//! A sample of GGX's visible normals.

use std::f64::consts::{PI, TAU};

use super::{Ray, Real, Scalar, Vec3};
use crate::kernels::Ggx;

impl Scalar for Ggx {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        let d = -ray.vector::<R>(0);
        let (normal, tangent, across) = (ray.vector(3), ray.vector(6), ray.vector(9));
        let alpha = [ray.parameter::<R>(0), ray.parameter(1)];
        let view = Vec3::new(d.dot(tangent), d.dot(across), d.dot(normal));
        let (zero, one, four) = (R::of(0.0), R::of(1.0), R::of(4.0));
        let mut direction = Vec3::new(zero, zero, one);
        let (mut value, mut pdf) = (Vec3::splat(0.0), zero);
        if view.z > zero {
            let halfway = visible_normal(view, alpha, [ray.state(12), ray.state(13)]);
            let cosine = view.dot(halfway);
            let light = halfway * (R::of(2.0) * cosine) - view;
            if light.z > zero {
                let (x, y) = (halfway.x / alpha[0], halfway.y / alpha[1]);
                let square = x * x + y * y + halfway.z * halfway.z;
                let density = one / (R::of(PI) * alpha[0] * alpha[1] * square * square);
                let (own, other) = (lambda(view, alpha), lambda(light, alpha));
                let m = one - cosine;
                let schlick = m * m * (m * m) * m;
                let scale = density / ((one + own + other) * four * view.z * light.z);
                let fresnel = |reflectance: R| reflectance + (one - reflectance) * schlick;
                let reflectance = ray.vector_parameter::<R>(2);
                value = Vec3::new(
                    fresnel(reflectance.x),
                    fresnel(reflectance.y),
                    fresnel(reflectance.z),
                ) * scale;
                pdf = density / ((one + own) * four * view.z);
                direction = tangent * light.x + across * light.y + normal * light.z;
            }
        }
        ray.set_vector(15, direction);
        ray.set_vector(18, value);
        ray.set_state(21, pdf);
    }
}

/// By a point on the spherical cap that the view sees (Dupuy and Benyoub, HPG 2023).
#[inline(always)]
fn visible_normal<R: Real>(view: Vec3<R>, alpha: [R; 2], u: [R; 2]) -> Vec3<R> {
    let stretched = Vec3::new(view.x * alpha[0], view.y * alpha[1], view.z).normalize();
    let z = (R::of(1.0) - u[0]) * (R::of(1.0) + stretched.z) - stretched.z;
    let radius = (R::of(1.0) - z * z).max(R::of(0.0)).sqrt();
    let angle = R::of(TAU) * u[1];
    let middle = Vec3::new(radius * angle.cos(), radius * angle.sin(), z) + stretched;
    Vec3::new(middle.x * alpha[0], middle.y * alpha[1], middle.z.max(R::of(1e-6))).normalize()
}

/// Smith's auxiliary function.
#[inline(always)]
fn lambda<R: Real>(v: Vec3<R>, alpha: [R; 2]) -> R {
    let (x, y) = (alpha[0] * v.x / v.z, alpha[1] * v.y / v.z);
    R::of(0.5) * ((R::of(1.0) + x * x + y * y).sqrt() - R::of(1.0))
}
