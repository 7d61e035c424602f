//! The interactive renderer: runs `shade` of materials for packets of rays.
//!
//! A tile of 8 by 8 pixels and one sample of each is a packet. Its way: the camera's
//! `generateRay`; the nearest hits, by the shapes' `intersect`; for the lanes of each object its
//! normals, texture coordinates and derivatives; for the lanes of each material its `shade`, whose
//! `trace` starts again with a packet of the rays that ask. What a ray brings back depends on that
//! ray alone; see [`crate::acceleration`] for hits and [`crate::sampling`] for random numbers.

mod area_light;
mod bounds;
mod camera;
mod compiled;
mod eight;
mod host;
mod intersection;
mod lane_context;
mod lane_streams;
mod light_samples;
mod mask_bits;
mod object_class;
mod placed_objects;
mod placement;
mod render;
mod request_lanes;
mod shaders;
mod shading;
mod specialisation;
mod surface;
mod tile_aovs;
mod tile_sample;
mod tiles;
mod variables;
mod work_counts;
mod workspace;

pub(crate) use camera::{CameraRays, TILE, Tile, camera_rays};
pub use compiled::{BuildStep, CompiledScene};
pub(crate) use host::ShadingHost;
pub(crate) use lane_context::LaneContext;
pub(crate) use render::exhausted_budgets;
pub use render::{RenderOptions, Rendered, render};
pub(crate) use shading::Tracer;
pub(crate) use surface::{prepare, runs};
pub(crate) use tile_aovs::visits_of_sample;
pub(crate) use tile_sample::{TileSample, TileSums, sample_tile};
pub(crate) use tiles::{RenderThreads, tiles_of};
pub(crate) use work_counts::WorkCounts;
pub(crate) use workspace::{Problems, Workspace};
