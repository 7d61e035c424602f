//! The integration tests of `rtsl-stages`, as one program: linking is most of the work of building tests.

mod properties;
mod shapes;
mod splitting;
mod surfaces;
mod verifying;
