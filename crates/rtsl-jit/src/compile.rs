//! Compiles a module's text to assembly, object code or a loaded [`Module`].

use std::cell::RefCell;
use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::ptr::null_mut;
use std::sync::Arc;

use crate::elf::Object;
use crate::error::JitError;
use crate::ffi::{self, Api};
use crate::frames::{Frames, REPORT_ATTRIBUTE};
use crate::llvm::Llvm;
use crate::made_code::MadeCode;
use crate::module::Module;
use crate::module_key::ModuleKey;
use crate::opt_level::OptLevel;
use crate::passes::Work;
use crate::runtime;
use crate::target::{Target, c_string};
use crate::worker;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Output {
    Text,
    Assembly,
    Object,
}

impl Llvm {
    /// Compiles a module for this machine and loads it. For a text that was compiled a short while ago, this is the
    /// module of then, unless [forgotten](Llvm::forget_modules).
    ///
    /// # Errors
    /// See [`JitError`]; no text makes this panic or abort the process.
    pub fn compile(
        self: &Arc<Self>,
        module: &str,
        target: &Target,
        level: OptLevel,
    ) -> Result<Arc<Module>, JitError> {
        self.compile_by(module, target, level, Work::Packets)
    }

    /// Like [`Llvm::compile`], for a module that processes one ray at a time.
    pub(crate) fn compile_for_one_ray(
        self: &Arc<Self>,
        module: &str,
        target: &Target,
        level: OptLevel,
    ) -> Result<Arc<Module>, JitError> {
        self.compile_by(module, target, level, Work::OneRay)
    }

    fn compile_by(
        self: &Arc<Self>,
        module: &str,
        target: &Target,
        level: OptLevel,
        work: Work,
    ) -> Result<Arc<Module>, JitError> {
        if !target.is_host() {
            return Err(JitError::ForeignTarget(target.triple().to_owned()));
        }
        let key = ModuleKey::new(self.key, module, level, work);
        if let Some(module) = self.kept(key)? {
            return Ok(module);
        }
        let Made { bytes: object, frames } =
            self.emit(module, target, level, work, Output::Object)?;
        let code = MadeCode { object, frames };
        // Code whose frames are too large is stored as well: it need not be made to be refused again.
        if let Some(cache) = Llvm::code_cache() {
            cache.insert(key, &code);
        }
        self.load_code(key, &code)
    }

    /// Returns the module of a text that was compiled before, by this process or, with a cache, by another.
    pub(crate) fn compiled_before(
        &self,
        module: &str,
        level: OptLevel,
    ) -> Result<Option<Arc<Module>>, JitError> {
        self.kept(ModuleKey::new(self.key, module, level, Work::Packets))
    }

    fn kept(&self, key: ModuleKey) -> Result<Option<Arc<Module>>, JitError> {
        if let Some(module) = self.with_modules(|modules| modules.get(key))? {
            return Ok(Some(module));
        }
        let stored = Llvm::code_cache().and_then(|cache| cache.get(key));
        stored.map(|code| self.load_code(key, &code)).transpose()
    }

    fn load_code(&self, key: ModuleKey, code: &MadeCode) -> Result<Arc<Module>, JitError> {
        let module = Arc::new(code.load()?);
        // A process that is ending keeps nothing, and has its module all the same.
        let _ = self.with_modules(|modules| modules.insert(key, module.clone()));
        Ok(module)
    }

    /// Returns the module after LLVM's passes, as text.
    ///
    /// # Errors
    /// See [`JitError`].
    pub fn optimized(
        self: &Arc<Self>,
        module: &str,
        target: &Target,
        level: OptLevel,
    ) -> Result<String, JitError> {
        self.emit(module, target, level, Work::Packets, Output::Text)?.text()
    }

    /// Returns the module as assembly text of `target`.
    ///
    /// # Errors
    /// See [`JitError`].
    pub fn assembly(
        self: &Arc<Self>,
        module: &str,
        target: &Target,
        level: OptLevel,
    ) -> Result<String, JitError> {
        self.emit(module, target, level, Work::Packets, Output::Assembly)?.text()
    }

    /// Returns the module as an object file (ELF) of `target`. Its undefined symbols are functions of the runtime,
    /// which every C library also provides.
    ///
    /// # Errors
    /// See [`JitError`].
    pub fn object(
        self: &Arc<Self>,
        module: &str,
        target: &Target,
        level: OptLevel,
    ) -> Result<Vec<u8>, JitError> {
        let Made { bytes: object, frames } =
            self.emit(module, target, level, Work::Packets, Output::Object)?;
        frames.check()?;
        Object::parse(&object)?.check_outside_symbols(|name| runtime::address(name).is_some())?;
        Ok(object)
    }

    fn emit(
        self: &Arc<Self>,
        module: &str,
        target: &Target,
        level: OptLevel,
        work: Work,
        output: Output,
    ) -> Result<Made, JitError> {
        let _span = tracing::debug_span!("llvm_compile", target = target.triple()).entered();
        let (llvm, module, target) = (self.clone(), c_string(module), target.clone());
        worker::run(move || {
            let machine = Machine::take(&llvm, &target, level)?;
            let context = Context::new(&llvm.api);
            let module = context.parse(&module)?;
            module.set_target(&machine, &target);
            module.verify()?;
            if output != Output::Text {
                module.report_frames();
            }
            let accepts = |text: &str| context.accepts_passes(&machine, text);
            if let Some(passes) = llvm.passes.text(level, work, accepts) {
                module.run_passes(&machine, passes)?;
            }
            let bytes = match output {
                Output::Text => module.print().into_bytes(),
                Output::Assembly => module.generate(&machine, ffi::ASSEMBLY_FILE)?,
                Output::Object => module.generate(&machine, ffi::OBJECT_FILE)?,
            };
            let frames = context.finish()?;
            machine.keep();
            Ok(Made { bytes, frames })
        })
    }
}

/// True if the library accepts the passes.
#[cfg(test)]
pub fn accepts_passes(llvm: &Arc<Llvm>, passes: &str) -> Result<bool, JitError> {
    let (llvm, passes) = (llvm.clone(), passes.to_owned());
    worker::run(move || {
        let machine = Machine::take(&llvm, llvm.host(), OptLevel::O2)?;
        Ok(Context::new(&llvm.api).accepts_passes(&machine, &passes))
    })
}

/// The output of a compilation.
struct Made {
    bytes: Vec<u8>,
    /// The stack frames, which may be too large; empty if no code was generated.
    frames: Frames,
}

impl Made {
    fn text(self) -> Result<String, JitError> {
        self.frames.check()?;
        Ok(String::from_utf8(self.bytes)
            .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned()))
    }
}

/// A target machine, freed on drop.
struct Machine {
    llvm: Arc<Llvm>,
    target: Target,
    level: OptLevel,
    raw: *mut ffi::TargetMachine,
}

thread_local! {
    /// The machine last used on this thread, with the structures that LLVM builds when it first generates code.
    static KEPT: RefCell<Option<Machine>> = const { RefCell::new(None) };
}

impl Machine {
    /// Returns the machine that was kept, if it fits, or a new one.
    fn take(llvm: &Arc<Llvm>, target: &Target, level: OptLevel) -> Result<Machine, JitError> {
        let serves = |kept: &Machine| {
            Arc::ptr_eq(&kept.llvm, llvm) && kept.target == *target && kept.level == level
        };
        match KEPT.take().filter(serves) {
            Some(machine) => Ok(machine),
            None => Machine::new(llvm.clone(), target, level),
        }
    }

    /// Keeps the machine for the thread's next compilation.
    fn keep(self) {
        KEPT.set(Some(self));
    }

    fn new(llvm: Arc<Llvm>, target: &Target, level: OptLevel) -> Result<Machine, JitError> {
        let api = &llvm.api;
        let triple = c_string(&target.triple);
        let (cpu, features) = (c_string(&target.cpu), c_string(&target.features));
        let unknown = |reason| JitError::UnknownTarget { triple: target.triple.clone(), reason };
        let (mut handle, mut message) = (null_mut(), null_mut());
        // Safety: texts end in a zero byte and outlive the calls; the message is owned.
        let raw = unsafe {
            if (api.LLVMGetTargetFromTriple)(triple.as_ptr(), &mut handle, &mut message) != 0 {
                return Err(unknown(api.take_message(message)));
            }
            (api.LLVMCreateTargetMachine)(
                handle,
                triple.as_ptr(),
                cpu.as_ptr(),
                features.as_ptr(),
                level.code_generation(),
                ffi::RELOCATION_PIC,
                ffi::CODE_MODEL_SMALL,
            )
        };
        if raw.is_null() {
            return Err(unknown("LLVM cannot generate code for it".to_owned()));
        }
        Ok(Machine { llvm, target: target.clone(), level, raw })
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        // Safety: made by `LLVMCreateTargetMachine`, freed once.
        unsafe { (self.llvm.api.LLVMDisposeTargetMachine)(self.raw) };
    }
}

/// An LLVM context and the errors that were reported to it.
struct Context<'a> {
    api: &'a Api,
    raw: *mut ffi::Context,
    /// Boxed because LLVM holds its address.
    reported: Box<Reported<'a>>,
}

struct Reported<'a> {
    api: &'a Api,
    errors: RefCell<Vec<String>>,
    frames: RefCell<Frames>,
}

impl<'a> Context<'a> {
    fn new(api: &'a Api) -> Self {
        let reported =
            Box::new(Reported { api, errors: RefCell::default(), frames: RefCell::default() });
        let user: *const Reported<'_> = &raw const *reported;
        // Safety: the handler gets `user`, which lives as long as the context.
        let raw = unsafe {
            let raw = (api.LLVMContextCreate)();
            (api.LLVMContextSetDiagnosticHandler)(
                raw,
                Some(on_diagnostic),
                user.cast::<c_void>().cast_mut(),
            );
            raw
        };
        Context { api, raw, reported }
    }

    fn parse(&self, text: &CString) -> Result<ParsedModule<'_, 'a>, JitError> {
        let (mut module, mut message) = (null_mut(), null_mut());
        // Safety: the buffer is a copy of the text, which `LLVMParseIRInContext` takes over.
        unsafe {
            let buffer = (self.api.LLVMCreateMemoryBufferWithMemoryRangeCopy)(
                text.as_ptr(),
                text.as_bytes().len(),
                c"kernel".as_ptr(),
            );
            if (self.api.LLVMParseIRInContext)(self.raw, buffer, &mut module, &mut message) != 0 {
                return Err(JitError::InvalidModule(self.api.take_message(message)));
            }
        }
        Ok(ParsedModule { context: self, raw: module })
    }

    /// True if this LLVM accepts the passes, determined by running them on a module without functions.
    fn accepts_passes(&self, machine: &Machine, passes: &str) -> bool {
        self.parse(&CString::default())
            .and_then(|module| module.run_passes(machine, passes))
            .is_ok()
    }

    /// Returns an error that the diagnostic handler received.
    fn check(&self) -> Result<(), JitError> {
        let errors = self.reported.errors.borrow();
        if errors.is_empty() { Ok(()) } else { Err(JitError::CodeGeneration(errors.join("; "))) }
    }

    /// Returns the stack frames of the generated functions.
    fn finish(&self) -> Result<Frames, JitError> {
        self.check()?;
        Ok(self.reported.frames.take())
    }
}

impl Drop for Context<'_> {
    fn drop(&mut self) {
        // Safety: made by `LLVMContextCreate`; modules borrow the context and are gone.
        unsafe { (self.api.LLVMContextDispose)(self.raw) };
    }
}

unsafe extern "C" fn on_diagnostic(info: *mut ffi::DiagnosticInfo, user: *mut c_void) {
    // Safety: `user` is the `Reported` that `Context::new` gave; it outlives the context.
    let reported = unsafe { &*user.cast::<Reported<'_>>() };
    // Safety: LLVM passes a valid diagnostic; the description is owned and freed here.
    let (severity, description) = unsafe {
        (
            (reported.api.LLVMGetDiagInfoSeverity)(info),
            reported.api.take_message((reported.api.LLVMGetDiagInfoDescription)(info)),
        )
    };
    match severity {
        ffi::SEVERITY_ERROR => reported.errors.borrow_mut().push(description),
        ffi::SEVERITY_WARNING => {
            if let Err(error) = reported.frames.borrow_mut().add_report(&description) {
                reported.errors.borrow_mut().push(error);
            }
        }
        _ => {}
    }
}

/// A module in memory, freed on drop.
struct ParsedModule<'c, 'a> {
    context: &'c Context<'a>,
    raw: *mut ffi::ModuleData,
}

impl ParsedModule<'_, '_> {
    fn api(&self) -> &Api {
        self.context.api
    }

    fn set_target(&self, machine: &Machine, target: &Target) {
        let triple = c_string(&target.triple);
        // Safety: the layout is copied into the module before it is freed.
        unsafe {
            let layout = (self.api().LLVMCreateTargetDataLayout)(machine.raw);
            (self.api().LLVMSetTarget)(self.raw, triple.as_ptr());
            (self.api().LLVMSetModuleDataLayout)(self.raw, layout);
            (self.api().LLVMDisposeTargetData)(layout);
        }
    }

    /// Requests the frame sizes of all functions, which the context's handler receives during code generation.
    fn report_frames(&self) {
        let (api, (key, value)) = (self.api(), REPORT_ATTRIBUTE);
        // Safety: module and context are alive, and the texts have the lengths passed.
        unsafe {
            let attribute = (api.LLVMCreateStringAttribute)(
                self.context.raw,
                key.as_ptr().cast(),
                key.len() as c_uint,
                value.as_ptr().cast(),
                value.len() as c_uint,
            );
            let mut function = (api.LLVMGetFirstFunction)(self.raw);
            while !function.is_null() {
                (api.LLVMAddAttributeAtIndex)(function, ffi::FUNCTION_INDEX, attribute);
                function = (api.LLVMGetNextFunction)(function);
            }
        }
    }

    fn verify(&self) -> Result<(), JitError> {
        let mut message = null_mut();
        // Safety: the module is alive; the message is owned and freed here, even without an error.
        let (failed, message) = unsafe {
            let failed =
                (self.api().LLVMVerifyModule)(self.raw, ffi::RETURN_STATUS, &mut message) != 0;
            (failed, self.api().take_message(message))
        };
        if failed { Err(JitError::InvalidModule(message)) } else { Ok(()) }
    }

    fn run_passes(&self, machine: &Machine, passes: &str) -> Result<(), JitError> {
        let (api, passes) = (self.api(), c_string(passes));
        // Safety: options are created and freed here; an error is consumed by reading its message.
        let message = unsafe {
            let options = (api.LLVMCreatePassBuilderOptions)();
            (api.LLVMPassBuilderOptionsSetLoopVectorization)(options, 0);
            (api.LLVMPassBuilderOptionsSetLoopInterleaving)(options, 0);
            (api.LLVMPassBuilderOptionsSetLoopUnrolling)(options, 0);
            (api.LLVMPassBuilderOptionsSetSLPVectorization)(options, 0);
            let error = (api.LLVMRunPasses)(self.raw, passes.as_ptr(), machine.raw, options);
            (api.LLVMDisposePassBuilderOptions)(options);
            if error.is_null() {
                None
            } else {
                let message = (api.LLVMGetErrorMessage)(error);
                let text = std::ffi::CStr::from_ptr(message).to_string_lossy().into_owned();
                (api.LLVMDisposeErrorMessage)(message);
                Some(text)
            }
        };
        match message {
            None => self.context.check(),
            Some(message) => Err(JitError::CodeGeneration(message)),
        }
    }

    fn print(&self) -> String {
        // Safety: the text is owned and freed here.
        unsafe { self.api().take_message((self.api().LLVMPrintModuleToString)(self.raw)) }
    }

    fn generate(&self, machine: &Machine, kind: c_int) -> Result<Vec<u8>, JitError> {
        let api = self.api();
        let mut message: *mut c_char = null_mut();
        let mut buffer: *mut ffi::MemoryBuffer = null_mut();
        // Safety: module and machine are alive; buffer and message are owned and freed here.
        unsafe {
            let failed = (api.LLVMTargetMachineEmitToMemoryBuffer)(
                machine.raw,
                self.raw,
                kind,
                &mut message,
                &mut buffer,
            );
            if failed != 0 {
                return Err(JitError::CodeGeneration(api.take_message(message)));
            }
            let start: *const u8 = (api.LLVMGetBufferStart)(buffer).cast();
            let size = (api.LLVMGetBufferSize)(buffer);
            let bytes = match size {
                0 => Vec::new(),
                _ => std::slice::from_raw_parts(start, size).to_vec(),
            };
            (api.LLVMDisposeMemoryBuffer)(buffer);
            Ok(bytes)
        }
    }
}

impl Drop for ParsedModule<'_, '_> {
    fn drop(&mut self) {
        // Safety: made by the parser, freed once, before its context.
        unsafe { (self.api().LLVMDisposeModule)(self.raw) };
    }
}
