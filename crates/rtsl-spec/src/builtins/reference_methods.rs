//! The methods that shaders call on references to other shaders, as in `kd.lookup()`.

use super::SpecType;
use super::SpecType::{Color, Float, Vec};
use super::spec_type::Scalar;
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

/// The method called `name` whose parameters have these types.
pub fn reference_method(
    role: Role,
    name: &str,
    parameters: &[SpecType],
) -> Option<&'static ReferenceMethod> {
    REFERENCE_METHODS.iter().find(|method| {
        method.role == role
            && method.name == name
            && method.parameters.iter().map(|(_, ty)| ty).eq(parameters)
    })
}

const UV: (&str, SpecType) = ("uv", Vec(Scalar::Float, 2));
const UVW: (&str, SpecType) = ("uvw", Vec(Scalar::Float, 3));
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
    material(
        Method::Shade,
        Color,
        "rt_SampleColor",
        &[],
        "The radiance that the material returns.",
    ),
    material(Method::Bsdf, Color, "rt_BSDFValue", &[], "The BSDF's value for rt_LightDirection."),
    material(
        Method::SampleBsdf,
        Color,
        "rt_BSDFValue",
        &["rt_LightDirection", "rt_PDF", "rt_RelativeIndex"],
        "The BSDF's value for a direction that the material picks; sets the caller's \
         rt_LightDirection, rt_PDF and rt_RelativeIndex.",
    ),
    material(
        Method::EvaluatePdf,
        Float,
        "rt_PDF",
        &[],
        "The density with which sampleBSDF picks rt_LightDirection.",
    ),
    material(
        Method::Emission,
        Color,
        "rt_EmissionColor",
        &[],
        "The radiance that the material emits towards the ray.",
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
        role: Role::Texture,
        name,
        parameters,
        result,
        runs: Method::Lookup,
        returns,
        also_sets: &[],
        doc,
    }
}

const fn material(
    runs: Method,
    result: SpecType,
    returns: &'static str,
    also_sets: &'static [&'static str],
    doc: &'static str,
) -> ReferenceMethod {
    ReferenceMethod {
        role: Role::Material,
        name: runs.name(),
        parameters: &[],
        result,
        runs,
        returns,
        also_sets,
        doc,
    }
}
