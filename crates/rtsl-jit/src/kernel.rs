//! A compiled method, safe to call.

use std::ffi::c_void;
use std::mem::MaybeUninit;
use std::panic::resume_unwind;
use std::sync::Arc;

use rtsl_abi::{
    CallArguments, CallError, CallStatus, HOST_TABLE, HostArguments, HostCalls, Instances,
    LaneMask, LeafArguments, LeafTest, Objects, RawCall, Signature, offsets,
};
use rtsl_llvm::TargetFeatures;
use rtsl_packet::Kernel;

use crate::compile::OptLevel;
use crate::coroutines::{LARGE_FRAME_BYTES, call_in_coroutines, call_on_own_stack};
use crate::error::JitError;
use crate::llvm::Llvm;
use crate::module::Module;
use crate::target::Target;

pub(crate) type Entry = unsafe extern "C" fn(*mut RawCall);

/// A compiled method. Cheap to clone; the code lives as long as any handle to it.
#[derive(Clone, Debug)]
pub struct CompiledKernel {
    /// Keeps the code in memory.
    _module: Arc<Module>,
    entry: Entry,
    signature: Signature,
    /// Rays at a time.
    width: u32,
    /// The stack that a call takes.
    frame_bytes: usize,
    /// Hosts may answer what it asks by calling kernels, and so on, while its large frame waits.
    has_own_stack: bool,
}

impl CompiledKernel {
    /// Machine code of packet kernels for this machine, in their order. All go into one module, which costs
    /// less than one each. `features` says what the text may ask for, whatever its names are; what the
    /// machine lacks LLVM makes up for, or refuses.
    ///
    /// What calls are checked against is derived from the packet code itself, so that whatever
    /// kernels are given, calls of what comes out touch no memory but that of their arguments.
    ///
    /// What needs too much stack may need little enough where it does fewer rays at a time; a caller who has other packet
    /// code tries.
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
            // The level of the largest is not for the others.
            let alone = |kernel| Self::compile(llvm, std::slice::from_ref(kernel), features, level);
            let made: Result<Vec<_>, _> = kernels.iter().map(alone).collect();
            return Ok(made?.into_iter().flatten().collect());
        }
        let level = level.for_work(work);
        let target = llvm.host();
        let features = features_of_host(target, features);
        let module = Arc::new(llvm.compile(&module_text(kernels, &features), target, level)?);
        let kernels = kernels.iter().enumerate().map(|(index, kernel)| {
            let address = module.function(&symbol(index))?;
            // Safety: the function is a kernel: made just now from packet code that keeps the rules.
            let entry = unsafe { std::mem::transmute::<*const u8, Entry>(address) };
            let signature = kernel.signature();
            let frame_bytes = module.frame(&symbol(index));
            Ok(CompiledKernel {
                _module: module.clone(),
                entry,
                signature,
                width: kernel.width,
                frame_bytes,
                has_own_stack: kernel.asks_for_rays() && frame_bytes > LARGE_FRAME_BYTES,
            })
        });
        kernels.collect()
    }

    /// What it takes.
    pub fn signature(&self) -> &Signature {
        &self.signature
    }

    /// Rays at a time.
    pub fn width(&self) -> usize {
        self.width as usize
    }

    /// The function itself, which takes a pointer to the call that `rtsl_abi::offsets` describes. The code lives as long as
    /// any handle to the kernel.
    pub fn address(&self) -> *const c_void {
        self.entry as *const c_void
    }

    /// Runs the method for all rays of the call.
    ///
    /// # Panics
    /// If the arguments' sizes do not fit the kernel, if there is no memory for the stack that it needs, and with a panic of the
    /// host.
    // Always inlined: else the arguments are written to memory and read back at once in pieces of other
    // sizes, which takes 4 ns, a fifth of what a short kernel takes for 64 rays.
    #[inline(always)]
    pub fn call(&self, call: CallArguments<'_>) -> CallStatus {
        match self.try_call(call) {
            Ok(status) => status,
            Err(error) => error.refuse(),
        }
    }

    /// The same, where what makes a call impossible is an error.
    ///
    /// # Errors
    /// If the arguments' sizes do not fit the kernel, or there is no memory for the stack that it needs.
    ///
    /// # Panics
    /// With a panic of the host.
    #[inline(always)]
    pub fn try_call(&self, call: CallArguments<'_>) -> Result<CallStatus, CallError> {
        self.signature.check(&call)?;
        let CallArguments { state, scratch, count, mask, accepted, instances, host } = call;
        let mut host = HostCalls { host, panic: None };
        let mut raw = RawCall {
            state: state.table_mut(),
            scratch: scratch.table_mut(),
            mask: mask.map_or(std::ptr::null(), |mask| mask.pointer().cast_const()),
            accepted: accepted.map_or(std::ptr::null_mut(), |accepted| accepted.pointer()),
            instance: instances.block().pointer(),
            objects: MaybeUninit::uninit(),
            index: MaybeUninit::uninit(),
            host: &HOST_TABLE,
            user: (&raw mut host).cast(),
            count: count as u32,
            status: 0,
            begin: MaybeUninit::uninit(),
            test_count: MaybeUninit::uninit(),
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
        match self.signature.separate_chunks {
            // Safety: the pointers are to memory that the arguments borrow, of the sizes just
            // checked; what the kernel's shape reads is written; the code keeps to the interface.
            None if !self.has_own_stack => unsafe { (self.entry)(&mut raw) },
            // Safety: the same.
            None => unsafe { call_on_own_stack(self.entry, &mut raw, self.frame_bytes) }?,
            Some(width) => {
                let mask = mask.map(LaneMask::signed_words);
                // Safety: the same, and the code may begin at any chunk of this width.
                unsafe { call_in_coroutines(self.entry, &mut raw, width, self.frame_bytes, mask) }?;
            }
        }
        Ok(finish(&raw, host, test.and_then(|test| test.nearest())))
    }

    /// Runs the method for all rays of a host's arrays.
    ///
    /// # Errors
    /// If the arguments do not fit the kernel, or there is no memory for the stack that it needs.
    ///
    /// # Panics
    /// With a panic of the host.
    pub fn call_host(&self, call: HostArguments<'_, '_>) -> Result<CallStatus, CallError> {
        self.signature().check_host(&call, self.width())?;
        // Safety: the arguments fit, as was just found.
        unsafe { self.run_host(call) }
    }

    /// Runs the method for all rays of a host's arrays.
    ///
    /// # Errors
    /// [`CallError::NoStack`].
    ///
    /// # Safety
    /// The call has passed [`Signature::check_host`] for the kernel's width: the arrays that code touches are there,
    /// with lanes for whole vectors of the rays, of which the single shape has exactly one.
    unsafe fn run_host(&self, call: HostArguments<'_, '_>) -> Result<CallStatus, CallError> {
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
            begin: MaybeUninit::new(0),
            test_count: MaybeUninit::new(0),
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
        match self.signature.separate_chunks {
            // Safety: the pointers are to memory that the arguments borrow, of the sizes that were checked; what the
            // kernel's shape reads is written; the code keeps to the interface.
            None if !self.has_own_stack => unsafe { (self.entry)(&mut raw) },
            // Safety: the same.
            None => unsafe { call_on_own_stack(self.entry, &mut raw, self.frame_bytes) }?,
            Some(width) => {
                // Safety: the same, and the code may begin at any chunk of this width.
                unsafe { call_in_coroutines(self.entry, &mut raw, width, self.frame_bytes, mask) }?;
            }
        }
        Ok(finish(&raw, host, None))
    }

    /// Runs `intersect` in the leaf shape.
    ///
    /// # Safety
    /// The kernel is of that method and shape and fits the objects, and the call has passed
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
            begin: MaybeUninit::uninit(),
            test_count: MaybeUninit::new(tests.len() as u32),
            tests: MaybeUninit::new(tests.as_mut_ptr()),
        };
        // Safety: the caller has seen to it that what the code reads and writes is there.
        unsafe { (self.entry)(&mut raw) };
        finish(&raw, host, None)
    }
}

/// What a call left.
#[inline(always)]
fn finish(raw: &RawCall, host: HostCalls<'_>, nearest: Option<u32>) -> CallStatus {
    if let Some(panic) = host.panic {
        resume_unwind(panic);
    }
    CallStatus { budget_exhausted: raw.status & offsets::STATUS_BUDGET != 0, nearest }
}

/// The text of a module of kernels, as [`CompiledKernel::compile`] hands it to LLVM.
pub fn module_text(kernels: &[Kernel], features: &TargetFeatures) -> String {
    let symbols: Vec<String> = (0..kernels.len()).map(symbol).collect();
    rtsl_llvm::emit(symbols.iter().map(String::as_str).zip(kernels), features)
}

/// Features with the names of the host. They go into the text as they stand, so that only those that LLVM gave will do.
pub(crate) fn features_of_host(target: &Target, features: &TargetFeatures) -> TargetFeatures {
    TargetFeatures {
        triple: target.triple().to_owned(),
        cpu: target.cpu().to_owned(),
        features: target.features().to_owned(),
        ..features.clone()
    }
}

/// The name of a kernel in its module.
fn symbol(index: usize) -> String {
    format!("kernel{index}")
}
