//! Packet code as LLVM text.
//!
//! Writing text needs no LLVM: this crate knows the language of LLVM (as versions 17 to 22 read
//! it) and which instructions of a target are worth using, but no library, no process and
//! nothing of RTSL but packet code.

mod target;

pub use target::TargetFeatures;
