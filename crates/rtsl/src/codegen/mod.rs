//! Code generation: linked methods to kernels. [`kernel_compiler`] runs the steps in their order.

pub(crate) mod callback;
pub(crate) mod counted;
pub(crate) mod emit;
pub(crate) mod interpreted;
pub(crate) mod kernel;
pub(crate) mod kernel_compiler;
pub(crate) mod kernel_source;
mod lane_calls;
pub(crate) mod lane_storage;
pub(crate) mod line_costs;
pub(crate) mod options;
pub(crate) mod packet_kernel;
pub(crate) mod recording;
mod recording_report;
pub(crate) mod stepped_lines;
pub(crate) mod touched;
pub(crate) mod trace;
pub(crate) mod traced_method;
pub(crate) mod variant;
