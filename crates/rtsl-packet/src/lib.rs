//! Packet lowering: single-ray code to code for W rays at once.
//!
//! What varies from ray to ray is found here, and masks are made explicit here. This crate knows no
//! LLVM and no instruction set; W and the shape are parameters.

pub mod abi;
mod layout;

pub use layout::Layout;
