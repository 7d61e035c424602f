//! The kernels for one ray at a time: what each computes, by definition. In double precision they
//! are the reference that all contenders are compared with; in single precision a contender.
#![allow(unsafe_code, reason = "reads and writes packets as the hand-written kernels do")]

mod dielectric;
mod functions;
mod ggx;
mod lens;
mod noise;
mod quartic_torus;
mod real;
mod sphere;
mod torus;
mod triangle;
mod vector;
mod ward;

use crate::kernels::Kernel;
use crate::packet::{Packet, RAYS};
use crate::written::Written;
use real::Real;
use vector::Vec3;

/// A kernel for one ray.
pub trait Scalar {
    /// Does the ray.
    fn ray<R: Real>(ray: Ray);
}

/// A ray of a packet. Only [`single`] and [`double`] make one, of packets that have the arrays
/// and parameters of the race; so reading and writing them is sound. Indices of a table are sums of its own values and
/// bytes, which are below its length, since it is a permutation of bytes, twice.
#[derive(Clone, Copy, Debug)]
pub struct Ray(Packet);

impl Ray {
    #[inline(always)]
    fn state<R: Real>(self, array: usize) -> R {
        // Safety: see the type.
        R::from_f32(unsafe { *self.0.state(array) })
    }

    #[inline(always)]
    fn vector<R: Real>(self, array: usize) -> Vec3<R> {
        Vec3::new(self.state(array), self.state(array + 1), self.state(array + 2))
    }

    #[inline(always)]
    fn parameter<R: Real>(self, index: usize) -> R {
        // Safety: see the type.
        R::from_f32(unsafe { self.0.parameter(index) })
    }

    #[inline(always)]
    fn vector_parameter<R: Real>(self, index: usize) -> Vec3<R> {
        Vec3::new(self.parameter(index), self.parameter(index + 1), self.parameter(index + 2))
    }

    #[inline(always)]
    fn table(self, index: u32) -> u32 {
        // Safety: see the type.
        unsafe { self.0.parameter(index as usize) }.to_bits()
    }

    #[inline(always)]
    fn set_state<R: Real>(self, array: usize, value: R) {
        // Safety: see the type.
        unsafe { *self.0.state(array) = value.to_f32() }
    }

    #[inline(always)]
    fn set_vector<R: Real>(self, array: usize, value: Vec3<R>) {
        self.set_state(array, value.x);
        self.set_state(array + 1, value.y);
        self.set_state(array + 2, value.z);
    }

    #[inline(always)]
    fn set_scratch<R: Real>(self, array: usize, value: R) {
        // Safety: see the type.
        unsafe { *self.0.scratch(array) = value.to_f32() }
    }
}

/// The kernel in single precision, ray by ray.
pub fn single<K: Kernel + Scalar>() -> Written {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        return Written::new::<K>(single_with_avx2::<K>);
    }
    Written::new::<K>(each::<K, f32>)
}

/// The kernel in double precision: the reference.
pub fn double<K: Kernel + Scalar>() -> Written {
    Written::new::<K>(each::<K, f64>)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn single_with_avx2<S: Scalar>(state: &mut [f32], scratch: &mut [f32], parameters: &[f32]) {
    // Safety: as promised by the caller.
    unsafe { each::<S, f32>(state, scratch, parameters) }
}

#[inline(always)]
unsafe fn each<S: Scalar, R: Real>(state: &mut [f32], scratch: &mut [f32], parameters: &[f32]) {
    let packet = Packet::new(state, scratch, parameters);
    for lane in 0..RAYS {
        // Hidden from the compiler's own vectoriser.
        let lane = std::hint::black_box(lane);
        // Safety: as promised by the caller.
        S::ray::<R>(Ray(unsafe { packet.at(lane) }));
    }
}
