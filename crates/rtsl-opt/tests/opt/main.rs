//! The integration tests of `rtsl-opt`, as one program: linking is most of the work of building tests.

mod limits;
mod mutations;
