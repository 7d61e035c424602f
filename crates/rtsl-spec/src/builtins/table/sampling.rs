//! Maps from uniform random numbers to points and directions.

use crate::builtins::{Builtin, Chapter};

pub(super) static SAMPLING: &[Builtin] = &[
    function(
        "sampleConcentricDisk",
        &["vec2 sampleConcentricDisk(vec2 u)"],
        "A point in the unit disk, uniform by area, from u uniform in [0, 1)^2; neighbouring \
         points stay neighbours.",
    ),
    function(
        "sampleCosineHemisphere",
        &["vec3 sampleCosineHemisphere(vec2 u)"],
        "A unit vector with z >= 0 and density z / pi per solid angle.",
    ),
    function(
        "sampleUniformHemisphere",
        &["vec3 sampleUniformHemisphere(vec2 u)"],
        "A unit vector with z >= 0 and density 1 / (2 pi) per solid angle.",
    ),
    function(
        "sampleUniformSphere",
        &["vec3 sampleUniformSphere(vec2 u)"],
        "A unit vector with density 1 / (4 pi) per solid angle.",
    ),
    function(
        "sampleUniformCone",
        &["vec3 sampleUniformCone(vec2 u, float cosine)"],
        "A unit vector with z >= cosine and density 1 / (2 pi (1 - cosine)) per solid angle. A cosine \
         near 1 has few digits for the angle: for cones of less than a degree use \
         sampleUniformConeByHeight.",
    ),
    function(
        "sampleUniformConeByHeight",
        &["vec3 sampleUniformConeByHeight(vec2 u, float height)"],
        "A unit vector with 1 - z <= height and density uniformConePDF(height) per solid angle. The \
         height of the cone's cap is 1 - cos(angle), which has all its digits when it is computed as \
         2 sin(angle / 2)^2, or as sin(angle)^2 / (1 + cos(angle)).",
    ),
    function(
        "uniformConePDF",
        &["float uniformConePDF(float height)"],
        "The density per solid angle of directions uniform in a cone whose cap has this height: \
         1 / (2 pi height).",
    ),
    function(
        "sampleUniformTriangle",
        &["vec2 sampleUniformTriangle(vec2 u)"],
        "Barycentric coordinates of the second and third vertex, uniform by area.",
    ),
    function(
        "sampleVisibleNormal",
        &["vec3 sampleVisibleNormal(vec3 view, vec2 alpha, vec2 u)"],
        "A normal of the GGX distribution with roughness alpha along x and y, as seen from the \
         unit vector view with z > 0; the density is G1(view) D(m) max(0, dot(view, m)) / view.z.",
    ),
    function(
        "makeFrame",
        &["mat3 makeFrame(vec3 normal)", "mat3 makeFrame(vec3 normal, vec3 tangent)"],
        "Three orthonormal columns, the third the unit normal; the first is as near to tangent \
         as that allows.",
    ),
    function(
        "toLocal",
        &["vec3 toLocal(mat3 frame, vec3 v)"],
        "The coordinates of v in an orthonormal frame.",
    ),
    function(
        "toWorld",
        &["vec3 toWorld(mat3 frame, vec3 v)"],
        "The vector with coordinates v in the frame: frame * v.",
    ),
];

const fn function(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::prelude(Chapter::Sampling, name, signatures, doc)
}
