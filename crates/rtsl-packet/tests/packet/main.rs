//! The integration tests of `rtsl-packet`, as one program: linking is most of the work of building tests.

mod interleave;
mod interpreter;
mod lowering;
mod verifier;
