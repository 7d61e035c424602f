//! The format's own names, and the classes of the standard library that stand for them.

use super::description::EntityKind;
use super::mesh_shape::MeshShape;

/// A name of the format.
struct StandardName {
    kind: EntityKind,
    name: &'static str,
    class: &'static str,
    /// Parameters that the class calls otherwise: the format's name, the class's.
    parameters: &'static [(&'static str, &'static str)],
}

/// Names whose shapes lie otherwise in their own space (`disk`, `cylinder`) are left out: they would
/// render, and wrongly.
const NAMES: &[StandardName] = &[
    StandardName {
        kind: EntityKind::Camera,
        name: "perspective",
        class: "Pinhole",
        parameters: &[],
    },
    StandardName {
        kind: EntityKind::Camera,
        name: "orthographic",
        class: "Orthographic",
        parameters: &[],
    },
    StandardName {
        kind: EntityKind::Camera,
        name: "spherical",
        class: "Environment",
        parameters: &[],
    },
    StandardName { kind: EntityKind::Shape, name: "sphere", class: "Sphere", parameters: &[] },
    StandardName {
        kind: EntityKind::Material,
        name: "diffuse",
        class: "Lambertian",
        parameters: &[("reflectance", "kd")],
    },
    StandardName {
        kind: EntityKind::Material,
        name: "dielectric",
        class: "SchlickDielectric",
        parameters: &[],
    },
    StandardName {
        kind: EntityKind::AreaLight,
        name: "diffuse",
        class: "Emissive",
        parameters: &[("L", "radiance")],
    },
    StandardName {
        kind: EntityKind::Light,
        name: "point",
        class: "PointLight",
        parameters: &[("from", "position"), ("I", "intensity")],
    },
    StandardName {
        kind: EntityKind::Light,
        name: "spot",
        class: "SpotLight",
        parameters: &[
            ("from", "position"),
            ("to", "target"),
            ("I", "intensity"),
            ("coneangle", "coneAngle"),
            ("conedeltaangle", "softness"),
        ],
    },
    StandardName {
        kind: EntityKind::Texture,
        name: "constant",
        class: "Constant",
        parameters: &[],
    },
];

/// The class that a name means, and what it calls a parameter. A name that is not the format's is
/// a class already.
pub fn class_of(kind: EntityKind, name: &str) -> &str {
    if kind == EntityKind::Shape && MeshShape::named(name).is_some() {
        return MeshShape::CLASS;
    }
    find(kind, name).map_or(name, |standard| standard.class)
}

/// What the class behind `name` calls the parameter `parameter`.
pub fn parameter_of<'a>(kind: EntityKind, name: &str, parameter: &'a str) -> &'a str {
    let renamed = find(kind, name)
        .and_then(|standard| standard.parameters.iter().find(|(theirs, _)| *theirs == parameter));
    renamed.map_or(parameter, |(_, ours)| ours)
}

fn find(kind: EntityKind, name: &str) -> Option<&'static StandardName> {
    NAMES.iter().find(|standard| standard.kind == kind && standard.name == name)
}
