//! Finds LLVM at run time, compiles LLVM text with it, and hands out safe handles to the
//! kernels.
//!
//! Nothing links against LLVM: its library is loaded through the C API when it is first
//! asked for, so that RTSL builds without it and runs, on the interpreter, where there is
//! none. [`Llvm::load`] searches, [`Llvm::compile`] makes machine code of a module's text, and
//! a [`Module`] owns the code. [`CompiledKernel::compile`] does all of it for packet kernels, and what it
//! gives can be called: no way leads there from text.
//!
//! [`Denoiser`] loads another library at run time, that of Open Image Denoise, which renderers finish pictures with.
//!
//! This is the one crate of the compiler that holds `unsafe`. It must not know the language,
//! the single-ray IR's operations or how packet code is made: it knows the form of a call
//! and text that LLVM reads.
#![allow(unsafe_code, reason = "calls a C library and runs the machine code that it makes")]

mod api;
mod call;
mod callback;
mod callbacks;
mod chunk_stack;
mod compile;
mod components;
mod denoiser;
mod ending;
mod error;
mod forks;
mod frames;
mod host_lanes;
mod huge_pages;
mod instance;
mod kernel;
mod lanes;
mod leaf;
mod library;
mod library_pages;
mod llvm;
mod memory;
mod module;
mod object;
mod objects;
mod passes;
mod prefetch;
mod relocation;
mod runtime;
mod search;
mod side_by_side;
mod signature;
mod target;
mod worker;

pub use call::{CallArguments, CallStatus, Instances};
pub use callback::CompiledCallback;
pub use compile::OptLevel;
pub use components::ComponentSet;
pub use denoiser::{Denoiser, DenoiserError, DenoiserInput};
pub use error::{JitError, LlvmError, LlvmVersion};
pub use forks::{ForkGuard, UnderWay};
pub use frames::MAX_FRAME_BYTES;
pub use host_lanes::{CallError, HostArguments, HostLanes};
pub use huge_pages::{in_huge_pages, with_capacity_in_huge_pages};
pub use instance::{BoundBuffer, BufferEntry, InstanceBlock};
pub use kernel::{CompiledKernel, module_text};
pub use lanes::{LaneBlock, LaneIndices, LaneMask};
pub use leaf::{LeafArguments, LeafKernel, LeafTest};
pub use llvm::Llvm;
pub use module::Module;
pub use objects::{ObjectRow, Objects};
pub use prefetch::prefetch;
pub use signature::Signature;
pub use target::Target;
