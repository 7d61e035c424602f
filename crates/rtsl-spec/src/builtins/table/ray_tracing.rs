//! Functions of the ray tracer. `illuminance` is a statement, not a function.

use crate::Method;
use crate::builtins::{Builtin, Chapter, Direction, Mapped, Special, Usable};

pub(super) static RAY_TRACING: &[Builtin] = &[
    function(
        "hit",
        Special::Hit,
        Usable::Methods(&[Method::Intersect]),
        &["bool hit(float t)"],
        "Offers a hit at t. Where rt_Epsilon < t < rt_HitDistance it is accepted: the result is \
         true and rt_HitDistance becomes t. Else nothing changes.",
    ),
    function(
        "trace",
        Special::Trace,
        RAYS,
        &[
            "color trace(vec3 origin, vec3 direction)",
            "color trace(vec3 origin, vec3 direction, float tMax)",
        ],
        "The radiance along a new ray, up to tMax lengths of the direction; black once the host's \
         limit of depth is reached.",
    ),
    function(
        "occluded",
        Special::Occluded,
        RAYS,
        &["bool occluded(vec3 origin, vec3 direction, float tMax)"],
        "True if a new ray is blocked closer than tMax lengths of the direction.",
    ),
    function(
        "ambient",
        Special::Ambient,
        SHADE,
        &["color ambient()"],
        "The scene's ambient light.",
    ),
    function(
        "inside",
        Special::Inside,
        MATERIAL,
        &["bool inside()"],
        "True if the ray hits the surface from inside: dot(rt_RayDirection, rt_GeometricNormal) > 0.",
    ),
    function(
        "pointToObject",
        Special::Map(Direction::ToObject, Mapped::Point),
        SURFACE,
        &["vec3 pointToObject(vec3 point)"],
        "The point of the world in the space of the object that the ray hit.",
    ),
    function(
        "pointToWorld",
        Special::Map(Direction::ToWorld, Mapped::Point),
        SURFACE,
        &["vec3 pointToWorld(vec3 point)"],
        "The point of the object's space in the world.",
    ),
    function(
        "vectorToObject",
        Special::Map(Direction::ToObject, Mapped::Vector),
        SURFACE,
        &["vec3 vectorToObject(vec3 vector)"],
        "The difference of points of the world as that in the space of the object that the ray hit.",
    ),
    function(
        "vectorToWorld",
        Special::Map(Direction::ToWorld, Mapped::Vector),
        SURFACE,
        &["vec3 vectorToWorld(vec3 vector)"],
        "The difference of points of the object's space as that in the world.",
    ),
    function(
        "normalToObject",
        Special::Map(Direction::ToObject, Mapped::Normal),
        SURFACE,
        &["vec3 normalToObject(vec3 normal)"],
        "The normal in the world as one in the space of the object that the ray hit, of any length.",
    ),
    function(
        "normalToWorld",
        Special::Map(Direction::ToWorld, Mapped::Normal),
        SURFACE,
        &["vec3 normalToWorld(vec3 normal)"],
        "The normal in the object's space as one in the world, of any length.",
    ),
    function(
        "isSet",
        Special::IsSet,
        Usable::Anywhere,
        &["bool isSet(reference shader)"],
        "True if the host has set this reference member.",
    ),
    function(
        "isTextured",
        Special::IsTextured,
        Usable::Anywhere,
        &["bool isTextured(reference parameter)"],
        "True if the host has set this `texture` member to a texture, and not to a value.",
    ),
    function(
        "rand",
        Special::Rand,
        Usable::Anywhere,
        &["float rand()"],
        "A number in [0, 1): the next dimension of the host's sampler for this ray.",
    ),
];

/// The methods that may trace rays.
pub(super) const RAYS: Usable = Usable::Methods(&[Method::Shade, Method::Radiance]);

/// The method that gathers ambient light.
const SHADE: Usable = Usable::Methods(&[Method::Shade]);

/// The methods that know the ray and the normal of a hit.
const MATERIAL: Usable = Usable::Methods(&[
    Method::Shade,
    Method::Bsdf,
    Method::SampleBsdf,
    Method::EvaluatePdf,
    Method::Emission,
    Method::Presence,
]);

/// The methods that know the object that a ray has hit.
pub(super) const SURFACE: Usable = Usable::Methods(&[
    Method::Shade,
    Method::Bsdf,
    Method::SampleBsdf,
    Method::EvaluatePdf,
    Method::Emission,
    Method::Presence,
    Method::Lookup,
]);

const fn function(
    name: &'static str,
    special: Special,
    usable: Usable,
    signatures: &'static [&'static str],
    doc: &'static str,
) -> Builtin {
    Builtin::special(Chapter::RayTracing, name, special, usable, signatures, doc)
}
