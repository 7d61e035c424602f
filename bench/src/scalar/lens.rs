//! A camera with a thin lens.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use super::{Ray, Real, Scalar};
use crate::kernels::Lens;

impl Scalar for Lens {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        let (one, two) = (R::of(1.0), R::of(2.0));
        let eye = ray.vector_parameter::<R>(0);
        let (right, up) = (ray.vector_parameter::<R>(3), ray.vector_parameter::<R>(6));
        let forward = ray.vector_parameter::<R>(9);
        let x = (ray.state::<R>(0) * ray.parameter(14) - one) * ray.parameter(12);
        let y = (ray.state::<R>(1) * ray.parameter(15) - one) * ray.parameter(13);
        let focus = eye + (forward + right * x + up * y) * ray.parameter(17);
        let (a, b) = (two * ray.state(2) - one, two * ray.state(3) - one);
        let (radius, angle) = if a == R::of(0.0) && b == R::of(0.0) {
            (R::of(0.0), R::of(0.0))
        } else if a.abs() > b.abs() {
            (a, R::of(FRAC_PI_4) * (b / a))
        } else {
            (b, R::of(FRAC_PI_2) - R::of(FRAC_PI_4) * (a / b))
        };
        let lens = ray.parameter::<R>(16);
        let origin =
            eye + right * (radius * angle.cos() * lens) + up * (radius * angle.sin() * lens);
        ray.set_vector(4, origin);
        ray.set_vector(7, (focus - origin).normalize());
    }
}
