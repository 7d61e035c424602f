//! Diagnostics that outlive their compilation, and those of each thread's last call.

use std::cell::RefCell;
use std::ffi::{CString, c_char};

use rtsl::{Diagnostic, Diagnostics, Severity, SourceMap, render};

/// A diagnostic. Its texts are good until the thread's next call that gives an `RtslResult`.
#[repr(C)]
pub struct RtslDiagnostic {
    /// Its stable code: "E0201".
    pub code: *const c_char,
    /// What was found and what was expected, one line.
    pub message: *const c_char,
    /// The whole for people, with an excerpt of the text.
    pub text: *const c_char,
    /// The file, or null where it has no place in a text.
    pub file: *const c_char,
    /// Counted from 1; 0 where it has no place.
    pub line: u32,
    /// Counted from 1.
    pub column: u32,
    /// The line of its end.
    pub end_line: u32,
    /// The column after its end.
    pub end_column: u32,
    /// 1 for an error, 0 for a warning.
    pub is_error: u32,
}

/// A diagnostic that outlives its compilation.
pub struct KeptDiagnostic {
    code: CString,
    message: CString,
    text: CString,
    file: Option<CString>,
    lines: [u32; 4],
    is_error: bool,
}

thread_local! {
    /// The diagnostics of the thread's last call.
    pub static LAST: RefCell<Vec<KeptDiagnostic>> = const { RefCell::new(Vec::new()) };
}

/// The diagnostics with their places.
pub fn keep(sources: &SourceMap, diagnostics: &Diagnostics) -> Vec<KeptDiagnostic> {
    diagnostics.iter().map(|diagnostic| KeptDiagnostic::new(sources, diagnostic)).collect()
}

/// Replaces those of the thread's last call.
pub fn set_last(diagnostics: Vec<KeptDiagnostic>) {
    // A thread that is ending keeps none.
    let _ = LAST.try_with(|last| last.replace(diagnostics));
}

impl KeptDiagnostic {
    pub fn new(sources: &SourceMap, diagnostic: &Diagnostic) -> KeptDiagnostic {
        let span = diagnostic.primary.as_ref().map(|label| label.span);
        let lines = span.map_or([0; 4], |span| {
            let start = sources.position(span.file, span.start);
            let end = sources.position(span.file, span.end);
            [start.line, start.column, end.line, end.column]
        });
        KeptDiagnostic {
            code: c_text(diagnostic.code.as_str()),
            message: c_text(&diagnostic.message),
            text: c_text(&render::all_to_text(sources, [diagnostic], false)),
            file: span.map(|span| c_text(&sources.file(span.file).name)),
            lines,
            is_error: diagnostic.severity == Severity::Error,
        }
    }

    /// The diagnostic for C: its pointers lead into this one.
    pub fn as_c(&self) -> RtslDiagnostic {
        let [line, column, end_line, end_column] = self.lines;
        RtslDiagnostic {
            code: self.code.as_ptr(),
            message: self.message.as_ptr(),
            text: self.text.as_ptr(),
            file: self.file.as_ref().map_or(std::ptr::null(), |file| file.as_ptr()),
            line,
            column,
            end_line,
            end_column,
            is_error: self.is_error.into(),
        }
    }
}

/// A text for C: it ends at the first zero byte.
pub fn c_text(text: &str) -> CString {
    let bytes: Vec<u8> = text.bytes().take_while(|byte| *byte != 0).collect();
    CString::new(bytes).unwrap_or_default()
}
