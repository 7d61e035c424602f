//! Ward's highlight.

use std::f64::consts::{FRAC_1_PI, PI};

use super::{Ray, Real, Scalar, Vec3};
use crate::kernels::Ward;

impl Scalar for Ward {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        let view = -ray.vector::<R>(0);
        let light = ray.vector::<R>(3);
        let normal = ray.vector::<R>(6);
        let h = light + view;
        let (light_cosine, view_cosine) = (normal.dot(light), normal.dot(view));
        let mut value = Vec3::splat(0.0);
        if light_cosine > R::of(0.0) && view_cosine > R::of(0.0) {
            let (alpha_u, alpha_v) = (ray.parameter::<R>(0), ray.parameter::<R>(1));
            let z = h.dot(normal);
            let x = h.dot(ray.vector(9)) / alpha_u;
            let y = h.dot(ray.vector(12)) / alpha_v;
            let peak = (-(x * x + y * y) / (z * z)).exp();
            let cosines = (light_cosine * view_cosine).sqrt();
            let highlight = peak / (R::of(4.0 * PI) * alpha_u * alpha_v * cosines);
            let diffuse = ray.vector_parameter::<R>(2) * R::of(FRAC_1_PI);
            value = (diffuse + ray.vector_parameter::<R>(5) * highlight) * light_cosine;
        }
        ray.set_vector(15, value);
    }
}
