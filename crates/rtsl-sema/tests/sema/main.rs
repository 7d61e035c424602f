//! The integration tests of `rtsl-sema`, as one program: linking is most of the work of building tests.

mod classes;
mod explanations;
mod idle;
mod integrators;
mod limits;
mod messages;
mod mutations;
mod prelude;
mod rules;
mod shaders;
mod silence;
mod trees;
