//! Arithmetic with the same bits on every machine: only `+ - * /` and square roots, in a fixed order, without the
//! platform's trigonometry or powers. [`sampling`] contains samplers, hashes and pixel filters.

mod exponential;
mod moving_transform;
mod root;
pub mod sampling;
mod transform;
mod trigonometry;

pub use exponential::{exponential, logarithm_of_two, power, power_of_two};
pub use moving_transform::MovingTransform;
pub use root::{fifth_root, power_12_5};
pub use transform::{
    Affine, PackedTransform, Transform, USUAL_SQUARES, dot, normalize_or, reciprocal,
};
pub use trigonometry::sine_and_cosine_of_degrees;

/// The number of lanes of the vectors that renderers compute with: eight floats fill an AVX register. BVH nodes have as
/// many children, so that one ray is tested against all of them at once.
pub const SIMD_LANES: usize = 8;
