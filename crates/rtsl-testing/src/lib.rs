//! Inputs and hosts that the tests of several crates share.
//!
//! [`functions`] generates single-ray functions from random bytes, with storage and a host for them; [`checked`] parses
//! and checks shader texts against the project's prelude; [`random`] is a seeded generator of random numbers.
//!
//! This crate is not published, and only tests depend on it.

pub mod checked;
pub mod functions;
pub mod random;
