//! The integration tests of `rtsl-capi`, as one program: linking is most of the work of building tests.

mod aot;
mod c_programs;
mod callbacks;
mod compiler;
mod embree;
mod hosts;
mod install;
