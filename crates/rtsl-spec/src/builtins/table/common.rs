//! Common functions and packing: sections 8.3 and 8.4 of GLSL 4.60.

use super::ray_tracing::SURFACE;
use crate::builtins::{Along, Builtin, Chapter, Operation, Special, Usable};

pub(super) static COMMON: &[Builtin] = &[
    operation(
        "abs",
        Operation::Abs,
        &["genF abs(genF x)", "genI abs(genI x)", "color abs(color x)"],
        "The absolute value; the least int is returned unchanged.",
    ),
    function(
        "sign",
        &["genF sign(genF x)", "genI sign(genI x)"],
        "1 where x > 0, -1 where x < 0, else 0 (for NaN too).",
    ),
    operation("floor", Operation::Floor, &["genF floor(genF x)"], "The greatest integer <= x."),
    operation("trunc", Operation::Trunc, &["genF trunc(genF x)"], "x rounded towards zero."),
    operation(
        "round",
        Operation::RoundEven,
        &["genF round(genF x)"],
        "The nearest integer, with ties to even: the same as roundEven.",
    ),
    operation(
        "roundEven",
        Operation::RoundEven,
        &["genF roundEven(genF x)"],
        "The nearest integer, with ties to even.",
    ),
    operation("ceil", Operation::Ceil, &["genF ceil(genF x)"], "The least integer >= x."),
    function("fract", &["genF fract(genF x)"], "x - floor(x)."),
    function(
        "mod",
        &["genF mod(genF x, genF y)", "vec mod(vec x, float y)"],
        "x - y * floor(x / y): the sign is that of y.",
    ),
    function(
        "modf",
        &["genF modf(genF x, out genF whole)"],
        "The fraction of x with the sign of x; sets whole to the integer part.",
    ),
    operation(
        "min",
        Operation::Min,
        &[
            "genF min(genF x, genF y)",
            "vec min(vec x, float y)",
            "genI min(genI x, genI y)",
            "ivec min(ivec x, int y)",
            "genU min(genU x, genU y)",
            "uvec min(uvec x, uint y)",
            "color min(color x, genC y)",
        ],
        "y < x ? y : x, so x where either is NaN.",
    ),
    operation(
        "max",
        Operation::Max,
        &[
            "genF max(genF x, genF y)",
            "vec max(vec x, float y)",
            "genI max(genI x, genI y)",
            "ivec max(ivec x, int y)",
            "genU max(genU x, genU y)",
            "uvec max(uvec x, uint y)",
            "color max(color x, genC y)",
        ],
        "x < y ? y : x, so x where either is NaN.",
    ),
    function(
        "clamp",
        &[
            "genF clamp(genF x, genF low, genF high)",
            "vec clamp(vec x, float low, float high)",
            "genI clamp(genI x, genI low, genI high)",
            "ivec clamp(ivec x, int low, int high)",
            "genU clamp(genU x, genU low, genU high)",
            "uvec clamp(uvec x, uint low, uint high)",
            "color clamp(color x, genC low, genC high)",
        ],
        "min(max(x, low), high); high where low > high, and NaN for NaN.",
    ),
    function(
        "mix",
        &[
            "genF mix(genF x, genF y, genF a)",
            "vec mix(vec x, vec y, float a)",
            "genF mix(genF x, genF y, genB a)",
            "genI mix(genI x, genI y, genB a)",
            "genU mix(genU x, genU y, genB a)",
            "genB mix(genB x, genB y, genB a)",
            "color mix(color x, genC y, genC a)",
        ],
        "x * (1 - a) + y * a; with a bool, y where it is true, x where it is false.",
    ),
    function(
        "step",
        &[
            "genF step(genF edge, genF x)",
            "vec step(float edge, vec x)",
            "color step(color edge, genC x)",
            "color step(float edge, color x)",
        ],
        "0 where x < edge, else 1.",
    ),
    function(
        "smoothstep",
        &[
            "genF smoothstep(genF edge0, genF edge1, genF x)",
            "vec smoothstep(float edge0, float edge1, vec x)",
            "color smoothstep(color edge0, genC edge1, genC x)",
            "color smoothstep(float edge0, float edge1, color x)",
        ],
        "t * t * (3 - 2 * t) where t = clamp((x - edge0) / (edge1 - edge0), 0, 1).",
    ),
    function("isnan", &["genB isnan(genF x)"], "True if x is NaN."),
    function("isinf", &["genB isinf(genF x)"], "True if x is an infinity of either sign."),
    function(
        "floatBitsToInt",
        &["genI floatBitsToInt(genF x)"],
        "The bits of x as an int; every NaN gives 0x7fc00000.",
    ),
    function(
        "floatBitsToUint",
        &["genU floatBitsToUint(genF x)"],
        "The bits of x as a uint; every NaN gives 0x7fc00000.",
    ),
    function("intBitsToFloat", &["genF intBitsToFloat(genI bits)"], "The float with these bits."),
    function("uintBitsToFloat", &["genF uintBitsToFloat(genU bits)"], "The float with these bits."),
    operation(
        "fma",
        Operation::Fma,
        &["genF fma(genF a, genF b, genF c)"],
        "a * b + c, rounded once.",
    ),
    function(
        "frexp",
        &["genF frexp(genF x, out genI exponent)"],
        "The significand in [0.5, 1), with the sign of x, such that x is the result times 2^exponent. \
         Zeros, infinities and NaN are returned with exponent 0.",
    ),
    function(
        "ldexp",
        &["genF ldexp(genF x, genI exponent)"],
        "x * 2^exponent, rounded once; overflows to an infinity and underflows towards 0.",
    ),
];

pub(super) static DERIVATIVES: &[Builtin] = &[
    Builtin::special(
        Chapter::Derivatives,
        "gradient",
        Special::Gradient,
        Usable::Anywhere,
        &[
            "float gradient(float value, float variable)",
            "vec2 gradient(float value, vec2 variable)",
            "vec3 gradient(float value, vec3 variable)",
            "vec4 gradient(float value, vec4 variable)",
            "vec2 gradient(vec2 value, float variable)",
            "vec3 gradient(vec3 value, float variable)",
            "vec4 gradient(vec4 value, float variable)",
            "color gradient(color value, float variable)",
        ],
        "The derivatives of an expression with respect to a local variable or parameter, as the expression is computed: exact \
     to rounding, through functions, branches, loops and textures. Where a branch or a rounding jumps, they are those of \
     the branch taken.",
    ),
    change(
        "dFdx",
        Along::U,
        &["genF dFdx(genF p)", "color dFdx(color p)"],
        "The change of a value over the width of the filter along u: its differential for a step of `rt_du`, as the method \
         computes it from `rt_TextureUV`, `rt_TextureUVW` and `rt_HitPoint`.",
    ),
    change(
        "dFdy",
        Along::V,
        &["genF dFdy(genF p)", "color dFdy(color p)"],
        "The change of a value over the width of the filter along v: its differential for a step of `rt_dv`.",
    ),
    change(
        "fwidth",
        Along::Both,
        &["genF fwidth(genF p)", "color fwidth(color p)"],
        "`abs(dFdx(p)) + abs(dFdy(p))`: the width of the values that a ray sees.",
    ),
];

const fn change(
    name: &'static str,
    along: Along,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    let special = Special::Change(along);
    Builtin::special(Chapter::Derivatives, name, special, SURFACE, signatures, doc)
}

pub(super) static PACKING: &[Builtin] = &[
    packing(
        "packUnorm2x16",
        &["uint packUnorm2x16(vec2 v)"],
        "Each component in [0, 1], clamped, in 16 bits; x in the lower ones.",
    ),
    packing(
        "packSnorm2x16",
        &["uint packSnorm2x16(vec2 v)"],
        "Each component in [-1, 1], clamped, in 16 bits; x in the lower ones.",
    ),
    packing(
        "packUnorm4x8",
        &["uint packUnorm4x8(vec4 v)"],
        "Each component in [0, 1], clamped, in 8 bits; x in the lowest ones.",
    ),
    packing(
        "packSnorm4x8",
        &["uint packSnorm4x8(vec4 v)"],
        "Each component in [-1, 1], clamped, in 8 bits; x in the lowest ones.",
    ),
    packing("unpackUnorm2x16", &["vec2 unpackUnorm2x16(uint p)"], "The inverse of packUnorm2x16."),
    packing("unpackSnorm2x16", &["vec2 unpackSnorm2x16(uint p)"], "The inverse of packSnorm2x16."),
    packing("unpackUnorm4x8", &["vec4 unpackUnorm4x8(uint p)"], "The inverse of packUnorm4x8."),
    packing("unpackSnorm4x8", &["vec4 unpackSnorm4x8(uint p)"], "The inverse of packSnorm4x8."),
    packing(
        "packHalf2x16",
        &["uint packHalf2x16(vec2 v)"],
        "Each component as IEEE 754 binary16, rounded to nearest even; x in the lower bits.",
    ),
    packing(
        "unpackHalf2x16",
        &["vec2 unpackHalf2x16(uint v)"],
        "Two numbers of IEEE 754 binary16 as floats; x from the lower bits.",
    ),
];

const fn function(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::prelude(Chapter::Common, name, signatures, doc)
}

const fn operation(
    name: &'static str,
    operation: Operation,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::operation(Chapter::Common, name, operation, signatures, doc)
}

const fn packing(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::prelude(Chapter::Packing, name, signatures, doc)
}
