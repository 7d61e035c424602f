//! Numbers in [0,1) by counters: pixel, sample, stream and dimension give the number, whatever ray
//! was computed before, in whatever packet, on whatever thread.

mod filter;
mod hash;
mod sampler;
mod sobol;

pub use filter::{FilterShape, PixelFilter};
pub use hash::{hash, permute, unit_float};
pub use sampler::{ANY_COUNT, INDEPENDENT, POWER_OF_TWO, SOBOL, Sampler, SamplerKind, child_key};
