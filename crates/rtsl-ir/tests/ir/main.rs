//! The integration tests of `rtsl-ir`, as one program: linking is most of the work of building tests.

mod interpreter;
mod text;
