//! The interactive renderer: calls `shade` of materials for packets of rays.
//!
//! One sample of a tile of 8 by 8 pixels is a packet. It is processed in these steps: the camera's `generateRay`; the
//! closest hits, by the shapes' `intersect`; for the lanes of each object its normals, texture coordinates and
//! derivatives; for the lanes of each material its `shade`, whose `trace` repeats this with a packet of the requested
//! rays. The radiance of a ray depends on that ray alone; see [`rtsl_bvh`] for hits and [`rtsl_math::sampling`] for
//! random numbers.

mod area_light;
mod host;
mod light_samples;
mod render;
mod shading;
mod surface;
mod tile_aovs;
mod tile_sample;
mod workspace;

pub use crate::execution::Rendered;
pub(crate) use host::ShadingHost;
pub use render::{AOVS, RenderOptions, render};
pub(crate) use surface::{hit_groups, prepare};
pub(crate) use tile_aovs::visits_of_sample;
pub(crate) use tile_sample::{TileSample, TileSums, mean, sample_tile};
pub(crate) use workspace::{Workspace, rays_of};
