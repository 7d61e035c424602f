//! Glass.

use super::{Ray, Real, Scalar, Vec3};
use crate::kernels::Dielectric;

impl Scalar for Dielectric {
    #[inline(always)]
    fn ray<R: Real>(ray: Ray) {
        let (d, mut normal) = (ray.vector::<R>(0), ray.vector::<R>(3));
        let (zero, one) = (R::of(0.0), R::of(1.0));
        let eta = ray.parameter::<R>(0);
        let mut cosine = -d.dot(normal);
        let mut ratio = one / eta;
        let mut transmittance = Vec3::splat(1.0);
        let inside = cosine < zero;
        if inside {
            cosine = -cosine;
            normal = -normal;
            ratio = eta;
            let absorption = ray.vector_parameter::<R>(1);
            let t = ray.state(6);
            transmittance =
                Vec3::new(absorption.x.pow(t), absorption.y.pow(t), absorption.z.pow(t));
        }
        let k = one - ratio * ratio * (one - cosine * cosine);
        let mut reflectance = one;
        let mut refracted = Vec3::splat(0.0);
        if k >= zero {
            let transmitted = k.sqrt();
            refracted = d * ratio + normal * (ratio * cosine - transmitted);
            let r0 = (eta - one) / (eta + one);
            let r0 = r0 * r0;
            let m = one - if inside { transmitted } else { cosine };
            let m2 = m * m;
            reflectance = r0 + (one - r0) * m2 * m2 * m;
        }
        ray.set_vector(7, d + normal * (R::of(2.0) * cosine));
        ray.set_vector(10, transmittance);
        ray.set_state(13, reflectance);
        ray.set_scratch(0, refracted.x);
        ray.set_scratch(1, refracted.y);
        ray.set_scratch(2, refracted.z);
    }
}
