//! The batch renderer: an integrator on all samples of an image.
//!
//! A thread takes a tile and a range of its samples: one *wavefront* of paths, which the integrator's stages advance
//! together (folder `integrator`). Everything that stages are not linked with is called by this folder for *shading
//! batches*: surfaces of one *group*, shapes of one class with materials of one class. Searches take packets of 64 rays
//! or streams of a thousand ([`rtsl_bvh`]).
//!
//! Random numbers depend on the pixel, the sample and the path alone, so the image does not depend on the wavefront,
//! its size, or the thread.

mod alpha;
mod aov_plan;
mod checkpoints;
mod features;
mod film;
mod group_plan;
mod hit_surfaces;
mod instance_classes;
mod integrator;
mod kernels;
mod lights;
mod material;
mod material_calls;
mod memory;
mod object_entry;
mod partial_render;
mod path_tracer;
mod random_numbers;
mod render;
mod render_identity;
mod rows;
mod sample_sums;
mod samples;
mod scene;
mod scene_builder;
mod searcher;
mod shading_batch;
mod shading_methods;
mod shadow_rays;
mod sky_calls;
mod surface;
mod surface_group;
mod tile_order;
mod tracer;
mod visits;
mod wavefront;

pub use crate::tiles::TILE;
pub(crate) use aov_plan::{AovPlan, outputs_of};
pub use checkpoints::Checkpoints;
pub(crate) use features::Features;
pub(crate) use film::BatchFilm;
pub(crate) use hit_surfaces::HitSurfaces;
pub use integrator::Evaluation;
pub(crate) use integrator::ShadedSurface;
pub(crate) use memory::BatchMemory;
pub use partial_render::{Part, PartialRender, WorkCounts};
pub(crate) use path_tracer::PathTracer;
pub use render::{BatchOptions, BatchRendered, render};
pub use render_identity::RenderIdentity;
pub(crate) use render_identity::fingerprint;
pub use scene::BatchScene;
pub use scene_builder::{BatchSceneBuilder, integrator_of};
pub use wavefront::SAMPLES_IN_WAVEFRONT;
pub(crate) use wavefront::tiles_of_wavefront;
