//! The structs of the language, which its functions take and return.

use super::SpecType;
use super::SpecType::{Bool, Color, Float, Int, Vec};
use super::spec_type::Scalar;

/// A struct that the language declares.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SpecStruct {
    /// A surface that a ray has found.
    Surface,
    /// A direction of scattered light that a material chooses.
    BsdfSample,
    /// Light that arrives at a point.
    LightSample,
}

/// A field of a struct.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// The name.
    pub name: &'static str,
    /// The type.
    pub ty: SpecType,
    /// The meaning, unit and space, for the manual.
    pub doc: &'static str,
}

impl SpecStruct {
    /// All structs.
    pub const ALL: [SpecStruct; 3] =
        [SpecStruct::Surface, SpecStruct::BsdfSample, SpecStruct::LightSample];

    /// The name in RTSL: `rt_Surface`.
    pub const fn name(self) -> &'static str {
        match self {
            SpecStruct::Surface => "rt_Surface",
            SpecStruct::BsdfSample => "rt_BSDFSample",
            SpecStruct::LightSample => "rt_LightSample",
        }
    }

    /// The struct called `name`.
    pub fn from_name(name: &str) -> Option<SpecStruct> {
        SpecStruct::ALL.into_iter().find(|each| each.name() == name)
    }

    /// A description in one sentence, for the manual.
    pub const fn doc(self) -> &'static str {
        match self {
            SpecStruct::Surface => "The surface that a ray has found, in world space.",
            SpecStruct::BsdfSample => "A direction of scattered light that a material chooses.",
            SpecStruct::LightSample => "Light that arrives at a point from a light of the scene.",
        }
    }

    /// The fields, in order.
    pub const fn fields(self) -> &'static [Field] {
        match self {
            SpecStruct::Surface => SURFACE,
            SpecStruct::BsdfSample => BSDF_SAMPLE,
            SpecStruct::LightSample => LIGHT_SAMPLE,
        }
    }
}

const VEC2: SpecType = Vec(Scalar::Float, 2);
const VEC3: SpecType = Vec(Scalar::Float, 3);

const fn field(name: &'static str, ty: SpecType, doc: &'static str) -> Field {
    Field { name, ty, doc }
}

/// After `found` come the scalars by which the scene identifies a surface (`rtsl_ir::SURFACE`), in their order, then
/// the properties.
const SURFACE: &[Field] = &[
    field(
        "found",
        Bool,
        "whether the ray hit anything; all other fields are 0 if not, except those of the ray",
    ),
    field("object", Int, "index of the object in the scene"),
    field("instance", Int, "which of the object's instances the ray hit"),
    field(
        "element",
        Int,
        "which of the object's elements the ray hit: the triangle of a mesh, say",
    ),
    field("distance", Float, "parameter t of the hit, in units of the direction's length"),
    field("epsilon", Float, "least distance at which a hit counted"),
    field("limit", Float, "greatest distance at which a hit counted"),
    field("origin", VEC3, "origin of the ray"),
    field("direction", VEC3, "direction of the ray, towards the surface; need not be unit length"),
    field("width", Float, "width of the ray's footprint at its origin"),
    field("spread", Float, "growth of the footprint's width with each unit of distance"),
    field("point", VEC3, "the point"),
    field("geometricNormal", VEC3, "normal of the surface, unit length, outward"),
    field("shadingNormal", VEC3, "normal for shading, unit length, outward"),
    field("uv", VEC2, "surface parameters"),
    field("uvw", VEC3, "coordinates for solid textures"),
    field("dPdu", VEC3, "derivative of the surface point by u"),
    field("dPdv", VEC3, "derivative of the surface point by v"),
    field("du", Float, "width of the ray's footprint in surface parameters, along u"),
    field("dv", Float, "width of the ray's footprint in surface parameters, along v"),
    field(
        "offset",
        Float,
        "distance along the geometric normal at which rays that leave the surface begin",
    ),
    field(
        "regularization",
        Float,
        "width of highlights, as `rt_Regularization` of the material; 0 unless the integrator sets it",
    ),
];

const BSDF_SAMPLE: &[Field] = &[
    field("direction", VEC3, "unit vector away from the surface, towards the light"),
    field(
        "weight",
        Color,
        "factor of the radiance from there: the BSDF times the cosine, divided by the density; 0 if nothing is scattered",
    ),
    field("density", Float, "density per solid angle; 0 for a delta, such as a mirror's direction"),
    field(
        "relativeIndex",
        Float,
        "index of refraction on that side of the surface, over that on the ray's side, whose square divides the weight; 1 for what is not refracted",
    ),
];

const LIGHT_SAMPLE: &[Field] = &[
    field("found", Bool, "whether a light reaches the point if nothing is between them"),
    field("direction", VEC3, "unit vector towards the light"),
    field("distance", Float, "length of a ray towards the light that does not reach it"),
    field(
        "light",
        Color,
        "radiance divided by the density: the point scatters this times the BSDF and the cosine",
    ),
    field(
        "density",
        Float,
        "density per solid angle, the choice of the light included; 0 if no ray can find the light",
    ),
];
