//! Counter-based numbers in [0,1): pixel, sample, stream and dimension determine the number, independent of the order
//! of rays, of packets and of threads.

mod filter;
mod hash;
mod sampler;
mod sobol;

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
pub use hash::{hash, permute, unit_float};
pub use sampler::{PixelKeys, Sampler, SamplerKind, child_key};
