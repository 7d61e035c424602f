//! Integration: the paths of samples, from their cameras to the light that they bring back.
//!
//! A thread takes a tile and a range of its samples: one *wavefront* of paths, which the stages of the integrator
//! advance together (folder `staged`). What stages are not linked with is called by this folder for *shading batches*:
//! surfaces of one *group*, shapes of one class with materials of one class. Searches take packets of 64 rays or
//! streams of a thousand ([`rtsl_bvh`]).
//!
//! Random numbers depend on the pixel, the sample and the path alone, so the image does not depend on the wavefront,
//! its size, or the thread.

pub(crate) mod alpha;
pub(crate) mod batch_surfaces;
pub(crate) mod camera;
pub(crate) mod camera_rays;
pub(crate) mod drawn_numbers;
pub(crate) mod evaluation;
pub(crate) mod following;
pub(crate) mod host;
pub(crate) mod integrator;
pub(crate) mod integrator_memory;
pub(crate) mod light;
pub(crate) mod light_sample;
pub(crate) mod material_calls;
pub(crate) mod memory;
pub(crate) mod numbers;
pub(crate) mod output_columns;
pub(crate) mod path_tracer;
pub(crate) mod query_block;
pub(crate) mod random_numbers;
pub(crate) mod rows;
pub(crate) mod searcher;
pub(crate) mod shaded_surface;
pub(crate) mod shading;
pub(crate) mod shading_batch;
pub(crate) mod shading_methods;
pub(crate) mod shading_texts;
pub(crate) mod shadow_rays;
pub(crate) mod sky_calls;
pub(crate) mod spawned_paths;
pub(crate) mod staged;
pub(crate) mod surface;
pub(crate) mod suspect;
pub(crate) mod waiting_paths;
pub(crate) mod wavefront;

pub use evaluation::Evaluation;
pub use wavefront::SAMPLES_IN_WAVEFRONT;
