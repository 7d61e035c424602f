//! Compiled methods with a safe call interface.

use std::ffi::c_void;
use std::mem::MaybeUninit;
use std::ops::Range;
use std::panic::resume_unwind;
use std::sync::Arc;

use rtsl_abi::{
    CallArguments, CallError, CallStatus, HOST_TABLE, HostArguments, HostCalls, InstanceBlock,
    Instances, LaneMask, LeafArguments, LeafTest, Objects, RawCall, Signature, check_stack,
    offsets,
};
use rtsl_llvm::{FullChunks, TargetFeatures};
use rtsl_packet::Kernel;

use crate::entry::{Entry, FullEntry};
use crate::error::JitError;
use crate::frames;
use crate::llvm::Llvm;
use crate::module::Module;
use crate::opt_level::OptLevel;
use crate::target::Target;

/// The least size of a frame whose calls check the room on the stack, without requests to the host too.
const LARGE_FRAME_BYTES: usize = 16 << 10;

/// A compiled method. Cheap to clone; the code lives as long as any handle to it.
#[derive(Clone, Debug)]
pub struct CompiledKernel {
    /// Keeps the code in memory.
    _module: Arc<Module>,
    entry: Entry,
    signature: Signature,
    /// The number of rays per chunk.
    width: u32,
    /// The stack size of a call, if calls check it: hosts may answer requests by calling kernels, recursively, and the
    /// room of a thread may be too small for large frames.
    checked_frame: Option<usize>,
    /// True if calls are [plain](Signature::is_plain), without requests to the host or a large frame.
    is_plain: bool,
    /// The function for full chunks, if it takes its arguments in registers, and the rays of a chunk less one.
    full: Option<(FullEntry, usize)>,
}

impl CompiledKernel {
    /// Compiles packet kernels to machine code for this machine, in their order. All are in one module, which costs
    /// less than one each. `features` are those that the text may use, independently of its names; LLVM emulates
    /// features that the machine lacks, or refuses them.
    ///
    /// The requirements against which calls are checked are derived from the packet code itself, so for any kernels,
    /// calls of the result access no memory except that of their arguments.
    ///
    /// A kernel that needs too much stack may need less at a smaller width; the caller may retry with packet code of
    /// that width.
    ///
    /// # Errors
    /// See [`JitError`].
    pub fn compile(
        llvm: &Arc<Llvm>,
        kernels: &[Kernel],
        features: &TargetFeatures,
        level: OptLevel,
    ) -> Result<Vec<CompiledKernel>, JitError> {
        kernels.iter().try_for_each(rtsl_packet::verify)?;
        let work = kernels.iter().map(Kernel::work).max().unwrap_or(0);
        if kernels.len() > 1 && level.for_work(work) != level {
            // The level for the largest kernel need not apply to the others.
            let alone = |kernel| Self::compile(llvm, std::slice::from_ref(kernel), features, level);
            let made: Result<Vec<_>, _> = kernels.iter().map(alone).collect();
            return Ok(made?.into_iter().flatten().collect());
        }
        for (index, kernel) in kernels.iter().enumerate() {
            frames::check_least(&symbol(index), kernel)?;
        }
        let level = level.for_work(work);
        let target = llvm.host();
        let features = features_of_host(target, features);
        let module = llvm.compile(&module_text(kernels, &features), target, level)?;
        let kernels = kernels.iter().enumerate();
        kernels.map(|(index, kernel)| CompiledKernel::of(&module, kernel, index)).collect()
    }

    /// Returns a kernel that was compiled at this level before, by this process or, if there is a
    /// [cache](Llvm::keep_code_in), by another; compiles it without optimisation otherwise. The result has the level of
    /// the code.
    ///
    /// # Errors
    /// As for [`CompiledKernel::compile`].
    pub fn compile_soon(
        llvm: &Arc<Llvm>,
        kernel: &Kernel,
        features: &TargetFeatures,
        level: OptLevel,
    ) -> Result<(CompiledKernel, OptLevel), JitError> {
        rtsl_packet::verify(kernel)?;
        frames::check_least(&symbol(0), kernel)?;
        let level = level.for_work(kernel.work());
        let features = features_of_host(llvm.host(), features);
        let text = module_text(std::slice::from_ref(kernel), &features);
        let (module, level) = match llvm.compiled_before(&text, level)? {
            Some(module) => (module, level),
            None => (llvm.compile(&text, llvm.host(), OptLevel::O0)?, OptLevel::O0),
        };
        Ok((CompiledKernel::of(&module, kernel, 0)?, level))
    }

    /// Returns the kernel of this number in a module that was compiled from packet code that is verified.
    fn of(
        module: &Arc<Module>,
        kernel: &Kernel,
        number: usize,
    ) -> Result<CompiledKernel, JitError> {
        let symbol = symbol(number);
        let address = module.function(&symbol)?;
        // Safety: the function is a kernel, compiled from verified packet code.
        let entry = unsafe { std::mem::transmute::<*const u8, Entry>(address) };
        let signature = kernel.signature();
        let frame_bytes = module.frame(&symbol);
        let checks_stack = kernel.asks_host() || frame_bytes > LARGE_FRAME_BYTES;
        let is_plain = signature.is_plain() && !checks_stack;
        let full = full_entry(module, kernel, &symbol)?;
        Ok(CompiledKernel {
            _module: module.clone(),
            entry,
            signature,
            width: kernel.width,
            checked_frame: checks_stack.then_some(frame_bytes),
            is_plain,
            full,
        })
    }

    /// Returns the requirements of a call.
    pub fn signature(&self) -> &Signature {
        &self.signature
    }

    /// Returns the number of rays per chunk.
    pub fn width(&self) -> usize {
        self.width as usize
    }

    /// Returns the address of the function, which takes a pointer to the call described in `rtsl_abi::offsets`. The
    /// code lives as long as any handle to the kernel.
    pub fn address(&self) -> *const c_void {
        self.entry as *const c_void
    }

    /// Runs the method for all rays of the call.
    ///
    /// # Panics
    /// If the arguments' sizes do not fit the kernel, if the stack has no room for it, or if the host panics.
    // Always inlined: otherwise the arguments are written to memory and immediately read back in pieces of other sizes,
    // which takes 4 ns, a fifth of the time of a short kernel for 64 rays.
    #[inline(always)]
    pub fn call(&self, call: CallArguments<'_>) -> CallStatus {
        match self.try_call(call) {
            Ok(status) => status,
            Err(error) => error.refuse(),
        }
    }

    /// Like [`CompiledKernel::call`], but returns an error if the call is not possible.
    ///
    /// # Errors
    /// If the arguments' sizes do not fit the kernel, or the stack has no room for it.
    ///
    /// # Panics
    /// If the host panics.
    #[inline(always)]
    pub fn try_call(&self, call: CallArguments<'_>) -> Result<CallStatus, CallError> {
        if self.is_plain
            && let Instances::One(block) = call.instances
            && self.signature.fits_plain_call(&call, block)
        {
            // Safety: the arguments fit, and the kernel is plain.
            return Ok(unsafe { self.call_plainly(call, block) });
        }
        self.signature.check(&call)?;
        self.check_stack()?;
        let CallArguments { state, scratch, count, mask, accepted, instances, host } = call;
        let Range { start: first, end: count } = self.signature.rays(count, mask);
        let mut host = HostCalls { host, panic: None };
        let mut raw = RawCall {
            state: state.table_mut(),
            scratch: scratch.table_mut(),
            mask: mask.map_or(std::ptr::null(), LaneMask::pointer),
            accepted: accepted.map_or(std::ptr::null_mut(), LaneMask::pointer_mut),
            instance: instances.block().pointer(),
            objects: MaybeUninit::uninit(),
            index: MaybeUninit::uninit(),
            host: &HOST_TABLE,
            user: (&raw mut host).cast(),
            count: count as u32,
            status: 0,
            test_count: MaybeUninit::uninit(),
            first: first as u32,
            tests: MaybeUninit::uninit(),
        };
        let mut test = None;
        match instances {
            Instances::One(_) => {}
            Instances::Object(objects, number) => {
                raw.objects.write(objects.pointer(number as usize));
            }
            Instances::Many(objects, indices) => {
                raw.objects.write(objects.pointer(0));
                raw.index.write(indices.pointer());
            }
            Instances::Range(objects, first) if self.signature.accepts => {
                raw.objects.write(objects.pointer(0));
                raw.test_count.write(1);
                raw.tests.write(test.insert(LeafTest::new(0, first)));
            }
            Instances::Range(objects, first) => {
                raw.objects.write(objects.pointer(first as usize));
            }
        }
        // Safety: the pointers are to memory that the arguments borrow, of the sizes just checked; all fields that the
        // kernel's call mode reads are written; the code conforms to the interface.
        unsafe { (self.entry)(&mut raw) };
        Ok(finish(&raw, host, test.and_then(|test| test.nearest())))
    }

    /// Checks that the stack has room for the kernel.
    ///
    /// # Errors
    /// [`CallError::NoStack`].
    #[inline(always)]
    pub(crate) fn check_stack(&self) -> Result<(), CallError> {
        self.checked_frame.map_or(Ok(()), check_stack)
    }

    /// Runs the method for all rays of a plain call, which needs no host or objects, and little stack.
    ///
    /// # Safety
    /// `is_plain`, and the call has passed [`Signature::fits_plain_call`].
    #[inline(always)]
    unsafe fn call_plainly(&self, call: CallArguments<'_>, block: &InstanceBlock) -> CallStatus {
        let CallArguments { state, scratch, count, mask, accepted, instances: _, host: _ } = call;
        let accepted = accepted.filter(|_| self.signature.accepts);
        if let Some((full, beyond)) = self.full
            && mask.is_none()
            && count > 0
            && count & beyond == 0
        {
            let accepted = accepted.map_or(std::ptr::null_mut(), LaneMask::pointer_mut);
            let (state, scratch) = (state.table_mut(), scratch.table_mut());
            // Safety: as below; the rays fill whole chunks, and there is one.
            unsafe { full(state, scratch, accepted, block.pointer(), count as u64) };
            return CallStatus { budget_exhausted: false, nearest: None };
        }
        let Range { start: first, end: count } = self.signature.rays(count, mask);
        let mut raw = RawCall {
            state: state.table_mut(),
            scratch: scratch.table_mut(),
            mask: mask.map_or(std::ptr::null(), LaneMask::pointer),
            accepted: accepted.map_or(std::ptr::null_mut(), LaneMask::pointer_mut),
            instance: block.pointer(),
            objects: MaybeUninit::uninit(),
            index: MaybeUninit::uninit(),
            host: std::ptr::null(),
            user: std::ptr::null_mut(),
            count: count as u32,
            status: 0,
            test_count: MaybeUninit::uninit(),
            first: first as u32,
            tests: MaybeUninit::uninit(),
        };
        // Safety: the pointers are to memory that the arguments borrow, of the sizes that were checked; all fields that
        // a plain kernel reads are written; the code conforms to the interface.
        unsafe { (self.entry)(&mut raw) };
        status(&raw, None)
    }

    /// Runs the method for all rays of a host's arrays.
    ///
    /// # Errors
    /// If the arguments do not fit the kernel, or the stack has no room for it.
    ///
    /// # Panics
    /// If the host panics.
    pub fn call_host(&self, call: HostArguments<'_, '_>) -> Result<CallStatus, CallError> {
        self.signature().check_host(&call, self.width())?;
        self.check_stack()?;
        // Safety: the arguments fit, as just checked.
        Ok(unsafe { self.run_host(call) })
    }

    /// Runs the method for all rays of a host's arrays.
    ///
    /// # Safety
    /// The call has passed [`Signature::check_host`] for the kernel's width: the arrays that code accesses are present,
    /// with lanes for whole vectors of the rays, of which the single mode has exactly one.
    unsafe fn run_host(&self, call: HostArguments<'_, '_>) -> CallStatus {
        let HostArguments { state, scratch, count, mask, accepted, instances, host } = call;
        let mut host = HostCalls { host, panic: None };
        let mut raw = RawCall {
            state: state.table().as_ptr(),
            scratch: scratch.table().as_ptr(),
            mask: mask.map_or(std::ptr::null(), <[i32]>::as_ptr),
            accepted: accepted.map_or(std::ptr::null_mut(), <[i32]>::as_mut_ptr),
            instance: instances.block().pointer(),
            objects: MaybeUninit::new(std::ptr::null()),
            index: MaybeUninit::new(std::ptr::null()),
            host: &HOST_TABLE,
            user: (&raw mut host).cast(),
            count: count as u32,
            status: 0,
            test_count: MaybeUninit::new(0),
            first: 0,
            tests: MaybeUninit::new(std::ptr::null_mut()),
        };
        match instances {
            Instances::One(_) | Instances::Range(..) => {}
            Instances::Object(objects, number) => {
                raw.objects.write(objects.pointer(number as usize));
            }
            Instances::Many(objects, indices) => {
                raw.objects.write(objects.pointer(0));
                raw.index.write(indices.pointer());
            }
        }
        // Safety: the pointers are to memory that the arguments borrow, of the sizes that were checked; all fields that
        // the kernel's call mode reads are written; the code conforms to the interface.
        unsafe { (self.entry)(&mut raw) };
        finish(&raw, host, None)
    }

    /// Runs `intersect` in the leaf mode.
    ///
    /// # Safety
    /// The kernel is of that method and call mode and fits the objects, and the call has passed
    /// [`Signature::check_leaf`] for them.
    #[inline(always)]
    pub(crate) unsafe fn call_leaf(
        &self,
        call: LeafArguments<'_>,
        objects: &Objects,
    ) -> CallStatus {
        let LeafArguments { state, scratch, count, tests, host } = call;
        let mut host = HostCalls { host, panic: None };
        let mut raw = RawCall {
            state: state.table_mut(),
            scratch: scratch.table_mut(),
            mask: std::ptr::null(),
            accepted: std::ptr::null_mut(),
            instance: objects.shared().pointer(),
            objects: MaybeUninit::new(objects.pointer(0)),
            index: MaybeUninit::uninit(),
            host: &HOST_TABLE,
            user: (&raw mut host).cast(),
            count,
            status: 0,
            test_count: MaybeUninit::new(tests.len() as u32),
            first: 0,
            tests: MaybeUninit::new(tests.as_mut_ptr()),
        };
        // Safety: the caller guarantees that all memory that the code reads and writes is valid.
        unsafe { (self.entry)(&mut raw) };
        finish(&raw, host, None)
    }
}

/// Returns the status of a call.
#[inline(always)]
fn finish(raw: &RawCall, host: HostCalls<'_>, nearest: Option<u32>) -> CallStatus {
    if let Some(panic) = host.panic {
        resume_unwind(panic);
    }
    status(raw, nearest)
}

#[inline(always)]
fn status(raw: &RawCall, nearest: Option<u32>) -> CallStatus {
    CallStatus { budget_exhausted: raw.status & offsets::STATUS_BUDGET != 0, nearest }
}

/// Returns the function for full chunks of a kernel, and the number of rays of a chunk less one.
fn full_entry(
    module: &Module,
    kernel: &Kernel,
    symbol: &str,
) -> Result<Option<(FullEntry, usize)>, JitError> {
    let Some(FullChunks { symbol, rays }) = FullChunks::of(kernel, symbol) else { return Ok(None) };
    let address = module.function(&symbol)?;
    // Safety: the function is that of a kernel, just compiled from verified packet code, and has these parameters.
    let entry = unsafe { std::mem::transmute::<*const u8, FullEntry>(address) };
    Ok(Some((entry, rays as usize - 1)))
}

/// Returns the text of a module of kernels, as [`CompiledKernel::compile`] passes it to LLVM.
pub fn module_text(kernels: &[Kernel], features: &TargetFeatures) -> String {
    let name = kernels.first().map_or("", |kernel| kernel.name.as_str());
    let _span = tracing::debug_span!("llvm_text", name, kernels = kernels.len()).entered();
    let symbols: Vec<String> = (0..kernels.len()).map(symbol).collect();
    rtsl_llvm::emit(symbols.iter().map(String::as_str).zip(kernels), features)
}

/// Returns features with the names of the host. The names are copied into the text, so only those from LLVM are safe.
pub(crate) fn features_of_host(target: &Target, features: &TargetFeatures) -> TargetFeatures {
    TargetFeatures {
        triple: target.triple().to_owned(),
        cpu: target.cpu().to_owned(),
        features: target.features().to_owned(),
        ..features.clone()
    }
}

/// Returns the name of a kernel in its module.
fn symbol(index: usize) -> String {
    format!("kernel{index}")
}
