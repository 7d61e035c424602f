//! Compiled functions for a host's packets.

use std::ffi::c_void;
use std::sync::Arc;

use rtsl_abi::RayRecord;
use rtsl_llvm::{Callback, TargetFeatures};
use rtsl_packet::Kernel;

use crate::error::JitError;
use crate::kernel::features_of_host;
use crate::llvm::Llvm;
use crate::module::Module;
use crate::opt_level::OptLevel;

const SYMBOL: &str = "callback";

/// A function for a host's packets. The code lives as long as any handle to it.
///
/// Only the host knows the data behind its argument, so it is never called here.
#[derive(Clone, Debug)]
pub struct CompiledCallback {
    /// Keeps the code in memory.
    _module: Arc<Module>,
    address: *const c_void,
}

// Safety: the code does not change, and its memory belongs to the module, which threads may share.
unsafe impl Send for CompiledCallback {}
// Safety: the same.
unsafe impl Sync for CompiledCallback {}

impl CompiledCallback {
    /// Compiles to machine code for this machine. `block_bytes` is the stride between the blocks of instances.
    ///
    /// # Errors
    /// See [`JitError`]; one of them is that the record lacks a row that the kernel reads or stores.
    pub fn compile(
        llvm: &Arc<Llvm>,
        kernel: &Kernel,
        record: &RayRecord,
        block_bytes: u32,
        features: &TargetFeatures,
        level: OptLevel,
    ) -> Result<CompiledCallback, JitError> {
        rtsl_packet::verify(kernel)?;
        kernel.check_record(record)?;
        let callback = Callback { kernel, record, block_bytes };
        let target = llvm.host();
        let text =
            rtsl_llvm::emit_callbacks([(SYMBOL, callback)], &features_of_host(target, features));
        let module = level.compile_kernels([(SYMBOL, kernel)], |level| match kernel.width {
            1 => llvm.compile_for_one_ray(&text, target, level),
            _ => llvm.compile(&text, target, level),
        });
        let module = module?;
        let address = module.function(SYMBOL)?.cast();
        Ok(CompiledCallback { _module: module, address })
    }

    /// Returns the address of the function, which takes a pointer to the host's struct.
    pub fn address(&self) -> *const c_void {
        self.address
    }
}
