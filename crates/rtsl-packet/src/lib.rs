//! Packet lowering: single-ray code to code for W rays at once.
//!
//! What varies from ray to ray is found here ([`uniformity`]), and masks are made explicit here
//! ([`lower`]); [`kernel`] says what the result means, [`interpreter`] runs it and counts what it
//! does. This crate knows no LLVM and no instruction set; W and the shape are parameters.

mod estimate;
pub mod interleave;
pub mod interpreter;
pub mod kernel;
mod lower;
mod print;
pub mod profile;
mod range;
mod record;
mod signature;
pub mod uniformity;
mod verify;
mod work;

pub use estimate::Estimate;
pub use kernel::Kernel;
pub use lower::{LowerError, lower, lower_packet};
pub use profile::Profile;
pub use range::Ranges;
pub use record::RecordError;
pub use verify::{VerifyError, verify};
pub use work::MAX_WORK;
