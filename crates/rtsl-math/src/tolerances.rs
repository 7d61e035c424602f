//! Tolerances of surfaces and lights, for what renderers compute in Rust. The texts in `prelude/renderer` have the
//! same, so that both compute the same bits.

/// The error of a point on a surface, relative to the sizes of its coordinates: 16 roundings, the sum for a ray's
/// transformation and the test of a triangle, or of a carefully written sphere, for the ray that found the point and
/// the one that leaves it.
pub const SURFACE_ERROR: f32 = 16.0 * (f32::EPSILON / 2.0);

/// The error of a point that is transformed from the space of its shape to the world, moved along the normal, and
/// transformed back with the ray that begins there, relative to the sizes of its coordinates in both: three roundings
/// for each map, one for its coefficients, and one for the move.
pub const TRANSFORM_ERROR: f32 = 5.0 * (f32::EPSILON / 2.0);

/// The least cosine for which footprints are computed; smaller ones are clamped.
pub const MIN_FOOTPRINT_COSINE: f32 = 0.01;

/// The part of the distance to a light without a shape by which shadow rays are shorter, so that the surface on which
/// the light is mounted does not block it.
pub const LIGHT_MARGIN: f32 = 1e-4;

/// The greatest part of the distance to a sample of a shape by which shadow rays are shorter: rounding at silhouettes.
pub const MAX_SHAPE_MARGIN: f32 = 1e-3;

/// The least change of squared lengths that is not rounding in a rotation.
pub const STRETCH_ROUNDING: f32 = 1e-4;
