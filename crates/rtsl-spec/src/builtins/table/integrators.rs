//! Functions of integrators, and the methods of surfaces.

use super::ray_tracing::RAYS;
use crate::Method;
use crate::builtins::{Builtin, Chapter, Lowering, SpecStruct, Special, Usable};

pub(super) static INTEGRATORS: &[Builtin] = &[
    Builtin::special(
        Chapter::Integrators,
        "nearestHit",
        Special::NearestHit,
        RAYS,
        &[
            "rt_Surface nearestHit()",
            "rt_Surface nearestHit(vec3 origin, vec3 direction)",
            "rt_Surface nearestHit(vec3 origin, vec3 direction, float tMax)",
            "rt_Surface nearestHit(vec3 origin, vec3 direction, float tMax, float width, float spread)",
        ],
        "The nearest surface on a ray, up to tMax lengths of the direction; without arguments, which `shade` has to \
         give, on the integrator's own ray. The footprint of the ray, which textures are filtered by, has this width at the origin and grows by \
         spread with each length of the direction.",
    ),
    asks(
        "contribute",
        Special::Query("contribute"),
        &["void contribute(vec3 origin, vec3 direction, float tMax, color light)"],
        "Adds light to the radiance of the ray if nothing blocks a new ray before tMax lengths of its direction. All \
         contributions together, in their order, are added to rt_SampleColor at the end.",
    ),
    Builtin {
        usable: RADIANCE,
        ..Builtin::prelude(
            Chapter::Integrators,
            "sampleLight",
            &[
                "rt_LightSample sampleLight(vec3 point, vec3 geometricNormal, vec3 shadingNormal, float seed)",
            ],
            "Light that arrives at a point whose normals are on the side to be lit, from one of the scene's lights: the \
             seed chooses it, and further numbers of the host's sampler choose a point on it. Whether anything is \
             between them is not tested.",
        )
    },
    asks(
        "skyCount",
        Special::Query("sky_count"),
        &["int skyCount()"],
        "The number of the scene's lights that rays find when they leave the scene.",
    ),
    asks(
        "skyEmission",
        Special::Query("sky_emission"),
        &["color skyEmission(int sky, vec3 origin, vec3 direction)"],
        "The radiance of such a light, from 0 to skyCount() - 1, along a ray.",
    ),
    asks(
        "skyPDF",
        Special::Query("sky_pdf"),
        &[
            "float skyPDF(int sky, vec3 point, vec3 geometricNormal, vec3 shadingNormal, vec3 direction)",
        ],
        "The density per solid angle with which sampleLight at this point chooses the direction of such a light.",
    ),
    asks(
        "sample1D",
        Special::Query("sample"),
        &["float sample1D(int dimension)"],
        "A number in [0, 1): this dimension of the host's sampler. Calls with one dimension give one number; `rand()` \
         gives others.",
    ),
    asks(
        "sample2D",
        Special::Query("sample_pair"),
        &["vec2 sample2D(int dimension)"],
        "Two numbers in [0, 1) that the host's sampler stratifies together. They are independent of those of sample1D.",
    ),
    Builtin::prelude(
        Chapter::Integrators,
        "powerHeuristic",
        &["float powerHeuristic(float density, float other)"],
        "The weight of a sample that was chosen with this density, where another technique would have chosen it with \
              the other: Veach's power heuristic. 1 if the first is 0, as for a delta.",
    ),
];

/// The methods that structs of the language have. The first parameter is the struct.
pub(in crate::builtins) static STRUCT_METHODS: &[(SpecStruct, Builtin)] = &[
    asks_of_surface(
        "BSDF",
        Lowering::Special(Special::Query("bsdf")),
        &["color BSDF(rt_Surface surface, vec3 direction)"],
        "The value of the material's BSDF for the ray and this direction, without the cosine.",
    ),
    asks_of_surface(
        "evaluatePDF",
        Lowering::Special(Special::Query("bsdf_pdf")),
        &["float evaluatePDF(rt_Surface surface, vec3 direction)"],
        "The density with which sampleBSDF chooses this direction.",
    ),
    asks_of_surface(
        "sampleBSDF",
        Lowering::Prelude,
        &["rt_BSDFSample sampleBSDF(rt_Surface surface, vec3 seed)"],
        "A direction that the material chooses, with its weight. The weight is 0 where the two normals disagree on the \
         side of the surface to which it leads.",
    ),
    asks_of_surface(
        "emission",
        Lowering::Special(Special::Query("emission")),
        &["color emission(rt_Surface surface)"],
        "The radiance that the material emits towards the ray's origin. Light sampling does not find it.",
    ),
    asks_of_surface(
        "lightEmission",
        Lowering::Special(Special::Query("light_emission")),
        &["color lightEmission(rt_Surface surface)"],
        "The radiance of the area light that the surface is; black if it is none.",
    ),
    asks_of_surface(
        "lightPDF",
        Lowering::Special(Special::Query("light_pdf")),
        &["float lightPDF(rt_Surface surface, vec3 point)"],
        "The density with which sampleLight at a point chooses the direction to this surface; 0 if it never does.",
    ),
    asks_of_surface(
        "shade",
        Lowering::Special(Special::Query("shade")),
        &["color shade(rt_Surface surface)"],
        "The radiance that the material's `shade` returns to the ray. Rays that it traces are integrated in the same way.",
    ),
    of_surface(
        "facingNormals",
        &["void facingNormals(rt_Surface surface, out vec3 geometric, out vec3 shading)"],
        "The normals on the side from which the ray came.",
    ),
    of_surface(
        "leave",
        &["vec3 leave(rt_Surface surface, vec3 direction)"],
        "The origin of a ray that leaves the surface in this direction, off the surface by its offset.",
    ),
    of_surface(
        "cosine",
        &["float cosine(rt_Surface surface, vec3 direction)"],
        "The absolute cosine between the shading normal and a unit vector; 0 where the two normals disagree on the side \
         of the surface to which it leads, since light would leak through (Veach 1997, section 5.3.3).",
    ),
    asks_of_surface(
        "sampleLight",
        Lowering::Prelude,
        &["rt_LightSample sampleLight(rt_Surface surface, float seed)"],
        "Light that arrives at the surface on the side from which the ray came.",
    ),
    on_rays(
        "follow",
        &["rt_Surface follow(rt_Surface surface, vec3 direction, float density)"],
        "The nearest surface on the ray that leaves in this direction, which was chosen with this density; 0 for a \
         delta. The less likely a direction is, the faster the footprint grows.",
    ),
    on_rays(
        "occluded",
        &["bool occluded(rt_Surface surface, vec3 direction, float tMax)"],
        "True if a ray that leaves the surface is blocked before tMax lengths of the direction.",
    ),
    asks_of_surface(
        "contribute",
        Lowering::Prelude,
        &["void contribute(rt_Surface surface, vec3 direction, float tMax, color light)"],
        "Adds light to the radiance of the ray if nothing blocks a ray that leaves the surface, as the function of that \
         name does.",
    ),
    of_surface(
        "side",
        &["float side(rt_Surface surface)"],
        "1 if the ray came from the side to which the geometric normal points, otherwise -1.",
    ),
];

/// The methods of integrators.
pub(in crate::builtins) const RADIANCE: Usable = Usable::Methods(&[Method::Radiance]);

const fn asks(
    name: &'static str,
    special: Special,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::special(Chapter::Integrators, name, special, RADIANCE, signatures, doc)
}

/// A method that asks the scene.
const fn asks_of_surface(
    name: &'static str,
    lowering: Lowering,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> (SpecStruct, Builtin) {
    let (_, method) = of_surface(name, signatures, doc);
    (SpecStruct::Surface, Builtin { lowering, usable: RADIANCE, ..method })
}

/// A method that traces a ray, for all methods that may.
const fn on_rays(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> (SpecStruct, Builtin) {
    let (_, method) = of_surface(name, signatures, doc);
    (SpecStruct::Surface, Builtin { usable: RAYS, ..method })
}

/// A method that computes with the struct's fields alone.
const fn of_surface(
    name: &'static str,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> (SpecStruct, Builtin) {
    (SpecStruct::Surface, Builtin::prelude(Chapter::Integrators, name, signatures, doc))
}

/// The functions by which the prelude implements methods.
pub(super) static INTRINSIC: &[Builtin] = &[
    Builtin::special(
        Chapter::Intrinsic,
        "rt_sampleBSDF",
        Special::Query("sample_bsdf"),
        Usable::Prelude,
        &["rt_BSDFSample rt_sampleBSDF(rt_Surface surface, vec3 seed)"],
        "As the material's method sets rt_LightDirection, rt_BSDFValue, rt_PDF and rt_RelativeIndex.",
    ),
    Builtin::special(
        Chapter::Intrinsic,
        "rt_sampleLight",
        Special::Query("sample_light"),
        Usable::Prelude,
        &[
            "rt_LightSample rt_sampleLight(vec3 point, vec3 geometricNormal, vec3 shadingNormal, float offset, float seed)",
        ],
        "Light for a point that rays leave at this offset.",
    ),
];
