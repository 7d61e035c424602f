//! The limits of the lowering, which refuse programs that are valid but too large.
//!
//! All functions are inlined, so a short text can expand to a very large program. The limits bound
//! time, memory and the compiler's stack.

use rtsl_source::{Diagnostic, Span, deep_stack, diagnostic_codes};

/// The result of a lowering step, or the error that ended it.
pub(crate) type Lowered<T> = Result<T, Box<Diagnostic>>;

/// The maximum number of values in a function.
pub(crate) const VALUES_OF_A_FUNCTION: usize = 1_000_000;

/// The maximum number of statements and expressions visited for a function while calls are inlined;
/// bounds the time for code that generates no values.
pub(crate) const VISITS_OF_A_FUNCTION: u32 = 2_500_000;

/// The maximum nesting of regions.
pub(crate) const NESTED_REGIONS: usize = 200;

/// The maximum nesting of statements and expressions, through inlined calls; bounds the stack.
pub(crate) fn nested_visits() -> u32 {
    2 * deep_stack::depth() as u32
}

/// The maximum number of scalars of one type.
pub(crate) const SCALARS_OF_A_TYPE: u64 = 1 << 20;

/// The maximum number of scalars of an instance: its members, and the tables of constants that its
/// class indexes.
pub(crate) const SCALARS_OF_AN_INSTANCE: u64 = 1 << 20;

/// The maximum number of scalars of the scratch of one ray and object.
pub(crate) const SCALARS_OF_SCRATCH: u64 = 65_536;

/// The maximum number of scalars of all arrays with dynamic indices that are live at the same time
/// in a function. They are on the stack, for all rays of a packet.
pub(crate) const SCALARS_OF_LOCALS: u32 = 2_048;

pub(crate) fn too_large(span: Span, scalars: u64) -> Box<Diagnostic> {
    Box::new(
        Diagnostic::new(
            diagnostic_codes::TOO_MUCH_DATA,
            format!("{scalars} scalars in one value, but at most {SCALARS_OF_A_TYPE} are allowed"),
        )
        .at(span, "too large"),
    )
}

pub(crate) fn too_many_members(
    span: Span,
    kind: &str,
    scalars: u64,
    allowed: u64,
) -> Box<Diagnostic> {
    Box::new(
        Diagnostic::new(
            diagnostic_codes::TOO_MUCH_DATA,
            format!("{scalars} scalars of {kind}, but at most {allowed} are allowed"),
        )
        .at(span, "this class is too large")
        .help("a buffer, `float table[]`, takes data of any size"),
    )
}

pub(crate) fn too_many_locals(span: Span) -> Box<Diagnostic> {
    Box::new(
        Diagnostic::new(
            diagnostic_codes::TOO_MUCH_DATA,
            format!(
                "the arrays with dynamic indices in one method have more than {SCALARS_OF_LOCALS} \
                 scalars"
            ),
        )
        .at(span, "this array exceeds the limit")
        .note("every ray has its own copy of a variable"),
    )
}

pub(crate) fn too_much_code(span: Span, function: &str) -> Box<Diagnostic> {
    Box::new(
        Diagnostic::new(
            diagnostic_codes::TOO_MUCH_CODE,
            format!("`{function}` becomes too large with all the functions that it calls"),
        )
        .at(span, "the limit is reached here")
        .note("every call is replaced by the function's body")
        .help("call large functions in a loop instead of several times"),
    )
}

pub(crate) fn nested_too_deeply(span: Span) -> Box<Diagnostic> {
    Box::new(
        Diagnostic::new(
            diagnostic_codes::CALLS_TOO_DEEP,
            "statements, expressions and calls are nested too deeply",
        )
        .at(span, "this level exceeds the limit")
        .note("every call is replaced by the function's body, so calls in calls count too"),
    )
}
