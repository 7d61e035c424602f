//! The list of diagnostics: one line each here, and one page each in `explain/`.
//!
//! A page says what the code means and shows a text that gives it and a text that does not;
//! tests compile both. Codes are never reused. `E` is an error, `W` a warning. Hundreds:
//! 00 preprocessor and lexer, 01 grammar, 02 names and types, 03 classes, roles and state,
//! 04 constants, limits and lowering, 05 linking and parameters, 06 scenes and files,
//! 07 code generation and machines.

use crate::Severity;

/// The stable code of a diagnostic, such as `E0201`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Code(pub(crate) &'static str);

impl Code {
    /// The code as text.
    pub fn as_str(self) -> &'static str {
        self.0
    }

    /// `E` codes are errors, `W` codes warnings.
    pub fn severity(self) -> Severity {
        if self.0.starts_with('W') { Severity::Warning } else { Severity::Error }
    }
}

impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0)
    }
}

/// What is known of a code.
#[derive(Clone, Copy, Debug)]
pub struct CodeInfo {
    /// The code.
    pub code: Code,
    /// A short title.
    pub title: &'static str,
    /// The page in Markdown that `rtsl explain` prints.
    pub explanation: &'static str,
}

/// Every code, in order.
pub fn codes() -> &'static [CodeInfo] {
    CODES
}

/// The entry of a code given as text, upper or lower case.
pub fn code_info(code: &str) -> Option<&'static CodeInfo> {
    CODES.iter().find(|info| info.code.0.eq_ignore_ascii_case(code))
}

macro_rules! diagnostics {
    ($($code:ident $name:ident $title:literal;)*) => {
        pub(crate) mod names {
            use super::Code;
            $(#[doc = $title] pub const $name: Code = Code(stringify!($code));)*
        }
        const CODES: &[CodeInfo] = &[$(CodeInfo {
            code: names::$name,
            title: $title,
            explanation: include_str!(concat!("explain/", stringify!($code), ".md")),
        },)*];
    };
}

diagnostics! {
    E0201 UNKNOWN_NAME "a name that nothing here declares";
}
