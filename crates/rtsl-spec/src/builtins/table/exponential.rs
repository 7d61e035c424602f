//! Powers, exponentials, logarithms and roots: section 8.2 of GLSL 4.60.

use crate::builtins::{Builtin, Chapter, Operation};

pub(super) static EXPONENTIAL: &[Builtin] = &[
    function(
        "pow",
        &["genF pow(genF x, genF y)", "color pow(color x, genC y)"],
        "x to the power of y. pow(0, y) is 0 for y > 0, 1 for y = 0, +infinity \
         for y < 0; NaN for x < 0. Results below the smallest normal number are 0.",
    ),
    function(
        "exp",
        &["genF exp(genF x)", "color exp(color x)"],
        "e to the power of x. Results below the smallest normal number are 0.",
    ),
    function(
        "log",
        &["genF log(genF x)", "color log(color x)"],
        "The natural logarithm; -infinity for 0, NaN for x < 0.",
    ),
    function(
        "exp2",
        &["genF exp2(genF x)"],
        "2 to the power of x, exact for integers. Results below the smallest normal number are 0.",
    ),
    function(
        "log2",
        &["genF log2(genF x)"],
        "The logarithm to base 2, exact for powers of 2; -infinity for 0, NaN for x < 0.",
    ),
    Builtin::operation(
        Chapter::Exponential,
        "sqrt",
        Operation::Sqrt,
        &["genF sqrt(genF x)", "color sqrt(color x)"],
        "The square root, correctly rounded; NaN for x < 0.",
    ),
    function(
        "inversesqrt",
        &["genF inversesqrt(genF x)"],
        "1 / sqrt(x); +infinity for 0, NaN for x < 0.",
    ),
];

const fn function(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::prelude(Chapter::Exponential, name, signatures, doc)
}
