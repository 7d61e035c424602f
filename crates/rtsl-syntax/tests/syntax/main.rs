//! The integration tests of `rtsl-syntax`, as one program: linking is most of the work of building tests.

mod limits;
mod random;
