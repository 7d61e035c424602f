//! Features of dependencies that all builds of the repository share: this crate has no code, only dependencies.
//!
//! Cargo compiles a dependency once for each set of features that a build asks for, and with it all crates above it.
//! The tests, the program and the extension module of the Python package ask for sets that differ in these.
//! `cargo xtask check` says which features are missing here.
