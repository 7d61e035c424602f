//! The table of state variables: their roles, methods, directions and defaults.
//!
//! A [`Row`] describes one variable in one role. A variable that several roles share has one type
//! and one slot in a host's storage, a [`StateVariable`].

use std::collections::HashMap;
use std::sync::LazyLock;

use crate::{Method, Role, StateType};

/// The direction in which a state variable passes between the host and a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Set by the host before the call; read-only for the method.
    In,
    /// Set by the method; holds its default until then.
    Out,
    /// Set by the host; the method may change it.
    InOut,
}

impl Direction {
    /// `in`, `out` or `inout`.
    pub const fn name(self) -> &'static str {
        match self {
            Direction::In => "in",
            Direction::Out => "out",
            Direction::InOut => "inout",
        }
    }
}

/// The source of a part of the language.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Origin {
    /// The paper of 2007.
    Paper,
    /// An extension made by this implementation.
    Extension,
}

/// The value of an `out` variable that its method leaves unset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Default {
    /// This value in all components. It is also the value of an `in` variable that a host does not
    /// set.
    Constant(f32),
    /// A value for each component.
    Components(&'static [f32]),
    /// The value of another variable of the role, at the end of the method (or at the point of the
    /// read).
    Variable(&'static str),
    /// `color(...)` of a float variable: grey.
    Grey(&'static str),
    /// `luminance(...)` of a color variable.
    Luminance(&'static str),
    /// The first (`false`) or second (`true`) unit tangent of `rt_GeometricNormal`:
    /// `perpendicularTo(normal)`, and the cross product of the normal and that.
    Tangent(bool),
}

/// The methods for which a row's variable passes in one direction.
#[derive(Clone, Copy, Debug)]
pub struct Access {
    /// The methods; empty for all methods of the role.
    pub methods: &'static [Method],
    /// The direction.
    pub direction: Direction,
}

/// The entry of one variable in one role.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The role; `None` for a variable that all roles have.
    pub role: Option<Role>,
    /// The name, including `rt_`.
    pub name: &'static str,
    /// The type, which is the same in every role.
    pub ty: StateType,
    /// The directions by method; the first entry that names a method applies. In a method that no
    /// entry names, the variable is a local variable that starts with the default.
    pub access: &'static [Access],
    /// True if the variable holds the light's sample inside an `illuminance` body, where it is
    /// read-only.
    pub illuminance: bool,
    /// True if a method passes the variable out only if it sets it, so that hosts which do not know it need no storage
    /// for it.
    pub is_optional: bool,
    /// The value if neither host nor method sets it.
    pub default: Default,
    /// Meaning, unit and space, in one or two sentences.
    pub doc: &'static str,
    /// The paper of 2007 or this implementation.
    pub origin: Origin,
}

impl Row {
    /// The direction in `method`, or `None` if the variable is not passed to or from that method.
    pub fn direction(&self, method: Method) -> Option<Direction> {
        self.access
            .iter()
            .find(|access| access.methods.is_empty() || access.methods.contains(&method))
            .map(|access| access.direction)
    }
}

/// A distinct state variable, as hosts store it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StateVariable {
    /// The index in [`state_variables`].
    pub index: u32,
    /// The name, including `rt_`.
    pub name: &'static str,
    /// The type.
    pub ty: StateType,
    /// The index of the first component in a host's table of component arrays.
    pub first_component: u32,
}

/// The greatest number of scalars of all attributes of the objects of a scene.
pub const MAX_ATTRIBUTE_SCALARS: u32 = 32;

/// The state variable with the attributes of the hit object. As the two below, only compiled code names it: names of
/// programs have no two underscores in a row.
pub const ATTRIBUTES: &str = "rt__Attributes";
/// The state variable with the map from the world to the space of the hit object.
pub const TO_OBJECT: &str = "rt__ToObject";
/// The state variable with the map from the space of the hit object to the world.
pub const TO_WORLD: &str = "rt__ToWorld";

impl StateVariable {
    /// True if programs cannot name the variable.
    pub fn is_hidden(&self) -> bool {
        self.name.contains("__")
    }
}

/// An upper bound on the number of distinct state variables.
pub const MAX_STATE_VARIABLES: usize = ROWS.len();

/// All rows, by role.
pub fn rows() -> &'static [Row] {
    ROWS
}

/// The distinct state variables, in the order of their first row.
pub fn state_variables() -> &'static [StateVariable] {
    static VARIABLES: LazyLock<Vec<StateVariable>> = LazyLock::new(|| {
        let mut variables: Vec<StateVariable> = Vec::new();
        let mut first_component = 0;
        for row in ROWS {
            if variables.iter().all(|variable| variable.name != row.name) {
                let index = variables.len() as u32;
                variables.push(StateVariable {
                    index,
                    name: row.name,
                    ty: row.ty,
                    first_component,
                });
                first_component += row.ty.components();
            }
        }
        variables
    });
    &VARIABLES
}

/// The number of component arrays that hold all state variables.
pub fn state_component_count() -> u32 {
    state_variables().last().map_or(0, |last| last.first_component + last.ty.components())
}

/// The state variable called `name`, in any role.
pub fn lookup_state(name: &str) -> Option<&'static StateVariable> {
    static BY_NAME: LazyLock<HashMap<&str, &StateVariable>> =
        LazyLock::new(|| state_variables().iter().map(|it| (it.name, it)).collect());
    BY_NAME.get(name).copied()
}

impl Role {
    /// This role's row for the variable `name`; includes the variables common to all roles.
    pub fn row(self, name: &str) -> Option<&'static Row> {
        ROWS.iter().find(|row| row.name == name && row.role.is_none_or(|role| role == self))
    }
}

const IN: &[Access] = &[Access { methods: &[], direction: Direction::In }];
const OUT: &[Access] = &[Access { methods: &[], direction: Direction::Out }];
const INOUT: &[Access] = &[Access { methods: &[], direction: Direction::InOut }];

const fn all(
    role: Role,
    name: &'static str,
    ty: StateType,
    access: &'static [Access],
    default: Default,
    doc: &'static str,
) -> Row {
    let role = Some(role);
    let (illuminance, is_optional, origin) = (false, false, Origin::Paper);
    Row { role, name, ty, access, illuminance, is_optional, default, doc, origin }
}

const fn ours(row: Row) -> Row {
    Row { origin: Origin::Extension, ..row }
}

const fn lit(row: Row) -> Row {
    Row { illuminance: true, ..row }
}

const fn optional(row: Row) -> Row {
    Row { is_optional: true, ..row }
}

macro_rules! access {
    ($($direction:ident: $($method:ident),*;)*) => {
        &[$(Access { methods: &[$(Method::$method),*], direction: Direction::$direction }),*]
    };
}

use self::Default::{Components, Constant, Grey, Luminance, Tangent, Variable};
use crate::Role::{Camera, Integrator, Light, Material, Primitive, Texture};
use crate::StateType::{Color, Float, Floats, Vec2, Vec3};

const ZERO: Default = Constant(0.0);
const ONE: Default = Constant(1.0);
const INFINITE: Default = Constant(f32::INFINITY);

#[rustfmt::skip]
const ROWS: &[Row] = &[
    Row { role: None, name: "rt_TimeSeed", ty: Float, access: IN, illuminance: false, is_optional: false, default: ZERO,
        doc: "time within the shutter, in [0,1)", origin: Origin::Paper },

    all(Camera, "rt_ScreenCoord", Vec2, IN, ZERO, "sample position on the image, [0,1]^2, (0,0) lower left"),
    all(Camera, "rt_LensCoord", Vec2, IN, ZERO, "lens sample, [0,1)^2"),
    all(Camera, "rt_du", Float, IN, ZERO, "width of a pixel in `rt_ScreenCoord`"),
    all(Camera, "rt_dv", Float, IN, ZERO, "height of a pixel in `rt_ScreenCoord`"),
    all(Camera, "rt_RayOrigin", Vec3, OUT, ZERO, "origin of the ray, in camera space"),
    all(Camera, "rt_RayDirection", Vec3, OUT, Components(&[0.0, 0.0, 1.0]), "direction of the ray, in camera space; need not be unit length"),
    all(Camera, "rt_InverseRayDirection", Vec3, IN, ZERO, "1/rt_RayDirection, componentwise; the host computes it after the method"),
    all(Camera, "rt_Epsilon", Float, INOUT, ZERO, "distance beyond which hits count, 0 unless the scene sets `epsilon`"),
    all(Camera, "rt_HitDistance", Float, INOUT, INFINITE, "greatest distance at which a hit counts (far clip)"),
    ours(all(Camera, "rt_SampleColor", Color, OUT, ONE, "weight of the ray (vignetting)")),

    all(Primitive, "rt_RayOrigin", Vec3, IN, ZERO, "origin of the ray, in the primitive's space; in `generateSample` and `samplePDF` the point to be lit"),
    all(Primitive, "rt_RayDirection", Vec3, IN, Components(&[0.0, 0.0, 1.0]), "direction of the ray, in the primitive's space; need not be unit length"),
    all(Primitive, "rt_InverseRayDirection", Vec3, IN, ZERO, "1/rt_RayDirection, componentwise"),
    all(Primitive, "rt_Epsilon", Float, IN, ZERO, "distance beyond which hits count"),
    all(Primitive, "rt_HitDistance", Float, access![InOut: Intersect; In: ComputeNormal, ComputeTextureCoordinates, ComputeDerivatives;], INFINITE,
        "parameter t of the hit, in units of the direction's length; when `intersect` begins, the greatest that counts"),
    all(Primitive, "rt_HitPoint", Vec3, access![InOut: ComputeNormal; In: ComputeTextureCoordinates, ComputeDerivatives, SamplePdf; Out: GenerateSample;], ZERO,
        "point on the surface, in the primitive's space; `computeNormal` may move it onto the surface"),
    all(Primitive, "rt_BoundMin", Vec3, access![Out: ComputeBounds;], Constant(f32::NEG_INFINITY), "least corner of the box"),
    all(Primitive, "rt_BoundMax", Vec3, access![Out: ComputeBounds;], INFINITE, "greatest corner of the box"),
    all(Primitive, "rt_GeometricNormal", Vec3, access![Out: ComputeNormal, GenerateSample; In: ComputeTextureCoordinates, ComputeDerivatives, SamplePdf;],
        Components(&[0.0, 0.0, 1.0]), "normal of the surface, outward, any length; the host normalises"),
    all(Primitive, "rt_ShadingNormal", Vec3, access![Out: ComputeNormal; In: ComputeTextureCoordinates, ComputeDerivatives;],
        Variable("rt_GeometricNormal"), "normal for shading, outward, any length; the host normalises"),
    all(Primitive, "rt_TextureUV", Vec2, access![Out: ComputeTextureCoordinates; In: ComputeDerivatives;], ZERO, "surface parameters"),
    all(Primitive, "rt_TextureUVW", Vec3, access![Out: ComputeTextureCoordinates; In: ComputeDerivatives;], Variable("rt_HitPoint"), "coordinates for solid textures"),
    all(Primitive, "rt_dPdu", Vec3, access![Out: ComputeDerivatives;], Tangent(false), "derivative of the surface point by u"),
    all(Primitive, "rt_dPdv", Vec3, access![Out: ComputeDerivatives;], Tangent(true), "derivative of the surface point by v"),
    all(Primitive, "rt_dsdu", Float, access![Out: ComputeDerivatives;], ONE, "derivative of the first texture coordinate by u"),
    all(Primitive, "rt_dsdv", Float, access![Out: ComputeDerivatives;], ZERO, "derivative of the first texture coordinate by v"),
    ours(all(Primitive, "rt_dtdu", Float, access![Out: ComputeDerivatives;], ZERO, "derivative of the second texture coordinate by u")),
    ours(all(Primitive, "rt_dtdv", Float, access![Out: ComputeDerivatives;], ONE, "derivative of the second texture coordinate by v")),
    all(Primitive, "rt_PDF", Float, access![Out: GenerateSample, SamplePdf;], ZERO, "density per unit solid angle, seen from `rt_RayOrigin`"),

    all(Texture, "rt_TextureUV", Vec2, IN, ZERO, "position of the lookup, in surface parameters"),
    all(Texture, "rt_TextureUVW", Vec3, IN, ZERO, "position of the lookup, in space"),
    all(Texture, "rt_du", Float, IN, ZERO, "width of the filter in surface parameters, along u"),
    all(Texture, "rt_dv", Float, IN, ZERO, "width of the filter in surface parameters, along v"),
    all(Texture, "rt_dsdu", Float, IN, ONE, "derivative of the first texture coordinate by u"),
    all(Texture, "rt_dtdu", Float, IN, ZERO, "derivative of the second texture coordinate by u"),
    all(Texture, "rt_dsdv", Float, IN, ZERO, "derivative of the first texture coordinate by v"),
    all(Texture, "rt_dtdv", Float, IN, ONE, "derivative of the second texture coordinate by v"),
    all(Texture, "rt_dPdu", Vec3, IN, Components(&[1.0, 0.0, 0.0]), "derivative of the surface point by u, in world space"),
    all(Texture, "rt_dPdv", Vec3, IN, Components(&[0.0, 1.0, 0.0]), "derivative of the surface point by v, in world space"),
    ours(all(Texture, "rt_HitPoint", Vec3, IN, ZERO, "the point, in world space")),
    ours(all(Texture, "rt_ShadingNormal", Vec3, IN, Components(&[0.0, 0.0, 1.0]), "normal for shading at the caller's hit, unit length, outward")),
    ours(all(Texture, "rt_GeometricNormal", Vec3, IN, Components(&[0.0, 0.0, 1.0]), "normal of the surface there, unit length, outward")),
    ours(all(Texture, "rt_RayDirection", Vec3, IN, Components(&[0.0, 0.0, 1.0]), "direction of the caller's ray, towards the surface; need not be unit length")),
    all(Texture, "rt_TextureColor", Color, OUT, Grey("rt_FloatTextureValue"), "the texture's colour"),
    all(Texture, "rt_FloatTextureValue", Float, OUT, Luminance("rt_TextureColor"), "the texture's value; 0 where neither it nor the colour is set"),

    all(Material, "rt_RayOrigin", Vec3, IN, ZERO, "origin of the ray, in world space"),
    all(Material, "rt_RayDirection", Vec3, IN, Components(&[0.0, 0.0, 1.0]), "direction of the ray, towards the surface; need not be unit length"),
    all(Material, "rt_InverseRayDirection", Vec3, IN, ZERO, "1/rt_RayDirection, componentwise"),
    all(Material, "rt_HitPoint", Vec3, IN, ZERO, "the point, in world space"),
    all(Material, "rt_HitDistance", Float, IN, INFINITE, "parameter t of the hit, in units of the direction's length"),
    all(Material, "rt_Epsilon", Float, IN, ZERO, "distance beyond which hits count"),
    all(Material, "rt_ShadingNormal", Vec3, IN, Components(&[0.0, 0.0, 1.0]), "normal for shading, unit length, outward"),
    all(Material, "rt_GeometricNormal", Vec3, IN, Components(&[0.0, 0.0, 1.0]), "normal of the surface, unit length, outward"),
    all(Material, "rt_TextureUV", Vec2, IN, ZERO, "surface parameters"),
    ours(all(Material, "rt_TextureUVW", Vec3, IN, ZERO, "coordinates for solid textures")),
    all(Material, "rt_dPdu", Vec3, IN, Components(&[1.0, 0.0, 0.0]), "derivative of the surface point by u, in world space"),
    all(Material, "rt_dPdv", Vec3, IN, Components(&[0.0, 1.0, 0.0]), "derivative of the surface point by v, in world space"),
    all(Material, "rt_du", Float, IN, ZERO, "width of the filter in surface parameters, along u"),
    all(Material, "rt_dv", Float, IN, ZERO, "width of the filter in surface parameters, along v"),
    lit(all(Material, "rt_LightDirection", Vec3, access![In: Bsdf, EvaluatePdf; Out: SampleBsdf;], Components(&[0.0, 0.0, 1.0]),
        "unit vector away from the surface, towards the light")),
    lit(all(Material, "rt_LightDistance", Float, &[], INFINITE, "distance to the light")),
    lit(all(Material, "rt_LightColor", Color, &[], ZERO, "the light's sample")),
    all(Material, "rt_BSDFSeed", Vec3, access![In: SampleBsdf;], ZERO, "uniform in [0,1)^3; z picks the lobe"),
    all(Material, "rt_BSDFValue", Color, access![Out: Bsdf, SampleBsdf;], ZERO, "the scattering function, without the cosine"),
    lit(all(Material, "rt_PDF", Float, access![Out: SampleBsdf, EvaluatePdf;], ZERO,
        "density per solid angle; 0 from `sampleBSDF` means a delta, whose value is the whole Monte Carlo weight")),
    all(Material, "rt_EmissionColor", Color, access![Out: Emission;], ZERO, "radiance leaving towards the ray's origin"),
    all(Material, "rt_SampleColor", Color, access![Out: Shade;], ZERO, "radiance returned to the ray"),

    all(Light, "rt_HitPoint", Vec3, access![In: Illumination, EvaluatePdf;], ZERO, "the point to be lit, in world space"),
    all(Light, "rt_GeometricNormal", Vec3, access![In: Illumination, EvaluatePdf;], Components(&[0.0, 0.0, 1.0]), "normal of the surface to be lit, unit length, on the side that is seen"),
    all(Light, "rt_ShadingNormal", Vec3, access![In: Illumination, EvaluatePdf;], Components(&[0.0, 0.0, 1.0]), "normal for shading there, unit length, on that side"),
    all(Light, "rt_LightDirection", Vec3, access![Out: Illumination; In: EvaluatePdf;], Components(&[0.0, 0.0, 1.0]), "unit vector towards the light"),
    ours(all(Light, "rt_LightDistance", Float, access![Out: Illumination;], INFINITE, "distance to the light")),
    ours(all(Light, "rt_LightColor", Color, access![Out: Illumination;], ZERO,
        "radiance where `rt_PDF` > 0; else the whole contribution (a delta light: intensity over distance squared)")),
    ours(all(Light, "rt_PDF", Float, access![Out: Illumination, EvaluatePdf;], ZERO, "density per solid angle; 0 for a delta")),
    ours(all(Light, "rt_RayOrigin", Vec3, access![In: Emission;], ZERO, "origin of a ray that leaves the scene")),
    ours(all(Light, "rt_RayDirection", Vec3, access![In: Emission;], Components(&[0.0, 0.0, 1.0]), "direction of a ray that leaves the scene")),
    ours(all(Light, "rt_EmissionColor", Color, access![Out: Emission;], ZERO, "radiance that such a ray brings back")),

    // Variables that came later are at the end: the components of the others stay where they were.
    optional(ours(all(Primitive, "rt_SurfaceOffset", Float, access![Out: ComputeNormal;], ZERO,
        "least distance along the geometric normal at which rays that leave the surface begin, in the primitive's space; where `rt_HitPoint` is set, too, the error of `intersect` and of that point"))),

    ours(all(Integrator, "rt_RayOrigin", Vec3, IN, ZERO, "origin of the ray, in world space")),
    ours(all(Integrator, "rt_RayDirection", Vec3, IN, Components(&[0.0, 0.0, 1.0]), "direction of the ray, in world space; need not be unit length")),
    ours(all(Integrator, "rt_Epsilon", Float, IN, ZERO, "distance beyond which hits count")),
    ours(all(Integrator, "rt_HitDistance", Float, IN, INFINITE, "greatest distance at which a hit counts")),
    ours(all(Integrator, "rt_SampleColor", Color, OUT, ZERO, "radiance that returns to the ray's origin, without contributions")),
    ours(all(Integrator, "rt_RayWidth", Float, IN, ZERO, "width of the ray's footprint at its origin")),
    ours(all(Integrator, "rt_RaySpread", Float, IN, ZERO, "growth of the footprint's width with each length of the direction")),
    ours(all(Integrator, "rt_RayDepth", Float, IN, ZERO, "number of surfaces before: 0 for a camera's ray, 1 for one that a material's `shade` traces there")),
    ours(all(Material, "rt_RayDepth", Float, access![In: Shade, Bsdf, SampleBsdf, EvaluatePdf;], ZERO, "number of surfaces that the light's path has met before: 0 for what a camera sees")),
    ours(all(Material, "rt_RelativeIndex", Float, access![Out: SampleBsdf;], ONE,
        "index of refraction on the side of `rt_LightDirection`, over that on the ray's side, whose square divides `rt_BSDFValue`; 1 for what is not refracted")),
    ours(all(Material, "rt_Regularization", Float, access![In: Shade, Bsdf, SampleBsdf, EvaluatePdf;], ZERO,
        "width of highlights up to which narrower ones are to be widened, by `regularized`; 0 for none")),
    ours(all(Integrator, "rt_RayType", Float, IN, ZERO, "type of the ray: `rt_CAMERA_RAY`, or `rt_TRACED_RAY` for one that `trace` traces")),
    ours(all(Material, "rt_RayType", Float, access![In: Shade, Bsdf, SampleBsdf, EvaluatePdf;], ZERO,
        "type of the ray: `rt_CAMERA_RAY`, `rt_SCATTERED_RAY` or `rt_TRACED_RAY`")),

    ours(all(Material, "rt_ObjectNumber", Float, IN, ZERO, OBJECT_NUMBER)),
    ours(all(Texture, "rt_ObjectNumber", Float, IN, ZERO, OBJECT_NUMBER)),
    ours(all(Material, "rt_InstanceNumber", Float, IN, ZERO, INSTANCE_NUMBER)),
    ours(all(Texture, "rt_InstanceNumber", Float, IN, ZERO, INSTANCE_NUMBER)),
    ours(all(Material, "rt_ElementNumber", Float, IN, ZERO, ELEMENT_NUMBER)),
    ours(all(Texture, "rt_ElementNumber", Float, IN, ZERO, ELEMENT_NUMBER)),
    ours(all(Material, "rt_Presence", Float, access![Out: Presence;], ONE, "part of the surface that is there: the probability that a ray meets it")),

    optional(ours(all(Primitive, ATTRIBUTES, Floats(MAX_ATTRIBUTE_SCALARS), access![Out: ComputeTextureCoordinates;], ZERO, ATTRIBUTES_DOC))),
    ours(all(Material, ATTRIBUTES, Floats(MAX_ATTRIBUTE_SCALARS), IN, ZERO, ATTRIBUTES_DOC)),
    ours(all(Texture, ATTRIBUTES, Floats(MAX_ATTRIBUTE_SCALARS), IN, ZERO, ATTRIBUTES_DOC)),
    ours(all(Material, TO_OBJECT, Floats(12), IN, Components(&IDENTITY), TO_OBJECT_DOC)),
    ours(all(Texture, TO_OBJECT, Floats(12), IN, Components(&IDENTITY), TO_OBJECT_DOC)),
    ours(all(Material, TO_WORLD, Floats(12), IN, Components(&IDENTITY), TO_WORLD_DOC)),
    ours(all(Texture, TO_WORLD, Floats(12), IN, Components(&IDENTITY), TO_WORLD_DOC)),
];

const OBJECT_NUMBER: &str = "index of the object in the scene";
const INSTANCE_NUMBER: &str =
    "index of the instance that places the object; -1 for objects that none places";
const ELEMENT_NUMBER: &str =
    "index of the object's element, such as the triangle of a mesh; above 2^24 rounded";
const ATTRIBUTES_DOC: &str =
    "attributes of the object that the ray hit, in the order of the scene's list";
const TO_OBJECT_DOC: &str = "map of points from the world to the object's space: the images of the axes, then that of the origin";
const TO_WORLD_DOC: &str = "map of points from the object's space to the world, likewise";
const IDENTITY: [f32; 12] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variable_has_one_type_in_every_role() {
        for row in rows() {
            assert_eq!(
                lookup_state(row.name).map(|variable| variable.ty),
                Some(row.ty),
                "{}",
                row.name
            );
        }
    }

    #[test]
    fn a_role_has_each_variable_once() {
        for (index, row) in rows().iter().enumerate() {
            let again = rows()[index + 1..]
                .iter()
                .any(|other| other.role == row.role && other.name == row.name);
            assert!(!again, "{:?} has {} twice", row.role, row.name);
        }
    }

    #[test]
    fn defaults_name_variables_of_the_same_role() {
        for row in rows() {
            if let Variable(other) | Grey(other) | Luminance(other) = row.default {
                assert!(row.role.unwrap().row(other).is_some(), "{}", row.name);
            }
        }
    }

    #[test]
    fn access_names_methods_of_the_role() {
        for row in rows() {
            for method in row.access.iter().flat_map(|access| access.methods) {
                assert!(method.roles().contains(&row.role.unwrap()), "{} {method:?}", row.name);
            }
        }
    }
}
