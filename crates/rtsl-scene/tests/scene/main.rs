//! The integration tests of `rtsl-scene`, as one program: linking is most of the work of building tests.

mod inputs;
mod motion;
mod pages;
mod reader;
mod source;
mod textured;
