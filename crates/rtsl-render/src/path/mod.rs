//! The path renderer: wavefront path tracing by the sampling and evaluation methods of materials.
//!
//! A thread takes a tile and a range of its samples: one *wavefront* of paths. The wavefront advances from surface to
//! surface as a whole. In each step:
//!
//! 1. The closest hits of all rays are found, in packets of 64 or streams of a thousand ([`rtsl_bvh`]).
//! 2. The environment lights are added to paths whose rays leave the scene.
//! 3. The hits are sorted by *surface group*: shapes of one class with materials of one class. The paths of a group are
//!    processed in *shading batches*, with one call of each method for a batch: the shape's normals, coordinates and
//!    derivatives; the emission; a sample of one light, and the material's `BSDF` and `evaluatePDF` for it; a direction
//!    by `sampleBSDF`.
//! 4. Shadow rays of all groups are traced likewise, and the contributions of unoccluded ones are added.
//!
//! An integrator written in RTSL takes the place of all this if the scene names one (folder
//! `integrator`).
//!
//! # The estimator
//!
//! The radiance of a path is an unbiased estimate of the radiance along its camera ray. Light that a surface emits is
//! found both by light samples and by directions that materials sample, and the two are weighted by the power heuristic
//! (Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, section 9.2). Random numbers depend on
//! the pixel, the sample and the vertex alone, so the estimate does not depend on the wavefront, its size, or the
//! thread.

mod alpha;
mod checkpoints;
mod emission;
mod features;
mod film;
mod group_plan;
mod instance_classes;
mod integrator;
mod kernels;
mod lights;
mod material;
mod memory;
mod object_entry;
mod path_tracer;
mod random_numbers;
mod render;
mod rows;
mod samples;
mod scatter;
mod scene;
mod scene_builder;
mod searcher;
mod shade;
mod shading_batch;
mod shadow_rays;
mod surface;
mod surface_group;
mod tile_order;
mod tracer;
mod wavefront;

pub use checkpoints::Checkpoints;
pub(crate) use features::is_feature;
pub(crate) use film::BatchFilm;
pub use integrator::Evaluation;
pub use render::{BatchOptions, BatchRendered, render};
pub use scene::BatchScene;
pub(crate) use scene_builder::has_shade;
