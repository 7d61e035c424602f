//! Finds LLVM at run time, compiles LLVM text with it, and provides safe handles to the kernels.
//!
//! RTSL does not link against LLVM: the library is loaded through the C API at its first use, so that RTSL builds
//! without it and, where it is missing, runs on the interpreter. [`Llvm::load`] searches, [`Llvm::compile`] compiles a
//! module's text to machine code, and a [`Module`] owns the code. [`CompiledKernel::compile`] does all of this for
//! packet kernels, and only its results can be called: there is no path from text to a callable kernel.
//!
//! `rtsl-abi` describes the calls. This crate must not depend on the language, the single-ray IR's operations or the
//! lowering to packet code; it reads LLVM text and runs the code that LLVM generates. It therefore contains `unsafe`,
//! as only `rtsl-abi` of the compiler's other crates does.
#![allow(unsafe_code, reason = "calls a C library and runs the machine code that it makes")]

mod callback;
mod code_cache;
mod compile;
mod elf;
mod ending;
mod entry;
mod error;
mod ffi;
mod frames;
mod kernel;
mod leaf_kernel;
mod library;
mod library_pages;
mod limits;
mod llvm;
mod made_code;
mod memory;
mod module;
mod module_cache;
mod module_key;
mod opt_level;
mod passes;
#[cfg(unix)]
mod private_folder;
#[cfg(not(unix))]
#[path = "no_private_folder.rs"]
mod private_folder;
mod relocation;
mod runtime;
mod search;
mod target;
mod worker;

pub use callback::CompiledCallback;
pub use code_cache::{CodeCache, CodeCacheSize};
pub use error::{CodeCacheError, JitError, LlvmError, LlvmVersion};
pub use kernel::{CompiledKernel, module_text};
pub use leaf_kernel::LeafKernel;
pub use limits::MAX_FRAME_BYTES;
pub use llvm::Llvm;
pub use module::Module;
pub use opt_level::OptLevel;
pub use target::Target;
