//! The pbrt names of the format, and the classes of the standard library that implement them.

use rtsl_math::Transform;

use super::description::{Entity, EntityKind};
use super::parallelogram::Parallelogram;

/// A pbrt name.
#[derive(Debug)]
pub struct StandardName {
    kind: EntityKind,
    name: &'static str,
    /// The class that implements it.
    pub class: &'static str,
    /// Parameters with another name in the class: the format's name, the class's name.
    parameters: &'static [(&'static str, &'static str)],
    /// The format's default values of parameters, if the class has others.
    defaults: &'static [(&'static str, &'static [f64])],
    /// Parameters that have no effect, besides those of all entities of the kind.
    without_effect: &'static [&'static str],
    /// True if the format's shape is aligned with z and the class's with y.
    stands_along_z: bool,
    /// True if one parameter is the file of an image.
    reads_image: bool,
    /// True if the class is only a substitute that looks different.
    replaced: bool,
}

impl StandardName {
    /// The implementation of an entity's class, if it is a pbrt name.
    pub fn of(entity: &Entity) -> Option<&'static StandardName> {
        let has_image = entity.parameters.iter().any(|parameter| parameter.name == "filename");
        let is_sky = entity.kind == EntityKind::Light && entity.class == "infinite";
        if is_sky && has_image {
            return Some(&IMAGE_SKY);
        }
        if Parallelogram::of(entity).is_some() {
            return Some(&PARALLELOGRAM);
        }
        NAMES.iter().find(|standard| standard.kind == entity.kind && standard.name == entity.class)
    }

    /// True if a parameter of the format has no effect here.
    pub fn has_no_effect(&self, name: &str) -> bool {
        let of_all: &[&str] = match self.kind {
            EntityKind::Material => &["displacement", "normalmap"],
            EntityKind::Shape => &["shadowalpha", "displacement", "displacement.edgelength"],
            EntityKind::Light => &["portal"],
            EntityKind::AreaLight => &["power", "filename"],
            EntityKind::Texture => &["mapping", "v1", "v2"],
            EntityKind::Camera
            | EntityKind::Film
            | EntityKind::Filter
            | EntityKind::Sampler
            | EntityKind::Integrator => &[],
        };
        self.replaced || of_all.contains(&name) || self.without_effect.contains(&name)
    }

    /// True if one parameter is the file of an image.
    pub fn reads_image(&self) -> bool {
        self.reads_image
    }

    /// True if the class is only a substitute.
    pub fn is_replaced(&self) -> bool {
        self.replaced
    }

    /// True if entities of this name are ignored because no class implements them.
    pub fn is_left_out(entity: &Entity) -> bool {
        LEFT_OUT.iter().any(|(kind, name)| *kind == entity.kind && *name == entity.class)
    }

    /// Returns the class's name of the parameter `name`.
    pub fn parameter<'a>(&self, name: &'a str) -> &'a str {
        let renamed = self.parameters.iter().find(|(theirs, _)| *theirs == name);
        renamed.map_or(name, |(_, ours)| ours)
    }

    /// Returns parameters of the class that have these values if the scene gives none.
    pub fn defaults(&self) -> impl Iterator<Item = (&'static str, &'static [f64])> {
        self.defaults.iter().copied()
    }

    /// Returns the transform from the class's space to that of the format's shape. It includes a reflection, so that
    /// both have the same texture coordinates.
    pub fn placement(&self) -> Transform {
        const ALONG_Z: [f64; 16] =
            [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        if self.stands_along_z { Transform::from_columns(&ALONG_Z) } else { Transform::IDENTITY }
    }

    const fn new(kind: EntityKind, name: &'static str, class: &'static str) -> Self {
        StandardName {
            kind,
            name,
            class,
            parameters: &[],
            defaults: &[],
            without_effect: &[],
            stands_along_z: false,
            reads_image: false,
            replaced: false,
        }
    }

    const fn renaming(self, parameters: &'static [(&'static str, &'static str)]) -> Self {
        StandardName { parameters, ..self }
    }

    const fn with_defaults(self, defaults: &'static [(&'static str, &'static [f64])]) -> Self {
        StandardName { defaults, ..self }
    }

    const fn without(self, without_effect: &'static [&'static str]) -> Self {
        StandardName { without_effect, ..self }
    }

    const fn with_image(self) -> Self {
        StandardName { reads_image: true, ..self }
    }

    /// A name whose class is a substitute that looks different.
    const fn replacing(kind: EntityKind, name: &'static str, class: &'static str) -> Self {
        StandardName { replaced: true, ..StandardName::new(kind, name, class) }
    }

    const fn along_z(self) -> Self {
        StandardName { stands_along_z: true, ..self }
    }
}

/// `infinite` with the file of an image.
static IMAGE_SKY: StandardName = StandardName::new(EntityKind::Light, "infinite", "ImageSky")
    .renaming(&[("scale", "strength")])
    .with_image();

/// `bilinearmesh` with a single parallelogram.
static PARALLELOGRAM: StandardName =
    StandardName::new(EntityKind::Shape, "bilinearmesh", "Parallelogram");

/// Names that no class implements; `interface` and its former names are boundaries of media and invisible.
const LEFT_OUT: &[(EntityKind, &str)] = &[
    (EntityKind::Shape, "curve"),
    (EntityKind::Shape, "loopsubdiv"),
    (EntityKind::Light, "goniometric"),
    (EntityKind::Light, "projection"),
    (EntityKind::Material, "interface"),
    (EntityKind::Material, "none"),
    (EntityKind::Material, ""),
];

/// The value of textures that are not supported.
const HALF: &[(&str, &[f64])] = &[("value", &[0.5])];

const NAMES: &[StandardName] = &[
    StandardName::new(EntityKind::Camera, "perspective", "Pinhole")
        .with_defaults(&[("fov", &[90.0])]),
    StandardName::new(EntityKind::Camera, "orthographic", "Orthographic"),
    StandardName::new(EntityKind::Camera, "spherical", "Environment"),
    StandardName::new(EntityKind::Shape, "sphere", "Sphere")
        .along_z()
        .without(&["zmin", "zmax", "phimax"]),
    StandardName::new(EntityKind::Shape, "disk", "Disk")
        .along_z()
        .renaming(&[("innerradius", "innerRadius")])
        .without(&["phimax"]),
    StandardName::new(EntityKind::Shape, "cylinder", "Cylinder")
        .along_z()
        .renaming(&[("zmin", "yMin"), ("zmax", "yMax")])
        .without(&["phimax"]),
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
    StandardName::new(EntityKind::Material, "coateddiffuse", "CoatedDiffuse")
        .renaming(&[
            ("uroughness", "roughnessU"),
            ("vroughness", "roughnessV"),
            ("remaproughness", "remapRoughness"),
        ])
        .without(&["thickness", "albedo", "g", "maxdepth", "nsamples"]),
    StandardName::new(EntityKind::Material, "coatedconductor", "CoatedConductor")
        .renaming(&[
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
        ])
        .without(&["thickness", "albedo", "g", "maxdepth", "nsamples"]),
    StandardName::new(EntityKind::Material, "diffusetransmission", "DiffuseTransmission"),
    StandardName::new(EntityKind::Material, "mix", "Mix"),
    StandardName::replacing(EntityKind::Material, "hair", "Lambertian"),
    StandardName::replacing(EntityKind::Material, "measured", "Lambertian"),
    StandardName::replacing(EntityKind::Material, "subsurface", "Lambertian"),
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
    StandardName::new(EntityKind::Texture, "imagemap", "Image").with_image(),
    StandardName::new(EntityKind::Texture, "scale", "Scale")
        .renaming(&[("tex", "texture"), ("scale", "factor")]),
    StandardName::new(EntityKind::Texture, "mix", "MixTexture")
        .renaming(&[("tex1", "first"), ("tex2", "second")]),
    StandardName::new(EntityKind::Texture, "checkerboard", "Checkerboard")
        .renaming(&[("tex1", "even"), ("tex2", "odd")])
        .without(&["dimension", "udelta", "vdelta"]),
    StandardName::new(EntityKind::Texture, "fbm", "Fbm").renaming(&[("roughness", "gain")]),
    StandardName::new(EntityKind::Texture, "marble", "Marble").without(&["roughness", "variation"]),
    StandardName::replacing(EntityKind::Texture, "bilerp", "Constant").with_defaults(HALF),
    StandardName::replacing(EntityKind::Texture, "directionmix", "Constant").with_defaults(HALF),
    StandardName::replacing(EntityKind::Texture, "dots", "Constant").with_defaults(HALF),
    StandardName::replacing(EntityKind::Texture, "ptex", "Constant").with_defaults(HALF),
    StandardName::replacing(EntityKind::Texture, "windy", "Constant").with_defaults(HALF),
    StandardName::replacing(EntityKind::Texture, "wrinkled", "Constant").with_defaults(HALF),
];
