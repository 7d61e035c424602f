//! Packet lowering: single-ray code to code for W rays at once.
//!
//! What varies from ray to ray is found here ([`uniformity`]), and masks are made explicit here
//! ([`lower`]); [`kernel`] says what the result means. This crate knows no LLVM and no instruction
//! set; W and the shape are parameters.

pub mod abi;
pub mod kernel;
mod layout;
mod lower;
mod print;
mod shape;
pub mod uniformity;
mod verify;

pub use kernel::Kernel;
pub use layout::Layout;
pub use lower::{LowerError, lower};
pub use shape::Shape;
pub use verify::{VerifyError, verify};
