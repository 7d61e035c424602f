//! The methods that shaders call on references to other shaders, as in `kd.lookup()`.

use super::SpecType;
use super::SpecType::{Color, Float, Vec};
use super::spec_type::Scalar;
use crate::Role::{Camera, Light, Material, Primitive, Texture};
use crate::{Method, Role, StateVariable, lookup_state};

/// A method of a reference.
#[derive(Debug)]
pub struct ReferenceMethod {
    /// The role of the reference.
    pub role: Role,
    /// The name that shaders call.
    pub name: &'static str,
    /// The parameters, each with name and type.
    pub parameters: &'static [(&'static str, SpecType)],
    /// The type of the result.
    pub result: SpecType,
    /// The interface method of the referenced class that runs.
    pub runs: Method,
    /// The state variable of the callee that holds the result.
    pub returns: &'static str,
    /// State variables that the call also sets in the caller.
    pub also_sets: &'static [&'static str],
    /// A description for the manual.
    pub doc: &'static str,
}

const VEC3: SpecType = Vec(Scalar::Float, 3);
const UV: (&str, SpecType) = ("uv", Vec(Scalar::Float, 2));
const UVW: (&str, SpecType) = ("uvw", VEC3);
const DU: (&str, SpecType) = ("du", Float);
const DV: (&str, SpecType) = ("dv", Float);

/// Every method of every reference.
///
/// The callee sees the caller's ray and hit; a parameter replaces [a state variable](state_of_parameter).
pub static REFERENCE_METHODS: &[ReferenceMethod] = &[
    lookup("lookup", &[], Color, "The texture's color at the caller's hit."),
    lookup("lookup", &[UV], Color, "The texture's color at these surface coordinates."),
    lookup(
        "lookup",
        &[UV, DU, DV],
        Color,
        "The same, filtered over these widths of both coordinates.",
    ),
    lookup("lookup", &[UVW], Color, "The texture's color at this position."),
    lookup("lookupFloat", &[], Float, "The texture's float at the caller's hit."),
    lookup("lookupFloat", &[UV], Float, "The texture's float at these surface coordinates."),
    lookup(
        "lookupFloat",
        &[UV, DU, DV],
        Float,
        "The same, filtered over these widths of both coordinates.",
    ),
    lookup("lookupFloat", &[UVW], Float, "The texture's float at this position."),
    method(
        Material,
        Method::Shade,
        Color,
        "rt_SampleColor",
        &[],
        "The radiance that the material returns.",
    ),
    method(
        Material,
        Method::Bsdf,
        Color,
        "rt_BSDFValue",
        &[],
        "The BSDF's value for rt_LightDirection.",
    ),
    method(
        Material,
        Method::SampleBsdf,
        Color,
        "rt_BSDFValue",
        &["rt_LightDirection", "rt_PDF", "rt_RelativeIndex"],
        "The BSDF's value for a direction that the material picks.",
    ),
    method(
        Material,
        Method::EvaluatePdf,
        Float,
        "rt_PDF",
        &[],
        "The density with which sampleBSDF picks rt_LightDirection.",
    ),
    method(
        Material,
        Method::Emission,
        Color,
        "rt_EmissionColor",
        &[],
        "The radiance that the material emits towards the ray.",
    ),
    method(
        Material,
        Method::Presence,
        Float,
        "rt_Presence",
        &[],
        "What part of the material's surface there is; 1 for materials without the method.",
    ),
    method(
        Light,
        Method::Illumination,
        Color,
        "rt_LightColor",
        &["rt_LightDirection", "rt_LightDistance", "rt_PDF"],
        "The light that arrives at rt_HitPoint.",
    ),
    method(
        Light,
        Method::EvaluatePdf,
        Float,
        "rt_PDF",
        &[],
        "The density with which illumination picks rt_LightDirection.",
    ),
    method(
        Light,
        Method::Emission,
        Color,
        "rt_EmissionColor",
        &[],
        "The radiance that a ray brings back that leaves the scene.",
    ),
    method(
        Camera,
        Method::GenerateRay,
        Color,
        "rt_SampleColor",
        &["rt_RayOrigin", "rt_RayDirection", "rt_Epsilon", "rt_HitDistance"],
        "The weight of the camera's ray.",
    ),
    method(
        Primitive,
        Method::Intersect,
        Float,
        "rt_HitDistance",
        &[],
        "The distance of the nearest hit; without one, the rt_HitDistance that the call received.",
    ),
    method(
        Primitive,
        Method::ComputeBounds,
        VEC3,
        "rt_BoundMin",
        &["rt_BoundMax"],
        "The least corner of the box around the primitive.",
    ),
    method(
        Primitive,
        Method::ComputeNormal,
        VEC3,
        "rt_GeometricNormal",
        &["rt_ShadingNormal"],
        "The normal of the surface.",
    ),
    method(
        Primitive,
        Method::ComputeTextureCoordinates,
        Vec(Scalar::Float, 2),
        "rt_TextureUV",
        &["rt_TextureUVW"],
        "The texture coordinates.",
    ),
    method(
        Primitive,
        Method::ComputeDerivatives,
        VEC3,
        "rt_dPdu",
        &["rt_dPdv", "rt_dsdu", "rt_dsdv", "rt_dtdu", "rt_dtdv"],
        "The derivative of the point by u.",
    ),
    method(
        Primitive,
        Method::GenerateSample,
        VEC3,
        "rt_HitPoint",
        &["rt_GeometricNormal", "rt_PDF"],
        "A point on the primitive, seen from rt_RayOrigin.",
    ),
    method(
        Primitive,
        Method::SamplePdf,
        Float,
        "rt_PDF",
        &[],
        "The density with which generateSample picks rt_HitPoint.",
    ),
];

/// Returns the state variable of the callee that a parameter replaces.
pub fn state_of_parameter(name: &str) -> Option<&'static StateVariable> {
    lookup_state(match name {
        "uv" => "rt_TextureUV",
        "uvw" => "rt_TextureUVW",
        "du" => "rt_du",
        "dv" => "rt_dv",
        _ => return None,
    })
}

/// The state of the callee if its filter's widths are parameters: surface parameters are its texture coordinates.
pub const STATE_OF_WIDTHS: [(&str, f32); 4] =
    [("rt_dsdu", 1.0), ("rt_dtdu", 0.0), ("rt_dsdv", 0.0), ("rt_dtdv", 1.0)];

const fn lookup(
    name: &'static str,
    parameters: &'static [(&'static str, SpecType)],
    result: SpecType,
    doc: &'static str,
) -> ReferenceMethod {
    let returns = match result {
        Float => "rt_FloatTextureValue",
        _ => "rt_TextureColor",
    };
    ReferenceMethod {
        role: Texture,
        name,
        parameters,
        result,
        runs: Method::Lookup,
        returns,
        also_sets: &[],
        doc,
    }
}

/// A method without parameters that has the name of the method that runs.
const fn method(
    role: Role,
    runs: Method,
    result: SpecType,
    returns: &'static str,
    also_sets: &'static [&'static str],
    doc: &'static str,
) -> ReferenceMethod {
    let name = runs.name();
    ReferenceMethod { role, name, parameters: &[], result, runs, returns, also_sets, doc }
}
