//! Programs: a class, linked with the classes of the instances that it refers to, and its kernels.

pub(crate) mod camera_program;
pub(crate) mod elements;
pub(crate) mod kernel_cache;
pub(crate) mod kernel_description;
pub(crate) mod kernel_request;
pub(crate) mod light_part;
pub(crate) mod loop_owners;
mod members;
#[allow(clippy::module_inception, reason = "the noun of the folder is the noun of the file")]
pub(crate) mod program;
pub(crate) mod query_request;
pub(crate) mod searched_scene;
pub(crate) mod stage_lights;
pub(crate) mod staged_program;
pub(crate) mod surface_class;
