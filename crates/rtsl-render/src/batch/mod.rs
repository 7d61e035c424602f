//! The batch renderer: path tracing through the methods that sample and weigh.
//!
//! A thread takes a tile and a range of its samples: one *wave* of paths. The wave goes from surface to
//! surface as a whole. Each time:
//!
//! 1. The nearest hits of all rays are found, in packets of 64 or streams of a thousand ([`rtsl_bvh`]).
//! 2. Rays that leave the scene bring back what the lights emit from there.
//! 3. The others are sorted by *surface groups*: shapes of one class with materials of one class. A group's paths are
//!    worked on in chunks, with one call of each method for a chunk: the shape's normals, coordinates and derivatives;
//!    what the surface emits; a sample of one light, and the material's `BSDF` and `evaluatePDF` for it; a
//!    direction by `sampleBSDF`.
//! 4. Shadow rays of all groups are traced likewise, and what they do not find blocked is added.
//!
//! # What a path brings back
//!
//! An estimate of the radiance along its camera ray without bias: light that a surface emits is found both by samples of
//! the lights and by directions that materials choose, and each of the two is weighted by the power heuristic
//! (Veach, "Robust Monte Carlo Methods for Light Transport Simulation", 1997, section 9.2). The numbers that it is made of are those of
//! its pixel, sample and vertex alone, so it does not depend on the wave, its size, or the thread.

mod alpha;
mod checkpoints;
mod emission;
mod features;
mod film;
mod instance_classes;
mod instance_transforms;
mod kernels;
mod lights;
mod material;
mod numbers;
mod render;
mod scatter;
mod scene;
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
pub use render::{BatchOptions, BatchRendered, render};
pub use scene::BatchScene;
pub(crate) use scene::has_shade;
