//! The surfaces of hits for methods that hosts call: kernels of the methods of shapes between functions of
//! `prelude/renderer/surface.rtsl`, for which the places of the shapes are data.

mod places;
mod surface_kernels;

pub use places::Places;
pub use surface_kernels::{ReadSurfaces, SurfaceCall, SurfaceKernels};
