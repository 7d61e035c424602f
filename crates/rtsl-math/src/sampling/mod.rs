//! The settings of samplers, hashes for keys of sequences, and tables of pixel filters. What they mean is text,
//! `prelude/renderer/sampler.rtsl` and `camera.rtsl`, which stages and hosts share.

mod filter;
mod hash;
mod sampler;

/// Selects, among the sequences of a path, that of single dimensions of an integrator.
pub const NUMBERS_OF_SINGLES: u32 = 0x201;
/// Selects that of pairs of dimensions.
pub const NUMBERS_OF_PAIRS: u32 = 0x202;
/// Selects that of the numbers that `rand()` draws.
pub const NUMBERS_OF_RAND: u32 = 0x203;
/// Selects the sequences of calls of `shade` among those of a path.
pub const NUMBERS_OF_SHADE: u32 = 0x206;

/// Selects the sequences of light samples of an integrator, one for each of them.
pub const NUMBERS_OF_LIGHT_SAMPLES: u32 = 0x205;
/// Selects the sequences of an integrator's calls of materials that draw numbers, one for each of them.
pub const NUMBERS_OF_MATERIAL_CALLS: u32 = 0x204;
/// Selects the sequence of a vertex's random numbers for lights.
pub const NUMBERS_OF_LIGHTS: u32 = 0x101;
/// Selects that for shapes and, in integrators, for materials.
pub const NUMBERS_OF_SHAPES: u32 = 0x102;

pub use filter::{AxisTable, FilterShape, PixelFilter};
pub use hash::{hash, unit_float};
pub use sampler::{Sampler, SamplerKind, child_key};
