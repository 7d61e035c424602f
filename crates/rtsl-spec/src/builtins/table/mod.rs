//! The entries, one file for a chapter or two.

mod color;
mod common;
mod exponential;
mod geometric;
mod integer;
mod integrators;
mod noise;
mod ray_tracing;
mod sampling;
mod scattering;
mod trigonometry;

use super::Builtin;

pub(super) use integrators::{RADIANCE, STRUCT_METHODS};

/// The chapters in the order of the manual.
pub(super) static CHAPTERS: &[&[Builtin]] = &[
    trigonometry::TRIGONOMETRY,
    exponential::EXPONENTIAL,
    common::COMMON,
    common::DERIVATIVES,
    common::PACKING,
    geometric::GEOMETRIC,
    geometric::MATRIX,
    integer::RELATIONAL,
    integer::INTEGER,
    color::COLOR,
    ray_tracing::RAY_TRACING,
    integrators::INTEGRATORS,
    noise::NOISE,
    sampling::SAMPLING,
    scattering::SCATTERING,
    integer::INTRINSIC,
    integrators::INTRINSIC,
];
