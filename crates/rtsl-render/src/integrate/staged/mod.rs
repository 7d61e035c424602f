//! Integrators as stages, on wavefronts of paths.
//!
//! The frames of a wavefront's paths are arrays, one for each scalar. A stage runs for all paths that have arrived at
//! it, in kernels that are linked once for each group of surfaces: then the searches, the shadow rays and the traced
//! rays that the paths wait for are answered together, and the paths are sorted by the next stage and the group of
//! their surface. Each path has the bits of the integrator's function, whatever the others do.

mod answers;
mod columns;
mod ended_paths;
mod frames;
mod kernel_search;
mod moved_columns;
mod moved_paths;
mod path_set;
mod path_sets;
mod prepared_surfaces;
mod requests;
mod run;
mod search;
mod searched_objects;
mod spawning;
mod stage_lights;
mod staged_method;
mod wave;

pub use columns::Columns;
pub use frames::{BlockSizes, Blocks, Frames};
pub use path_set::PathSet;
pub use run::StagedPaths;
pub use searched_objects::searched_objects;
pub use stage_lights::stage_lights;
pub use staged_method::{StageParts, StagedMethod, Surface};
pub use wave::{Wave, ray_components};
