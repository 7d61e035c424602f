//! Code generation: linked methods to kernels.

pub(crate) mod callback;
pub(crate) mod emit;
pub(crate) mod interpreted;
pub(crate) mod kernel;
pub(crate) mod kernel_compiler;
pub(crate) mod lane_storage;
pub(crate) mod options;
pub(crate) mod packet_kernel;
pub(crate) mod touched;
pub(crate) mod variant;
