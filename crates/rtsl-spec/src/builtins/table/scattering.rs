//! Building blocks of materials: microfacets, dielectric boundaries.

use crate::builtins::{Builtin, Chapter};

pub(super) static SCATTERING: &[Builtin] = &[
    function(
        "ggxDensity",
        &["float ggxDensity(vec3 h, vec2 alpha)"],
        "The density of facets by the direction h of their normal, which may have any length: \
         Trowbridge and Reitz's (GGX) with roughness alpha > 0 along x and y.",
    ),
    function(
        "smithLambda",
        &["float smithLambda(vec3 v, vec2 alpha)"],
        "Smith's function for that density: the ratio of the facets hidden from the direction v to those \
         visible from it. The fraction visible from both a view and a light is \
         1 / (1 + smithLambda(view) + smithLambda(light)).",
    ),
    function(
        "regularized",
        &["vec2 regularized(vec2 alpha, float widest)"],
        "Roughness of facets for light whose path has been scattered before: each alpha below widest is doubled, to a third \
         of widest at least and widest at most. Others stay, as do all if widest is 0.",
    ),
    function(
        "fresnelDielectric",
        &["float fresnelDielectric(float cosine, float eta)"],
        "The Fresnel reflectance of a smooth dielectric boundary for unpolarised light that arrives \
         at this cosine > 0; eta is the index of refraction beyond the boundary over that before it.",
    ),
    function(
        "ggxAlbedo",
        &["float ggxAlbedo(float cosine, float alpha, float eta)"],
        "The fraction of light arriving at a rough dielectric boundary at this cosine > 0 that its facets reflect \
         once, with alpha and eta as above. Computed as a sum over 64 facets, so call it in constructors.",
    ),
];

const fn function(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::prelude(Chapter::Scattering, name, signatures, doc)
}
