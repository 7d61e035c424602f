//! A triangle.

use super::{Ray, Real, Scalar};
use crate::kernels::Triangle;

impl Scalar for Triangle {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        let d = ray.vector::<R>(3);
        let (edge1, edge2) = (ray.vector_parameter(3), ray.vector_parameter(6));
        let tolerance = ray.parameter::<R>(9);
        let (zero, one) = (R::of(0.0), R::of(1.0));
        let p = d.cross(edge2);
        let determinant = edge1.dot(p);
        if determinant.abs() < tolerance {
            return;
        }
        let inverse = one / determinant;
        let o = ray.vector(0) - ray.vector_parameter(0);
        let u = o.dot(p) * inverse;
        if u < zero || u > one {
            return;
        }
        let q = o.cross(edge1);
        let v = d.dot(q) * inverse;
        if v < zero || u + v > one {
            return;
        }
        let t = edge2.dot(q) * inverse;
        if t > tolerance && t < ray.state(6) {
            ray.set_state(6, t);
            ray.set_scratch(0, ray.parameter::<R>(10));
            ray.set_scratch(1, u);
            ray.set_scratch(2, v);
        }
    }
}
