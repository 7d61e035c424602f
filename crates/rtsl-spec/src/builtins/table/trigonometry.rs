//! Angles and trigonometry: section 8.1 of GLSL 4.60.

use crate::builtins::{Builtin, Chapter};

pub(super) static TRIGONOMETRY: &[Builtin] = &[
    function(
        "radians",
        &["genF radians(genF degrees)"],
        "Degrees to radians: pi / 180 times degrees.",
    ),
    function(
        "degrees",
        &["genF degrees(genF radians)"],
        "Radians to degrees: 180 / pi times radians.",
    ),
    function(
        "sin",
        &["genF sin(genF angle)"],
        "The sine of an angle in radians; for |angle| > 2^20 in [-1, 1] with an error that \
         grows; NaN for infinities.",
    ),
    function(
        "cos",
        &["genF cos(genF angle)"],
        "The cosine of an angle in radians; for |angle| > 2^20 in [-1, 1] with an error that \
         grows; NaN for infinities.",
    ),
    function(
        "tan",
        &["genF tan(genF angle)"],
        "The tangent of an angle in radians; NaN for infinities.",
    ),
    function(
        "asin",
        &["genF asin(genF x)"],
        "The angle in [-pi/2, pi/2] whose sine is x; NaN for |x| > 1.",
    ),
    function(
        "acos",
        &["genF acos(genF x)"],
        "The angle in [0, pi] whose cosine is x; NaN for |x| > 1.",
    ),
    function(
        "atan",
        &["genF atan(genF y, genF x)", "genF atan(genF yOverX)"],
        "The angle in [-pi, pi] of the point (x, y), or the angle in [-pi/2, pi/2] whose tangent \
         is yOverX. For x = y = 0 it is 0 or pi with the sign of y, as in C.",
    ),
    function("sinh", &["genF sinh(genF x)"], "The hyperbolic sine, (exp(x) - exp(-x)) / 2."),
    function("cosh", &["genF cosh(genF x)"], "The hyperbolic cosine, (exp(x) + exp(-x)) / 2."),
    function("tanh", &["genF tanh(genF x)"], "The hyperbolic tangent, sinh(x) / cosh(x)."),
    function("asinh", &["genF asinh(genF x)"], "The inverse of sinh."),
    function(
        "acosh",
        &["genF acosh(genF x)"],
        "The inverse of cosh that is not negative; NaN for x < 1.",
    ),
    function(
        "atanh",
        &["genF atanh(genF x)"],
        "The inverse of tanh; infinite for |x| = 1, NaN for |x| > 1.",
    ),
];

const fn function(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::prelude(Chapter::Trigonometry, name, signatures, doc)
}
