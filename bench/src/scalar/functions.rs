//! Elementary functions.

use super::{Ray, Real, Scalar};
use crate::kernels::{Exp, InverseSqrt, Log, Pow, SinCos};

impl Scalar for Exp {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        ray.set_state(1, ray.state::<R>(0).exp());
    }
}

impl Scalar for Log {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        ray.set_state(1, ray.state::<R>(0).log());
    }
}

impl Scalar for Pow {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        ray.set_state(2, ray.state::<R>(0).pow(ray.state(1)));
    }
}

impl Scalar for SinCos {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        let x = ray.state::<R>(0);
        ray.set_state(1, x.sin());
        ray.set_scratch(0, x.cos());
    }
}

impl Scalar for InverseSqrt {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        ray.set_state(1, R::of(1.0) / ray.state::<R>(0).sqrt());
    }
}
