//! Races: kernels compiled from RTSL against the same kernels written by hand with SIMD
//! intrinsics.
//!
//! A [`Race`] is one kernel: an RTSL text in `shaders/`, a scalar version that defines what it computes,
//! and hand-written rivals. All work on the same packets of 64 rays in the same memory.
//! [`contenders`] makes them runnable, [`compare`] checks that they agree, [`measure`] times them,
//! interleaved, and [`report`] prints the table.

pub mod arena;
pub mod command;
pub mod compare;
pub mod contenders;
pub mod kernels;
pub mod leaf;
pub mod measure;
mod packet;
pub mod race;
mod races;
mod random;
pub mod report;
#[cfg(target_arch = "x86_64")]
mod rivals;
mod scalar;
mod written;

pub use race::{Race, races};
