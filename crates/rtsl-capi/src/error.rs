//! What functions give back.

use std::cell::{Cell, RefCell};
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

use rtsl::{Diagnostic, Diagnostics, SourceMap, begin_work, render};

use crate::kept_diagnostic::{KeptDiagnostic, c_text, keep, set_last};

/// How a call ended.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RtslResult {
    /// As asked.
    Ok = 0,
    /// The shader's text has errors: see the diagnostics.
    Compilation = 1,
    /// A pointer is null that must not be, a text is no UTF-8, a number is none of those that there are.
    Argument = 2,
    /// An id is that of nothing.
    Id = 3,
    /// There are more rays than lanes, or arrays that a kernel touches are missing.
    Lanes = 4,
    /// There is no class, method or parameter of that name.
    Unknown = 5,
    /// A parameter has a wrong type or a value without a meaning, or one that is required is not set.
    Parameter = 6,
    /// An instance or objects belong to another class than the kernel's, or were not committed.
    Instance = 7,
    /// Machine code is asked for and there is no LLVM.
    NoLlvm = 8,
    /// A method can't be linked or compiled.
    CodeGeneration = 9,
    /// A mistake in RTSL itself; please report it.
    Internal = 10,
    /// A constructor ran past its budget of loop iterations.
    Budget = 11,
    /// This process was forked while a call was under way in its parent: what the thread of that call held stays locked here.
    Forked = 12,
    /// The process is ending, and nothing is compiled any more.
    Ending = 13,
    /// The calling thread's stack has too little room left for the kernel and its host; nothing was called.
    Memory = 14,
}

/// Why a call failed.
pub struct Error {
    result: RtslResult,
    message: String,
    diagnostics: Vec<KeptDiagnostic>,
}

impl Error {
    pub fn new(result: RtslResult, message: impl Into<String>) -> Error {
        Error { result, message: message.into(), diagnostics: Vec::new() }
    }

    /// A pointer is null.
    pub fn null(name: &str) -> Error {
        Error::new(RtslResult::Argument, format!("`{name}` is null"))
    }

    /// A diagnostic without a place, of linking and making kernels.
    pub fn of(diagnostic: &Diagnostic) -> Error {
        let mut diagnostics = Diagnostics::new();
        diagnostics.push(diagnostic.clone());
        Error::of_diagnostics(&SourceMap::new(), &diagnostics, RtslResult::CodeGeneration)
    }

    /// Diagnostics whose places are in `sources`; `result` where the codes do not say more.
    pub fn of_diagnostics(
        sources: &SourceMap,
        diagnostics: &Diagnostics,
        result: RtslResult,
    ) -> Error {
        let code = diagnostics.iter().map(|it| it.code.as_str()).next().unwrap_or_default();
        let result = match code {
            "E0501" | "E0503" | "E0504" | "E0505" | "E0506" => RtslResult::Parameter,
            "E0502" | "E0507" | "E0508" => RtslResult::Unknown,
            "E0619" => RtslResult::Budget,
            "E0701" => RtslResult::NoLlvm,
            "E0703" => RtslResult::Argument,
            "E0705" => RtslResult::Forked,
            "E0706" => RtslResult::Ending,
            _ => result,
        };
        Error {
            result,
            message: render::all_to_text(sources, diagnostics.iter(), false),
            diagnostics: keep(sources, diagnostics),
        }
    }
}

impl From<&Diagnostic> for Error {
    fn from(diagnostic: &Diagnostic) -> Error {
        Error::of(diagnostic)
    }
}

impl From<Diagnostic> for Error {
    fn from(diagnostic: Diagnostic) -> Error {
        Error::of(&diagnostic)
    }
}

thread_local! {
    static MESSAGE: RefCell<CString> = RefCell::default();
    /// Whether the last call failed: known as long as the thread runs, also when its messages are destroyed.
    static FAILED: Cell<bool> = const { Cell::new(false) };
}

/// Runs what a function does: no panic leaves it, and what went wrong is kept for the thread.
pub fn guard(work: impl FnOnce() -> Result<(), Error>) -> RtslResult {
    guard_with_warnings(|| work().map(|()| Vec::new()))
}

/// The same for work that may succeed with warnings.
pub fn guard_with_warnings(
    work: impl FnOnce() -> Result<Vec<KeptDiagnostic>, Error>,
) -> RtslResult {
    let under_way = begin_work();
    let ended = match &under_way {
        Ok(_) => catch_unwind(AssertUnwindSafe(work)),
        Err(forked) => Ok(Err(Error::of(forked))),
    };
    let error = match ended {
        Ok(Ok(diagnostics)) => {
            clear_message();
            set_last(diagnostics);
            return RtslResult::Ok;
        }
        Ok(Err(error)) => error,
        Err(panic) => {
            let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
            let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
            let text = text.unwrap_or_else(|| "a panic without a message".to_owned());
            Error::new(RtslResult::Internal, format!("a mistake in RTSL: {text}"))
        }
    };
    let Error { result, message, diagnostics } = error;
    FAILED.set(true);
    // Handlers of `exit` and destructors run when the thread's messages are gone.
    let _ = MESSAGE.try_with(|kept| kept.replace(c_text(&message)));
    set_last(diagnostics);
    result
}

/// Most calls go well after calls that went well.
fn clear_message() {
    if FAILED.replace(false) {
        let _ = MESSAGE.try_with(RefCell::take);
    }
}

/// What went wrong in the last call of this thread, for people: with places and excerpts where a text is at fault. Empty if
/// it went well. Good until the thread's next call. In handlers of `exit` and in destructors there is no message but that
/// the thread is ending: results are there as always.
#[unsafe(no_mangle)]
pub extern "C" fn rtsl_last_error() -> *const c_char {
    // The text stays until it is replaced, which is as long as the pointer is good for.
    let message = MESSAGE.try_with(|message| message.borrow().as_ptr());
    message.unwrap_or_else(|_| match FAILED.get() {
        true => c"the call failed; its message is gone, since the thread is ending".as_ptr(),
        false => c"".as_ptr(),
    })
}

/// The text behind a pointer.
///
/// # Safety
/// Where it is not null, it leads to a text that ends with a zero byte and stays as long as the result is used.
pub unsafe fn text<'a>(pointer: *const c_char, name: &str) -> Result<&'a str, Error> {
    if pointer.is_null() {
        return Err(Error::null(name));
    }
    // Safety: the caller's promise.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| Error::new(RtslResult::Argument, format!("`{name}` is no UTF-8")))
}

/// What a pointer leads to, to write.
///
/// # Safety
/// Where it is not null, it leads to a `T` that nobody else uses meanwhile.
pub unsafe fn place<'a, T>(pointer: *mut T, name: &str) -> Result<&'a mut T, Error> {
    // Safety: the caller's promise.
    unsafe { pointer.as_mut() }.ok_or_else(|| Error::null(name))
}

/// Checks a struct of a host's whose first field is its size, a `u32`: an older, smaller one is found before anything behind
/// the size is looked at.
///
/// # Safety
/// Where it is not null, it leads to a size that nobody changes meanwhile.
pub unsafe fn check_size<T>(pointer: *const T, name: &str) -> Result<(), Error> {
    // Safety: the caller's promise.
    let size = *unsafe { pointer.cast::<u32>().as_ref() }.ok_or_else(|| Error::null(name))?;
    let expected = size_of::<T>();
    if (size as usize) < expected {
        let problem = format!("`size` is {size}, and that of the {name} is {expected}");
        return Err(Error::new(RtslResult::Argument, problem));
    }
    Ok(())
}

/// What a pointer leads to.
///
/// # Safety
/// Where it is not null and `count` is not 0, it leads to so many of `T`, which stay as long as the result is used.
pub unsafe fn slice<'a, T>(pointer: *const T, count: usize, name: &str) -> Result<&'a [T], Error> {
    if count == 0 {
        return Ok(&[]);
    }
    if pointer.is_null() {
        return Err(Error::null(name));
    }
    if count > isize::MAX as usize / size_of::<T>().max(1) {
        let problem = format!("`{name}` can't have {count} elements");
        return Err(Error::new(RtslResult::Argument, problem));
    }
    // Safety: the caller's promise.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message() -> String {
        // Safety: the text stays until the thread's next call.
        unsafe { CStr::from_ptr(rtsl_last_error()) }.to_string_lossy().into_owned()
    }

    #[test]
    fn no_panic_leaves() {
        assert_eq!(guard(|| panic!("{} is wrong", 7)), RtslResult::Internal);
        assert_eq!(message(), "a mistake in RTSL: 7 is wrong");
        assert_eq!(guard(|| Err(Error::null("x"))), RtslResult::Argument);
        assert_eq!(message(), "`x` is null");
        assert_eq!(guard(|| Ok(())), RtslResult::Ok);
        assert_eq!(message(), "");
    }
}
