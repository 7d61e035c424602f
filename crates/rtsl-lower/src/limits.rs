//! What the lowering refuses: programs that are right but too large.
//!
//! All functions are inlined, so a short text can stand for a very large program. The limits keep
//! time and memory in proportion, and the compiler's own stack bounded.

use rtsl_source::{Diagnostic, Span, deep_stack, diagnostic_codes};

/// What lowering gives, or the one error that ended it.
pub(crate) type Lowered<T> = Result<T, Box<Diagnostic>>;

/// Values that a function may have.
pub(crate) const VALUES_OF_A_FUNCTION: usize = 400_000;

/// Statements and expressions that a function may visit while calls are inlined; bounds the time
/// for code that makes no values.
pub(crate) const VISITS_OF_A_FUNCTION: u32 = 1_000_000;

/// Regions in regions.
pub(crate) const NESTED_REGIONS: usize = 200;

/// Statements and expressions in one another, through inlined calls; bounds the stack.
pub(crate) fn nested_visits() -> u32 {
    2 * deep_stack::depth() as u32
}

/// Scalars of one type.
pub(crate) const SCALARS_OF_A_TYPE: u64 = 1 << 20;

/// Scalars of the data of an instance: its members, and the tables of constants that its class indexes.
pub(crate) const SCALARS_OF_AN_INSTANCE: u64 = 1 << 20;

/// Scalars of the scratch of one ray and object.
pub(crate) const SCALARS_OF_SCRATCH: u64 = 65_536;

/// Scalars of all arrays with dynamic indices that live at the same time in a function: they are on the
/// stack, for all rays of a packet.
pub(crate) const SCALARS_OF_SLOTS: u32 = 2_048;

pub(crate) fn too_large(span: Span, scalars: u64) -> Box<Diagnostic> {
    Box::new(
        Diagnostic::new(
            diagnostic_codes::TOO_MUCH_DATA,
            format!("{scalars} scalars in one value, where {SCALARS_OF_A_TYPE} are allowed"),
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
            format!("{scalars} scalars of {kind}, where {allowed} are allowed"),
        )
        .at(span, "this class is too large")
        .help("a buffer, `float table[]`, takes data of any size"),
    )
}

pub(crate) fn too_many_slots(span: Span) -> Box<Diagnostic> {
    Box::new(
        Diagnostic::new(
            diagnostic_codes::TOO_MUCH_DATA,
            format!(
                "the arrays with dynamic indices in one method have more than {SCALARS_OF_SLOTS} \
                 scalars"
            ),
        )
        .at(span, "this array is one too many")
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
        .at(span, "this is one level too many")
        .note("every call is replaced by the function's body, so calls in calls count too"),
    )
}
