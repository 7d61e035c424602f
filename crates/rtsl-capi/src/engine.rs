//! Engines: what makes kernels.

use std::ffi::{CString, c_char};

use rtsl::{Backend, Engine, EngineOptions, Math, OptLevel};

use crate::error::{Error, RtslResult, check_size, guard, guard_with_warnings, place};
use crate::kept_diagnostic::{c_text, keep};
use crate::registry::{RtslEngineId, id};

/// What runs kernels.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RtslBackend {
    /// Machine code where there is an LLVM, else the interpreter, with a warning.
    Auto = 0,
    /// Machine code; without LLVM an error.
    Jit = 1,
    /// The interpreter.
    Interpreter = 2,
}

/// How exact arithmetic is.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RtslMath {
    /// `a * b + c` is rounded once where one rule says so; the same on every machine.
    Contract = 0,
    /// Every operation is rounded.
    Strict = 1,
    /// Results may differ from machine to machine.
    Fast = 2,
}

/// How an engine makes kernels. All zeros but for the size are the defaults.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct RtslEngineOptions {
    /// `sizeof(RtslEngineOptions)`: later versions may add fields at the end.
    pub size: u32,
    /// An `RtslBackend`.
    pub backend: u32,
    /// An `RtslMath`.
    pub math: u32,
    /// Rays at a time where a kernel is asked for without a width: 1, 4, 8 or 16; 0 for what suits the machine.
    pub width: u32,
    /// The greatest number of loop iterations of a ray in a call; 0 for no limit.
    pub loop_budget: u32,
    /// How much work goes into machine code: 1 to 3; 0 for the default, which is 2.
    pub optimization: u32,
}

/// What an engine is.
#[repr(C)]
pub struct RtslEngineInfo {
    /// The LLVM that compiles, "19.1.7", or null on the interpreter. Good until the engine is released.
    pub llvm: *const c_char,
    /// Rays at a time where a kernel is asked for without a width.
    pub width: u32,
    /// Not used.
    pub unused: u32,
}

/// An engine.
pub struct EngineEntry {
    pub engine: Engine,
    llvm: Option<CString>,
}

id!(RtslEngineId, EngineEntry, "engine");

/// Makes an engine. Falling back on the interpreter is a warning among the diagnostics.
///
/// # Safety
/// `options` is null, for the defaults, or leads to so many bytes as its size says; `engine` is null or leads to an id.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_engine_new(
    options: *const RtslEngineOptions,
    engine: *mut RtslEngineId,
) -> RtslResult {
    guard_with_warnings(|| {
        // Safety: the caller's promise.
        let id = unsafe { place(engine, "engine")? };
        if !options.is_null() {
            // Safety: the caller's promise.
            unsafe { check_size(options, "options")? };
        }
        // Safety: the caller's promise; the struct is whole, since its size is right.
        let options = unsafe { options.as_ref() };
        let options = options.map_or_else(|| Ok(EngineOptions::default()), engine_options)?;
        let (engine, warnings) = Engine::new(options)?;
        let llvm = engine.llvm().map(|llvm| c_text(&llvm.version().to_string()));
        *id = RtslEngineId::give(EngineEntry { engine, llvm });
        Ok(keep(&rtsl::SourceMap::new(), &warnings))
    })
}

fn engine_options(options: &RtslEngineOptions) -> Result<EngineOptions, Error> {
    let backend = match options.backend {
        0 => Backend::Auto,
        1 => Backend::Jit,
        2 => Backend::Interpreter,
        other => return Err(no_such("backend", other)),
    };
    let math = match options.math {
        0 => Math::Contract,
        1 => Math::Strict,
        2 => Math::Fast,
        other => return Err(no_such("math", other)),
    };
    let optimization = match options.optimization {
        0 | 2 => OptLevel::O2,
        1 => OptLevel::O1,
        3 => OptLevel::O3,
        other => return Err(no_such("optimization", other)),
    };
    let number = |value: u32| Some(value).filter(|value| *value != 0);
    Ok(EngineOptions {
        backend,
        math,
        optimization,
        width: number(options.width),
        loop_budget: number(options.loop_budget),
        ..EngineOptions::default()
    })
}

fn no_such(name: &str, value: u32) -> Error {
    Error::new(RtslResult::Argument, format!("there is no {name} {value}"))
}

/// What an engine is.
///
/// # Safety
/// `info` is null or leads to an `RtslEngineInfo`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rtsl_engine_info(
    engine: RtslEngineId,
    info: *mut RtslEngineInfo,
) -> RtslResult {
    guard(|| {
        // Safety: the caller's promise.
        let info = unsafe { place(info, "info")? };
        let engine = engine.get()?;
        let llvm = engine.llvm.as_ref().map_or(std::ptr::null(), |llvm| llvm.as_ptr());
        *info = RtslEngineInfo { llvm, width: engine.engine.width(), unused: 0 };
        Ok(())
    })
}

/// Releases an engine. Its kernels stay.
#[unsafe(no_mangle)]
pub extern "C" fn rtsl_engine_release(engine: RtslEngineId) -> RtslResult {
    guard(|| engine.release())
}
