//! The integration tests of `rtsl-contract`, as one program: linking is most of the work of building tests.

mod common;
mod everywhere;
mod library;
mod outside_ranges;
mod right;
mod wrong_materials;
mod wrong_others;
mod wrong_primitives;
