//! Classes compiled ahead of time: an object file, a C header and a description, for hosts that want no compiler when
//! they run.
//!
//! [`Engine::aot_library`](crate::Engine::aot_library) makes an [`AotLibrary`] of classes. Its object file exports one
//! symbol for the library, one for each class, kernel and constructor. The data behind the first two describes the
//! library, so that a host that loads it finds classes and parameters by name. Changing a parameter is a matter of some
//! words and a call of the constructor. Such a host can't set references: [`Bindings`] determine the classes of what
//! they refer to.

mod bindings;
pub(crate) mod class;
mod constructor;
pub(crate) mod library;

pub use bindings::Bindings;
pub use library::{AotLibrary, AotOptions};
pub use rtsl_cpp::kernel_header;
