//! The surfaces of hits for methods that hosts call: kernels of the methods of shapes between functions of
//! `prelude/renderer/surface.rtsl`, for which the places of the shapes are data.

mod hit_lanes;
mod places;
mod surface_kernels;
mod transforms;

pub use hit_lanes::{HitLanes, ObjectHit};
pub use surface_kernels::{ReadSurfaces, SurfaceCall, SurfaceKernels};
pub use transforms::SurfaceTransforms;
