//! Comparisons of vectors, integers (sections 8.7 and 8.8 of GLSL 4.60) and the intrinsics that
//! they use.

use crate::builtins::{Builtin, Chapter, Lowering, Operation, Special, Usable};

pub(super) static RELATIONAL: &[Builtin] = &[
    relational(
        "lessThan",
        Operation::Less,
        &[
            "bvec lessThan(vec x, vec y)",
            "bvec lessThan(ivec x, ivec y)",
            "bvec lessThan(uvec x, uvec y)",
        ],
        "x < y, component by component.",
    ),
    relational(
        "lessThanEqual",
        Operation::LessEqual,
        &[
            "bvec lessThanEqual(vec x, vec y)",
            "bvec lessThanEqual(ivec x, ivec y)",
            "bvec lessThanEqual(uvec x, uvec y)",
        ],
        "x <= y, component by component.",
    ),
    relational(
        "greaterThan",
        Operation::Greater,
        &[
            "bvec greaterThan(vec x, vec y)",
            "bvec greaterThan(ivec x, ivec y)",
            "bvec greaterThan(uvec x, uvec y)",
        ],
        "x > y, component by component.",
    ),
    relational(
        "greaterThanEqual",
        Operation::GreaterEqual,
        &[
            "bvec greaterThanEqual(vec x, vec y)",
            "bvec greaterThanEqual(ivec x, ivec y)",
            "bvec greaterThanEqual(uvec x, uvec y)",
        ],
        "x >= y, component by component.",
    ),
    relational(
        "equal",
        Operation::Equal,
        &[
            "bvec equal(vec x, vec y)",
            "bvec equal(ivec x, ivec y)",
            "bvec equal(uvec x, uvec y)",
            "bvec equal(bvec x, bvec y)",
        ],
        "x == y, component by component.",
    ),
    relational(
        "notEqual",
        Operation::NotEqual,
        &[
            "bvec notEqual(vec x, vec y)",
            "bvec notEqual(ivec x, ivec y)",
            "bvec notEqual(uvec x, uvec y)",
            "bvec notEqual(bvec x, bvec y)",
        ],
        "x != y, component by component.",
    ),
    Builtin::special(
        Chapter::Relational,
        "any",
        Special::Any,
        Usable::Anywhere,
        &["bool any(bvec x)"],
        "True if at least one component is true.",
    ),
    Builtin::special(
        Chapter::Relational,
        "all",
        Special::All,
        Usable::Anywhere,
        &["bool all(bvec x)"],
        "True if every component is true.",
    ),
    relational("not", Operation::Not, &["bvec not(bvec x)"], "The opposite of each component."),
];

pub(super) static INTEGER: &[Builtin] = &[
    function(
        "uaddCarry",
        &["genU uaddCarry(genU x, genU y, out genU carry)"],
        "x + y modulo 2^32; sets carry to 1 where the sum is larger, else 0.",
    ),
    function(
        "usubBorrow",
        &["genU usubBorrow(genU x, genU y, out genU borrow)"],
        "x - y modulo 2^32; sets borrow to 1 where y > x, else 0.",
    ),
    function(
        "umulExtended",
        &["void umulExtended(genU x, genU y, out genU high, out genU low)"],
        "The upper and the lower 32 bits of the product.",
    ),
    function(
        "imulExtended",
        &["void imulExtended(genI x, genI y, out genI high, out genI low)"],
        "The upper and the lower 32 bits of the product.",
    ),
    function(
        "bitfieldExtract",
        &[
            "genI bitfieldExtract(genI value, int offset, int bits)",
            "genU bitfieldExtract(genU value, int offset, int bits)",
        ],
        "The bits from offset to offset + bits - 1, shifted to the lowest bits, and sign-extended \
         for an int. Bits beyond the 32 of the value are 0 (of an int: its sign); offset is \
         clamped to [0, 31] and bits to [0, 32].",
    ),
    function(
        "bitfieldInsert",
        &[
            "genI bitfieldInsert(genI base, genI insert, int offset, int bits)",
            "genU bitfieldInsert(genU base, genU insert, int offset, int bits)",
        ],
        "base with the bits from offset to offset + bits - 1 taken from the lowest ones of \
         insert; offset is clamped to [0, 31] and bits to [0, 32].",
    ),
    function(
        "bitfieldReverse",
        &["genI bitfieldReverse(genI value)", "genU bitfieldReverse(genU value)"],
        "The 32 bits in the opposite order.",
    ),
    function(
        "bitCount",
        &["genI bitCount(genI value)", "genI bitCount(genU value)"],
        "The number of bits that are 1.",
    ),
    function(
        "findLSB",
        &["genI findLSB(genI value)", "genI findLSB(genU value)"],
        "The index of the lowest bit that is 1; -1 for 0.",
    ),
    function(
        "findMSB",
        &["genI findMSB(genI value)", "genI findMSB(genU value)"],
        "The index of the highest bit that is 1, of a negative int the highest that is 0; -1 for \
         0 and for the int -1.",
    ),
];

pub(super) static INTRINSIC: &[Builtin] = &[
    intrinsic(
        "rt_rawBits",
        Operation::BitcastToUint,
        &["uint rt_rawBits(float x)"],
        "The bits of x; a NaN keeps its bits.",
    ),
    intrinsic(
        "rt_fromRawBits",
        Operation::BitcastToFloat,
        &["float rt_fromRawBits(uint bits)"],
        "The float with these bits.",
    ),
    intrinsic(
        "rt_multiplyHigh",
        Operation::MultiplyHigh,
        &["int rt_multiplyHigh(int x, int y)", "uint rt_multiplyHigh(uint x, uint y)"],
        "The upper 32 bits of the product.",
    ),
    intrinsic(
        "rt_seldom",
        Operation::Seldom,
        &["bool rt_seldom(bool condition)"],
        "The condition, with the hint that it is seldom true: an `if` on it stays a branch that all lanes \
         take together, however short.",
    ),
];

const fn function(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::prelude(Chapter::Integer, name, signatures, doc)
}

const fn relational(
    name: &'static str,
    operation: Operation,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::operation(Chapter::Relational, name, operation, signatures, doc)
}

const fn intrinsic(
    name: &'static str,
    operation: Operation,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    let lowering = Lowering::Operation(operation);
    let usable = Usable::Prelude;
    Builtin { name, chapter: Chapter::Intrinsic, signatures, doc, lowering, usable }
}
