//! A torus found by steps.

use super::{Ray, Real, Scalar};
use crate::kernels::Torus;

impl Scalar for Torus {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        let (o, d, limit) = (ray.vector::<R>(0), ray.vector::<R>(3), ray.state(6));
        let mut t = R::of(0.0);
        let mut found = false;
        for _ in 0..64 {
            let q = o + d * t;
            let across = (q.x * q.x + q.z * q.z).sqrt() - ray.parameter(0);
            let distance = (across * across + q.y * q.y).sqrt() - ray.parameter(1);
            if distance < ray.parameter(2) {
                found = true;
                break;
            }
            t += distance;
            // Also where it is no number.
            if t.partial_cmp(&limit) != Some(std::cmp::Ordering::Less) {
                break;
            }
        }
        if found {
            ray.set_state(6, t);
            ray.set_scratch(0, ray.parameter::<R>(3));
        }
    }
}
