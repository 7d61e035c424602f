//! Packet lowering: translates single-ray code to code for W rays at once.
//!
//! [`uniformity`] finds the values that vary from ray to ray, and [`lower`] makes masks explicit. [`kernel`] defines
//! the semantics of the result; [`interpreter`] runs it and counts its operations. This crate does not depend on LLVM
//! or an instruction set; W and the call mode are parameters.

mod estimate;
pub mod interleave;
pub mod interpreter;
pub mod kernel;
pub mod line_work;
mod locals;
mod lower;
mod pressure;
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
