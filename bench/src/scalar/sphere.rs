//! Spheres.

use super::{Ray, Real, Scalar};
use crate::kernels::{CommonOriginSphere, Sphere, UnitSphere};

impl Scalar for Sphere {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        let d = ray.vector::<R>(3);
        let o = ray.vector::<R>(0) - ray.vector_parameter(0);
        let radius = ray.parameter::<R>(3);
        let (a, b) = (d.dot(d), o.dot(d));
        let c = o.dot(o) - radius * radius;
        let discriminant = b * b - a * c;
        if discriminant >= R::of(0.0) {
            let root = discriminant.sqrt();
            let inverse = R::of(1.0) / a;
            accept(ray, (-b - root) * inverse, (root - b) * inverse);
        }
    }
}

impl Scalar for UnitSphere {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        unit(ray, ray.vector::<R>(0) - ray.vector_parameter(0));
    }
}

impl Scalar for CommonOriginSphere {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        unit(ray, ray.vector_parameter::<R>(6) - ray.vector_parameter(0));
    }
}

#[inline(always)]
fn unit<R: Real>(ray: Ray, o: super::Vec3<R>) {
    let radius = ray.parameter::<R>(3);
    let b = o.dot(ray.vector(3));
    let c = o.dot(o) - radius * radius;
    let discriminant = b * b - c;
    if discriminant >= R::of(0.0) {
        let root = discriminant.sqrt();
        accept(ray, -b - root, root - b);
    }
}

#[inline(always)]
fn accept<R: Real>(ray: Ray, near: R, far: R) {
    let epsilon = ray.parameter::<R>(4);
    let t = if near > epsilon { near } else { far };
    if t > epsilon && t < ray.state(6) {
        ray.set_state(6, t);
        ray.set_scratch(0, ray.parameter::<R>(5));
    }
}
