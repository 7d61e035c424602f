//! Kernels written by hand with SIMD intrinsics, with which RTSL is compared.
//!
//! Each kernel is written once over [`lanes::Floats`] and instantiated for AVX2 with 8 lanes and for AVX-512 with 16;
//! and once over [`precision::Precision`]: straightforward, with the processor's division and square root, and tuned,
//! with estimates and one step of Newton's method, uniform work done once a packet and, where it pays, several vectors
//! at a time.
//!
//! This is `unsafe` on purpose: it represents code written for speed without a compiler like RTSL's. It reads and
//! writes aligned arrays through pointers, unchecked, and calls intrinsics that the processor may lack. [`available`]
//! queries the processor, and [`Written`] checks the arrays.
#![allow(unsafe_code, reason = "hand-written SIMD is what RTSL is compared with")]
#![allow(clippy::missing_safety_doc, reason = "`Rival` and `Chunk` say it for all kernels")]

mod avx2;
mod avx512;
mod dielectric;
mod functions;
mod ggx;
mod lanes;
mod lens;
pub mod libraries;
mod math;
mod noise;
mod precision;
mod quartic_torus;
mod sphere;
pub mod subnormals;
mod torus;
mod triangle;
mod vector;
mod ward;

use crate::kernels::Kernel;
use crate::packet::{Packet, RAYS};
use crate::written::Written;
use lanes::Floats;
use libraries::Function;
use precision::{Exact, Precision, Tuned};

/// A kernel for a packet of 64 rays.
pub trait Rival {
    /// Its name in vector libraries whose functions are contenders too.
    const FUNCTION: Option<Function> = None;

    /// Processes the packet.
    ///
    /// # Safety
    /// The packet has the arrays and parameters that [`crate::kernels`] names, aligned to 64 bytes, and the processor
    /// has the instructions of `F`.
    unsafe fn packet<F: Floats, P: Precision>(packet: Packet);
}

/// A kernel without work that is shared by all rays.
pub trait Chunk {
    /// As for [`Rival`].
    const FUNCTION: Option<Function> = None;

    /// Processes the first rays of the packet, as many as there are lanes.
    ///
    /// # Safety
    /// As for [`Rival::packet`].
    unsafe fn chunk<F: Floats, P: Precision>(packet: Packet);
}

impl<C: Chunk> Rival for C {
    const FUNCTION: Option<Function> = C::FUNCTION;

    #[inline(always)]
    unsafe fn packet<F: Floats, P: Precision>(packet: Packet) {
        let mut lane = 0;
        while lane < RAYS {
            // Safety: as promised by the caller; the lanes are those of the packet.
            unsafe { C::chunk::<F, P>(packet.at(lane)) };
            lane += F::LANES;
        }
    }
}

/// Returns the hand-written forms of a kernel that this processor supports, by name, and the libraries' forms that this
/// machine has.
pub fn available<K: Kernel + Rival>() -> Vec<(&'static str, Written)> {
    let mut forms = Vec::new();
    if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        forms.push(("h256", Written::new::<K>(with_avx2::<K, Exact>)));
        forms.push(("h256t", Written::new::<K>(with_avx2::<K, Tuned>)));
        let functions = K::FUNCTION.into_iter().flat_map(libraries::available);
        forms.extend(functions.map(|(name, function)| (name, Written::library::<K>(function))));
    }
    if has_avx512() {
        forms.push(("h512", Written::new::<K>(with_avx512::<K, Exact>)));
        forms.push(("h512t", Written::new::<K>(with_avx512::<K, Tuned>)));
    }
    forms
}

/// True if this processor has the instructions of the AVX-512 forms.
pub fn has_avx512() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
}

#[target_feature(enable = "avx2,fma")]
unsafe fn with_avx2<R: Rival, P: Precision>(
    state: &mut [f32],
    scratch: &mut [f32],
    parameters: &[f32],
) {
    // Safety: as promised by the caller.
    unsafe { R::packet::<avx2::F8, P>(Packet::new(state, scratch, parameters)) }
}

#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
unsafe fn with_avx512<R: Rival, P: Precision>(
    state: &mut [f32],
    scratch: &mut [f32],
    parameters: &[f32],
) {
    // Safety: as promised by the caller.
    unsafe { R::packet::<avx512::F16, P>(Packet::new(state, scratch, parameters)) }
}
