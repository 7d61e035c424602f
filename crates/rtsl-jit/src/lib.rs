//! Finds LLVM at run time, compiles LLVM text with it, and hands out safe handles to the
//! kernels.
//!
//! Nothing links against LLVM: its library is loaded through the C API when it is first
//! asked for, so that RTSL builds without it and runs, on the interpreter, where there is
//! none. [`Llvm::load`] searches, [`Llvm::compile`] makes machine code of a module's text, and
//! a [`Module`] owns the code. [`CompiledKernel::compile`] does all of it for packet kernels, and what it
//! gives can be called: no way leads there from text.
//!
//! `rtsl-abi` describes the calls. This crate must not know the language, the single-ray IR's operations or how packet
//! code is made; it reads LLVM text and runs what LLVM makes of it, so that it holds `unsafe`, as only `rtsl-abi` of the
//! compiler's other crates does.
#![allow(unsafe_code, reason = "calls a C library and runs the machine code that it makes")]

mod callback;
mod chunk_stack;
mod compile;
mod coroutines;
mod elf;
mod ending;
mod error;
mod ffi;
mod forks;
mod frames;
mod kernel;
mod leaf_kernel;
mod library;
mod library_pages;
mod llvm;
mod memory;
mod module;
mod passes;
mod relocation;
mod runtime;
mod search;
mod target;
mod worker;

pub use callback::CompiledCallback;
pub use compile::OptLevel;
pub use error::{JitError, LlvmError, LlvmVersion};
pub use forks::{ForkGuard, UnderWay};
pub use frames::MAX_FRAME_BYTES;
pub use kernel::{CompiledKernel, module_text};
pub use leaf_kernel::LeafKernel;
pub use llvm::Llvm;
pub use module::Module;
pub use target::Target;
