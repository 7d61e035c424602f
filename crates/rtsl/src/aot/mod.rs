//! Classes compiled ahead of time: an object file, a C header and a description, for hosts that want no compiler when
//! they run.

mod bindings;
pub(crate) mod class;
mod constructor;
pub(crate) mod library;

pub use bindings::Bindings;
pub use library::{AotLibrary, AotOptions};
pub use rtsl_cpp::kernel_header;
