//! The C interface of RTSL: compile shaders, set their parameters, call their methods for many rays, from C and C++.
//!
//! [`rtsl.h`](../include/rtsl.h) is made of this crate, and a test keeps the two alike; what kernels take stands in
//! `rtsl_kernel.h`, which is that of libraries [compiled ahead of time](rtsl::aot), too. The crate is a thin shell
//! around `rtsl`: it knows nothing of stages of the compiler, of LLVM or of scenes.
//!
//! # Rules
//!
//! - Every function gives an [`RtslResult`]. What went wrong is told by [`rtsl_last_error`] and, where text is at fault,
//!   by [`rtsl_last_diagnostic`], for the last call of the same thread.
//! - Things are named by ids, which are looked up and never reused: one that is wrong, or of something released, is
//!   an error and nothing worse.
//! - A pointer that must not be null is checked; what it leads to is the caller's promise.
//! - No panic leaves the library.
//! - All functions may be called from any thread. Calls that change one instance at the same time wait for each other.
#![allow(unsafe_code, reason = "what C programs hand over are pointers")]

mod arguments;
mod callback;
mod diagnostics;
mod engine;
mod error;
mod host;
mod instance;
mod kept_diagnostic;
mod kernel;
mod objects;
mod registry;
mod unit;
mod version;

pub use arguments::{RtslArguments, rtsl_kernel_call};
pub use callback::{
    RtslMark, RtslMarkSource, RtslRecord, RtslRow, rtsl_callback_function, rtsl_callback_new,
    rtsl_callback_release,
};
pub use diagnostics::{rtsl_last_diagnostic, rtsl_last_diagnostic_count};
pub use engine::{
    RtslBackend, RtslEngineInfo, RtslEngineOptions, RtslMath, rtsl_engine_info, rtsl_engine_new,
    rtsl_engine_release,
};
pub use error::{RtslResult, rtsl_last_error};
pub use host::RtslHostFunctions;
pub use instance::{
    rtsl_instance_block, rtsl_instance_commit, rtsl_instance_new, rtsl_instance_release,
    rtsl_instance_set_bools, rtsl_instance_set_choices, rtsl_instance_set_floats,
    rtsl_instance_set_instances, rtsl_instance_set_ints, rtsl_instance_set_uints,
    rtsl_instance_unset,
};
pub use kept_diagnostic::RtslDiagnostic;
pub use kernel::{
    RtslMethod, rtsl_kernel_block_words, rtsl_kernel_info, rtsl_kernel_new, rtsl_kernel_of_objects,
    rtsl_kernel_release, rtsl_kernel_scratch_arrays,
};
pub use objects::{
    rtsl_elements_new, rtsl_objects_blocks, rtsl_objects_count, rtsl_objects_new,
    rtsl_objects_release,
};
pub use registry::{
    RtslCallbackId, RtslEngineId, RtslInstanceId, RtslKernelId, RtslObjectsId, RtslUnitId,
};
pub use unit::{
    RtslAnnotation, RtslClassInfo, RtslCompilerOptions, RtslParameterInfo, rtsl_compile,
    rtsl_compile_file, rtsl_compile_file_with, rtsl_compile_with, rtsl_standard_unit,
    rtsl_unit_class, rtsl_unit_class_count, rtsl_unit_find_class, rtsl_unit_release,
};
pub use version::{rtsl_abi, rtsl_version};
