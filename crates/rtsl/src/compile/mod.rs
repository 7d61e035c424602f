//! From text to classes. [`compiler`] runs the steps in their order: `rtsl_syntax::parse` (preprocessor, lexer,
//! parser), `check_unit` (names, types, roles), `lower_class` (single-ray representation). Every text is compiled over
//! the [prelude](rtsl_sema::prelude).

pub(crate) mod analysis;
pub(crate) mod compiler;
pub mod library;
mod library_file;
pub(crate) mod loader;
mod modules;
pub(crate) mod outline;
pub(crate) mod unit;
