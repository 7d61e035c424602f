//! The format's own names, and the classes of the standard library that stand for them.

use crate::math::Transform;

use super::description::EntityKind;

/// A name of the format.
#[derive(Debug)]
pub struct StandardName {
    kind: EntityKind,
    name: &'static str,
    /// The class that stands for it.
    pub class: &'static str,
    /// Parameters that the class calls otherwise: the format's name, the class's.
    parameters: &'static [(&'static str, &'static str)],
    /// What the format takes for parameters that are not given, where the class takes otherwise.
    defaults: &'static [(&'static str, &'static [f64])],
    /// The format's shape stands along z, the class's along y.
    stands_along_z: bool,
}

impl StandardName {
    /// The class and the parameters that stand for a name, if the format has it.
    pub fn find(kind: EntityKind, name: &str) -> Option<&'static StandardName> {
        NAMES.iter().find(|standard| standard.kind == kind && standard.name == name)
    }

    /// What the class calls the parameter `name`.
    pub fn parameter<'a>(&self, name: &'a str) -> &'a str {
        let renamed = self.parameters.iter().find(|(theirs, _)| *theirs == name);
        renamed.map_or(name, |(_, ours)| ours)
    }

    /// Parameters of the class that have these values where a scene gives none.
    pub fn defaults(&self) -> impl Iterator<Item = (&'static str, &'static [f64])> {
        self.defaults.iter().copied()
    }

    /// From the class's space to that of the format's shape. The reflection in it gives both the
    /// same texture coordinates.
    pub fn placement(&self) -> Transform {
        const ALONG_Z: [f64; 16] =
            [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        if self.stands_along_z { Transform::from_columns(&ALONG_Z) } else { Transform::IDENTITY }
    }

    const fn new(kind: EntityKind, name: &'static str, class: &'static str) -> Self {
        StandardName { kind, name, class, parameters: &[], defaults: &[], stands_along_z: false }
    }

    const fn renaming(self, parameters: &'static [(&'static str, &'static str)]) -> Self {
        StandardName { parameters, ..self }
    }

    const fn with_defaults(self, defaults: &'static [(&'static str, &'static [f64])]) -> Self {
        StandardName { defaults, ..self }
    }

    const fn along_z(self) -> Self {
        StandardName { stands_along_z: true, ..self }
    }
}

const NAMES: &[StandardName] = &[
    StandardName::new(EntityKind::Camera, "perspective", "Pinhole")
        .with_defaults(&[("fov", &[90.0])]),
    StandardName::new(EntityKind::Camera, "orthographic", "Orthographic"),
    StandardName::new(EntityKind::Camera, "spherical", "Environment"),
    StandardName::new(EntityKind::Shape, "sphere", "Sphere").along_z(),
    StandardName::new(EntityKind::Shape, "disk", "Disk")
        .along_z()
        .renaming(&[("innerradius", "innerRadius")]),
    StandardName::new(EntityKind::Shape, "cylinder", "Cylinder")
        .along_z()
        .renaming(&[("zmin", "yMin"), ("zmax", "yMax")]),
    StandardName::new(EntityKind::Shape, "trianglemesh", "TriangleMesh"),
    StandardName::new(EntityKind::Shape, "bilinearmesh", "BilinearMesh"),
    StandardName::new(EntityKind::Shape, "plymesh", "TriangleMesh"),
    StandardName::new(EntityKind::Shape, "gltf", "TriangleMesh"),
    StandardName::new(EntityKind::Material, "diffuse", "Lambertian")
        .renaming(&[("reflectance", "kd")]),
    StandardName::new(EntityKind::Material, "conductor", "Conductor").renaming(&[
        ("uroughness", "roughnessU"),
        ("vroughness", "roughnessV"),
        ("remaproughness", "remapRoughness"),
    ]),
    StandardName::new(EntityKind::Material, "dielectric", "Dielectric").renaming(&[
        ("uroughness", "roughnessU"),
        ("vroughness", "roughnessV"),
        ("remaproughness", "remapRoughness"),
    ]),
    StandardName::new(EntityKind::Material, "thindielectric", "ThinDielectric"),
    StandardName::new(EntityKind::Material, "coateddiffuse", "CoatedDiffuse").renaming(&[
        ("uroughness", "roughnessU"),
        ("vroughness", "roughnessV"),
        ("remaproughness", "remapRoughness"),
    ]),
    StandardName::new(EntityKind::Material, "coatedconductor", "CoatedConductor").renaming(&[
        ("conductor.eta", "eta"),
        ("conductor.k", "k"),
        ("conductor.roughness", "roughness"),
        ("conductor.uroughness", "roughnessU"),
        ("conductor.vroughness", "roughnessV"),
        ("interface.eta", "coatEta"),
        ("interface.roughness", "coatRoughness"),
        ("interface.uroughness", "coatRoughnessU"),
        ("interface.vroughness", "coatRoughnessV"),
        ("remaproughness", "remapRoughness"),
    ]),
    StandardName::new(EntityKind::Material, "diffusetransmission", "DiffuseTransmission"),
    StandardName::new(EntityKind::AreaLight, "diffuse", "Emissive").renaming(&[
        ("L", "radiance"),
        ("scale", "strength"),
        ("twosided", "twoSided"),
    ]),
    StandardName::new(EntityKind::Light, "infinite", "ConstantSky")
        .renaming(&[("L", "radiance"), ("scale", "strength")]),
    StandardName::new(EntityKind::Light, "distant", "DirectionalLight")
        .renaming(&[
            ("from", "origin"),
            ("to", "direction"),
            ("L", "irradiance"),
            ("scale", "strength"),
        ])
        .with_defaults(&[("direction", &[0.0, 0.0, 1.0])]),
    StandardName::new(EntityKind::Light, "point", "PointLight").renaming(&[
        ("from", "position"),
        ("I", "intensity"),
        ("scale", "strength"),
    ]),
    StandardName::new(EntityKind::Light, "spot", "SpotLight")
        .renaming(&[
            ("from", "position"),
            ("to", "target"),
            ("I", "intensity"),
            ("scale", "strength"),
            ("coneangle", "coneAngle"),
            ("conedeltaangle", "softness"),
        ])
        .with_defaults(&[("target", &[0.0, 0.0, 1.0])]),
    StandardName::new(EntityKind::Texture, "constant", "Constant"),
];
