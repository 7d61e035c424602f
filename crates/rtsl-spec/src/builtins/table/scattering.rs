//! What materials are made of: facets of rough surfaces, boundaries of clear media

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
        "Smith's function for that density: how many facets are hidden from the direction v for \
         each that is seen. Of a view and a light, 1 / (1 + smithLambda(view) + smithLambda(light)) see both.",
    ),
    function(
        "fresnelDielectric",
        &["float fresnelDielectric(float cosine, float eta)"],
        "What part of unpolarised light a smooth boundary of clear media reflects that meets it \
         at this cosine > 0; eta is the index of refraction beyond the boundary over that before it.",
    ),
    function(
        "ggxAlbedo",
        &["float ggxAlbedo(float cosine, float alpha, float eta)"],
        "What part of the light that meets a rough boundary of clear media at this cosine > 0 its facets reflect \
         once, with alpha and eta as above. A sum over 64 facets, for constructors.",
    ),
];

const fn function(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::prelude(Chapter::Scattering, name, signatures, doc)
}
