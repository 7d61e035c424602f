//! A scene prepared for rendering: kernels for its shaders, an acceleration structure over its objects, and searches
//! for hits. All renderers share this module.

mod bounds;
mod builder;
pub(crate) mod calls;
pub(crate) mod compiled_scene;
pub(crate) mod extents;
mod fours;
pub(crate) mod group_plan;
pub(crate) mod instance_classes;
mod intersect_variants;
mod intersection;
pub(crate) mod kernels;
pub(crate) mod light;
mod mask_bits;
pub(crate) mod material;
pub(crate) mod object;
pub(crate) mod object_class;
pub(crate) mod object_classes;
pub(crate) mod object_entry;
mod pair_blocks;
pub(crate) mod placed_objects;
pub(crate) mod placement;
pub(crate) mod render_scene;
pub(crate) mod render_scene_builder;
pub(crate) mod runtime_errors;
mod shader_instance;
pub(crate) mod shaders;
pub(crate) mod surface_group;
pub(crate) mod tracer;
pub(crate) mod variables;
pub(crate) mod work_counts;

pub(crate) use bounds::{element_bounds, instance_bounds};
pub use builder::{BuildStep, SceneBuilder};
pub use compiled_scene::CompiledScene;
pub use render_scene::RenderScene;
pub use render_scene_builder::{RenderSceneBuilder, integrator_of};
