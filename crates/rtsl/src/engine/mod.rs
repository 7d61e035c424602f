//! The engine: programs of instances, and kernels made on several threads or in the background.

pub(crate) mod background;
#[allow(clippy::module_inception, reason = "the noun of the folder is the noun of the file")]
pub(crate) mod engine;
pub(crate) mod host_function;
pub(crate) mod light_selector;
pub(crate) mod renderer_function;
pub(crate) mod sampler_numbers;
pub(crate) mod specialised;
pub(crate) mod stage_kernels;
pub(crate) mod tiered_kernel;
