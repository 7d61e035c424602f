//! Inputs and hosts shared by the tests of several crates.
//!
//! [`functions`] generates single-ray functions from random bytes, with storage and a host for them; [`checked`] parses
//! and checks shader sources against the project's prelude; [`random`] has seeded random numbers; [`digest`] hashes
//! pictures; [`turns`] tells ordinary runs from long ones.
//!
//! This crate is not published, and only tests depend on it.

pub mod checked;
pub mod digest;
pub mod functions;
pub mod random;
pub mod turns;
