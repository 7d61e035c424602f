//! The values of constant expressions.

use rtsl_ir::Constant;
use rtsl_source::Span;

/// The reason why an expression has no value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// The value at this span is not known at compile time.
    NotConstant(Span),
    /// A comma operator is at this span, which GLSL does not count among constants.
    Sequence(Span),
    /// The limit on operations was exceeded at this span.
    TooLong(Span),
    /// The tree contains an error that was reported.
    Error,
}

/// The leaves of a value, in order.
pub(super) type Value = Vec<Constant>;
/// A value, or the reason why there is none.
pub(super) type Evaluated<T> = Result<T, Stop>;
