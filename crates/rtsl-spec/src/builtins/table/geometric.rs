//! Vectors as geometry, and matrices: sections 8.5 and 8.6 of GLSL 4.60.

use crate::builtins::{Builtin, Chapter, Special, Usable};

pub(super) static GEOMETRIC: &[Builtin] = &[
    function("length", &["float length(genF v)"], "sqrt(dot(v, v))."),
    function("distance", &["float distance(genF a, genF b)"], "length(a - b)."),
    function("dot", &["float dot(genF a, genF b)"], "The sum of the products of the components."),
    function("cross", &["vec3 cross(vec3 a, vec3 b)"], "The vector product."),
    function(
        "normalize",
        &["genF normalize(genF v)"],
        "v / length(v); NaN for a vector of length 0.",
    ),
    function(
        "faceforward",
        &["genF faceforward(genF n, genF i, genF reference)"],
        "n where dot(reference, i) < 0, else -n.",
    ),
    function(
        "reflect",
        &["genF reflect(genF i, genF n)"],
        "The direction i mirrored at the plane with unit normal n: i - 2 * dot(n, i) * n.",
    ),
    function(
        "refract",
        &["genF refract(genF i, genF n, float eta)"],
        "The unit direction i refracted at the plane with unit normal n and ratio eta of the \
         refractive indices (before over behind); zero at total reflection.",
    ),
    function(
        "perpendicularTo",
        &["vec3 perpendicularTo(vec3 v)"],
        "A unit vector at right angles to v, continuous almost everywhere; for a zero vector it \
         is one of the axes.",
    ),
    function(
        "dominantAxis",
        &["int dominantAxis(vec3 v)"],
        "The index of the component of largest magnitude, the lowest index on ties.",
    ),
];

pub(super) static MATRIX: &[Builtin] = &[
    Builtin::special(
        Chapter::Matrix,
        "matrixCompMult",
        Special::MatrixCompMult,
        Usable::Anywhere,
        &["mat matrixCompMult(mat x, mat y)"],
        "The product component by component.",
    ),
    matrix(
        "outerProduct",
        &[
            "mat2 outerProduct(vec2 column, vec2 row)",
            "mat2x3 outerProduct(vec3 column, vec2 row)",
            "mat2x4 outerProduct(vec4 column, vec2 row)",
            "mat3x2 outerProduct(vec2 column, vec3 row)",
            "mat3 outerProduct(vec3 column, vec3 row)",
            "mat3x4 outerProduct(vec4 column, vec3 row)",
            "mat4x2 outerProduct(vec2 column, vec4 row)",
            "mat4x3 outerProduct(vec3 column, vec4 row)",
            "mat4 outerProduct(vec4 column, vec4 row)",
        ],
        "The matrix product of a column and a row.",
    ),
    Builtin::special(
        Chapter::Matrix,
        "transpose",
        Special::Transpose,
        Usable::Anywhere,
        &[
            "mat2 transpose(mat2 m)",
            "mat3x2 transpose(mat2x3 m)",
            "mat4x2 transpose(mat2x4 m)",
            "mat2x3 transpose(mat3x2 m)",
            "mat3 transpose(mat3 m)",
            "mat4x3 transpose(mat3x4 m)",
            "mat2x4 transpose(mat4x2 m)",
            "mat3x4 transpose(mat4x3 m)",
            "mat4 transpose(mat4 m)",
        ],
        "The transpose, with rows and columns exchanged.",
    ),
    matrix(
        "determinant",
        &["float determinant(mat2 m)", "float determinant(mat3 m)", "float determinant(mat4 m)"],
        "The determinant.",
    ),
    matrix(
        "inverse",
        &["mat2 inverse(mat2 m)", "mat3 inverse(mat3 m)", "mat4 inverse(mat4 m)"],
        "The inverse; not finite where the determinant is 0.",
    ),
];

const fn function(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::prelude(Chapter::Geometric, name, signatures, doc)
}

const fn matrix(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::prelude(Chapter::Matrix, name, signatures, doc)
}
