//! The functions of LLVM's C API that are used, loaded from a library.
//!
//! The list contains only functions that are the same from LLVM 17 to 23.

use std::ffi::{CStr, c_char, c_int, c_uint, c_void};

use libloading::Library;

macro_rules! opaque {
    ($($name:ident)*) => {$(
        #[repr(C)]
        pub struct $name {
            _opaque: [u8; 0],
        }
    )*};
}

opaque! {
    Context ModuleData MemoryBuffer TargetHandle TargetMachine TargetData PassOptions Error
    DiagnosticInfo Value Attribute
}

/// `LLVMBool`; for functions that can fail, 0 is success.
pub type Bool = c_int;

/// `LLVMReturnStatusAction` of `LLVMVerifyModule`: report, neither print nor abort.
pub const RETURN_STATUS: c_int = 2;
/// `LLVMAssemblyFile`.
pub const ASSEMBLY_FILE: c_int = 0;
/// `LLVMObjectFile`.
pub const OBJECT_FILE: c_int = 1;
/// `LLVMRelocPIC`.
pub const RELOCATION_PIC: c_int = 2;
/// `LLVMCodeModelSmall`.
pub const CODE_MODEL_SMALL: c_int = 3;
/// `LLVMDSError`, a severity.
pub const SEVERITY_ERROR: c_int = 0;
/// `LLVMDSWarning`, a severity.
pub const SEVERITY_WARNING: c_int = 1;
/// `LLVMAttributeFunctionIndex`.
pub const FUNCTION_INDEX: c_uint = c_uint::MAX;

macro_rules! api {
    ($(fn $name:ident($($argument:ident: $ty:ty),*) $(-> $result:ty)?;)*) => {
        /// Pointers to LLVM's functions.
        #[allow(non_snake_case)]
        pub struct Api {
            $(pub $name: unsafe extern "C" fn($($argument: $ty),*) $(-> $result)?,)*
        }

        impl Api {
            /// Looks up every function; the error is the name of the first missing one.
            pub fn resolve(library: &Library) -> Result<Api, &'static str> {
                $(
                    // Safety: the signature is that of LLVM's header for this name, and the
                    // library is never unloaded.
                    let $name = unsafe {
                        *library
                            .get::<unsafe extern "C" fn($($argument: $ty),*) $(-> $result)?>(
                                concat!(stringify!($name), "\0").as_bytes(),
                            )
                            .map_err(|_| stringify!($name))?
                    };
                )*
                Ok(Api { $($name,)* })
            }
        }
    };
}

#[allow(non_snake_case)]
mod table {
    use super::*;

    api! {
        fn LLVMContextCreate() -> *mut Context;
        fn LLVMContextDispose(context: *mut Context);
        fn LLVMContextSetDiagnosticHandler(
            context: *mut Context,
            handler: Option<unsafe extern "C" fn(*mut DiagnosticInfo, *mut c_void)>,
            user: *mut c_void
        );
        fn LLVMGetDiagInfoDescription(info: *mut DiagnosticInfo) -> *mut c_char;
        fn LLVMGetDiagInfoSeverity(info: *mut DiagnosticInfo) -> c_int;
        fn LLVMInstallFatalErrorHandler(handler: unsafe extern "C" fn(*const c_char));
        fn LLVMDisposeMessage(message: *mut c_char);
        fn LLVMGetErrorMessage(error: *mut Error) -> *mut c_char;
        fn LLVMDisposeErrorMessage(message: *mut c_char);
        fn LLVMCreateMemoryBufferWithMemoryRangeCopy(
            data: *const c_char,
            length: usize,
            name: *const c_char
        ) -> *mut MemoryBuffer;
        fn LLVMGetBufferStart(buffer: *mut MemoryBuffer) -> *const c_char;
        fn LLVMGetBufferSize(buffer: *mut MemoryBuffer) -> usize;
        fn LLVMDisposeMemoryBuffer(buffer: *mut MemoryBuffer);
        fn LLVMParseIRInContext(
            context: *mut Context,
            buffer: *mut MemoryBuffer,
            module: *mut *mut ModuleData,
            message: *mut *mut c_char
        ) -> Bool;
        fn LLVMVerifyModule(module: *mut ModuleData, action: c_int, message: *mut *mut c_char) -> Bool;
        fn LLVMPrintModuleToString(module: *mut ModuleData) -> *mut c_char;
        fn LLVMSetTarget(module: *mut ModuleData, triple: *const c_char);
        fn LLVMSetModuleDataLayout(module: *mut ModuleData, layout: *mut TargetData);
        fn LLVMDisposeModule(module: *mut ModuleData);
        fn LLVMGetFirstFunction(module: *mut ModuleData) -> *mut Value;
        fn LLVMGetNextFunction(function: *mut Value) -> *mut Value;
        fn LLVMCreateStringAttribute(
            context: *mut Context,
            key: *const c_char,
            key_length: c_uint,
            value: *const c_char,
            value_length: c_uint
        ) -> *mut Attribute;
        fn LLVMAddAttributeAtIndex(function: *mut Value, index: c_uint, attribute: *mut Attribute);
        fn LLVMGetHostCPUName() -> *mut c_char;
        fn LLVMGetHostCPUFeatures() -> *mut c_char;
        fn LLVMGetTargetFromTriple(
            triple: *const c_char,
            target: *mut *mut TargetHandle,
            message: *mut *mut c_char
        ) -> Bool;
        fn LLVMCreateTargetMachine(
            target: *mut TargetHandle,
            triple: *const c_char,
            cpu: *const c_char,
            features: *const c_char,
            level: c_int,
            relocation: c_int,
            code_model: c_int
        ) -> *mut TargetMachine;
        fn LLVMDisposeTargetMachine(machine: *mut TargetMachine);
        fn LLVMCreateTargetDataLayout(machine: *mut TargetMachine) -> *mut TargetData;
        fn LLVMDisposeTargetData(layout: *mut TargetData);
        fn LLVMTargetMachineEmitToMemoryBuffer(
            machine: *mut TargetMachine,
            module: *mut ModuleData,
            kind: c_int,
            message: *mut *mut c_char,
            buffer: *mut *mut MemoryBuffer
        ) -> Bool;
        fn LLVMRunPasses(
            module: *mut ModuleData,
            passes: *const c_char,
            machine: *mut TargetMachine,
            options: *mut PassOptions
        ) -> *mut Error;
        fn LLVMCreatePassBuilderOptions() -> *mut PassOptions;
        fn LLVMDisposePassBuilderOptions(options: *mut PassOptions);
        fn LLVMPassBuilderOptionsSetLoopVectorization(options: *mut PassOptions, on: Bool);
        fn LLVMPassBuilderOptionsSetLoopInterleaving(options: *mut PassOptions, on: Bool);
        fn LLVMPassBuilderOptionsSetLoopUnrolling(options: *mut PassOptions, on: Bool);
        fn LLVMPassBuilderOptionsSetSLPVectorization(options: *mut PassOptions, on: Bool);
    }
}

pub use table::Api;

/// Returns the version that a library reports; `None` for one too old to report it.
pub fn version(library: &Library) -> Option<(u32, u32, u32)> {
    type GetVersion = unsafe extern "C" fn(*mut c_uint, *mut c_uint, *mut c_uint);
    let (mut major, mut minor, mut patch) = (0, 0, 0);
    // Safety: the signature is that of LLVM's header; the pointers are to live locals.
    unsafe {
        let get_version = library.get::<GetVersion>(b"LLVMGetVersion\0").ok()?;
        get_version(&mut major, &mut minor, &mut patch);
    }
    Some((major, minor, patch))
}

/// Registers the code generators of every architecture that RTSL compiles for with LLVM. Those missing in this build of
/// LLVM are skipped.
pub fn initialize_targets(library: &Library) {
    for architecture in ["X86", "AArch64"] {
        for part in ["TargetInfo", "Target", "TargetMC", "AsmPrinter"] {
            let name = format!("LLVMInitialize{architecture}{part}\0");
            // Safety: these functions take nothing and return nothing.
            unsafe {
                if let Ok(initialize) = library.get::<unsafe extern "C" fn()>(name.as_bytes()) {
                    initialize();
                }
            }
        }
    }
}

impl Api {
    /// Takes ownership of a message that LLVM allocated; empty for null.
    ///
    /// # Safety
    /// `message` is null or a message that `LLVMDisposeMessage` frees, not used afterwards.
    pub unsafe fn take_message(&self, message: *mut c_char) -> String {
        if message.is_null() {
            return String::new();
        }
        // Safety: LLVM's messages end in a zero byte; the caller transfers ownership.
        unsafe {
            let text = CStr::from_ptr(message).to_string_lossy().trim_end().to_owned();
            (self.LLVMDisposeMessage)(message);
            text
        }
    }
}
