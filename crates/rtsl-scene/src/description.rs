//! The description of a scene: the content of its text, before any class is looked up.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use rtsl::{Role, Span};
use rtsl_math::{PackedTransform, Transform};

use crate::reader::{EmbeddedFiles, Parameter, ReferenceKind, Values};

/// The content of a scene's text.
#[derive(Clone, Debug)]
pub struct Description {
    /// All uses of classes and settings; the other fields index this list.
    pub entities: Vec<Entity>,
    /// The place of `WorldBegin`.
    pub world_begin: Option<Span>,
    /// The camera.
    pub camera: Option<EntityId>,
    /// The film.
    pub film: Option<EntityId>,
    /// The pixel filter.
    pub filter: Option<EntityId>,
    /// The sampler.
    pub sampler: Option<EntityId>,
    /// The integrator.
    pub integrator: Option<EntityId>,
    /// The integrator of the scene's text, from which another one in its place takes over parameters.
    pub own_integrator: Option<EntityId>,
    /// Lights, in order.
    pub lights: Vec<EntityId>,
    /// Shapes outside all object definitions.
    pub shapes: Vec<ShapeUse>,
    /// Objects that `ObjectBegin` defines.
    pub objects: Vec<ObjectDefinition>,
    /// Uses of those objects by `ObjectInstance`.
    pub instances: Vec<InstanceUse>,
    /// The start and the end of motion, in the units of the shutter's times.
    pub transform_times: [f64; 2],
    /// Options of the whole scene.
    pub options: SceneOptions,
    /// Classes whose texts the reader makes, by the names that entities have for them.
    pub classes: BTreeMap<String, DescribedClass>,
    /// Files in memory, by the paths to which the names in entities resolve: the images in a glTF file.
    pub embedded: EmbeddedFiles,
    /// The places at which the text names further texts.
    pub included: BTreeMap<PathBuf, Span>,
    /// Notes for the user about what the reader added.
    pub notes: Vec<String>,
    /// Entities that the text defines with errors, which were reported: uses of them are not reported again. A camera's
    /// name is empty.
    pub failed: BTreeSet<(ReferenceKind, String)>,
}

/// A class whose text the reader makes, such as that of a material of MaterialX.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DescribedClass {
    /// The name of the class.
    pub class: String,
    /// The text of its file; empty if it could not be made, which was reported.
    pub text: String,
}

/// Settings by `Option` directives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneOptions {
    /// True if all samples of a pixel lie at its centre.
    pub disable_pixel_jitter: bool,
    /// The seed of samplers that have none.
    pub seed: Option<u64>,
}

impl Default for Description {
    /// An empty description.
    fn default() -> Self {
        Description {
            entities: Vec::new(),
            world_begin: None,
            camera: None,
            film: None,
            filter: None,
            sampler: None,
            integrator: None,
            own_integrator: None,
            lights: Vec::new(),
            shapes: Vec::new(),
            objects: Vec::new(),
            instances: Vec::new(),
            transform_times: [0.0, 1.0],
            options: SceneOptions::default(),
            classes: BTreeMap::new(),
            embedded: EmbeddedFiles::new(),
            included: BTreeMap::new(),
            notes: Vec::new(),
            failed: BTreeSet::new(),
        }
    }
}

/// The index of an entity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct EntityId(pub usize);

/// A use of a class or of a setting, with its parameters.
#[derive(Clone, Debug)]
pub struct Entity {
    /// The kind of thing it is used as.
    pub kind: EntityKind,
    /// The class, or the name of the setting.
    pub class: String,
    /// The place of the class's name.
    pub class_span: Span,
    /// The name by which other parts of the scene, and `-D`, refer to it.
    pub name: Option<String>,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// The current transform at the entity's directive: from the entity's space to the world's, for a camera from the
    /// world's to the camera's. If it moves, its value at the start.
    pub transform: Transform,
    /// If it moves, the transform at the end.
    pub end_transform: Option<Transform>,
}

impl Entity {
    /// Returns the parameter `name`, if it is given.
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// Returns the first number of the parameter `name`.
    pub fn number(&self, name: &str) -> Option<f64> {
        match &self.parameter(name)?.values {
            Values::Numbers(numbers) => numbers.first().copied(),
            Values::Booleans(_) | Values::Texts(_) | Values::Buffer(_) => None,
        }
    }

    /// Returns the first string of the parameter `name`, with the parameter.
    pub fn text(&self, name: &str) -> Option<(&str, &Parameter)> {
        let parameter = self.parameter(name)?;
        match &parameter.values {
            Values::Texts(texts) => texts.first().map(|text| (text.as_str(), parameter)),
            Values::Numbers(_) | Values::Booleans(_) | Values::Buffer(_) => None,
        }
    }
}

/// The kind of thing that an entity is used as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EntityKind {
    /// `Camera`
    Camera,
    /// `Film`
    Film,
    /// `PixelFilter`
    Filter,
    /// `Sampler`
    Sampler,
    /// `Integrator`
    Integrator,
    /// `Texture`
    Texture,
    /// `Material`, `MakeNamedMaterial`
    Material,
    /// `AreaLightSource`: a material whose `emission` lights the scene.
    AreaLight,
    /// `LightSource`
    Light,
    /// `Shape`
    Shape,
}

impl EntityKind {
    /// The word for the kind in messages.
    pub fn word(self) -> &'static str {
        match self {
            EntityKind::Camera => "camera",
            EntityKind::Film => "film",
            EntityKind::Filter => "pixel filter",
            EntityKind::Sampler => "sampler",
            EntityKind::Integrator => "integrator",
            EntityKind::Texture => "texture",
            EntityKind::Material => "material",
            EntityKind::AreaLight => "area light",
            EntityKind::Light => "light",
            EntityKind::Shape => "shape",
        }
    }

    /// The role of the kind's classes; `None` for kinds that have only names of the format.
    pub fn role(self) -> Option<Role> {
        match self {
            EntityKind::Camera => Some(Role::Camera),
            EntityKind::Shape => Some(Role::Primitive),
            EntityKind::Texture => Some(Role::Texture),
            EntityKind::Light => Some(Role::Light),
            EntityKind::Material | EntityKind::AreaLight => Some(Role::Material),
            EntityKind::Integrator => Some(Role::Integrator),
            EntityKind::Film | EntityKind::Filter | EntityKind::Sampler => None,
        }
    }
}

/// A shape with its placement and material.
#[derive(Clone, Copy, Debug)]
pub struct ShapeUse {
    /// The shape; its transform places it.
    pub shape: EntityId,
    /// Its material; `None` for the default one.
    pub material: Option<EntityId>,
    /// Its area light, whose emission it gives off.
    pub area_light: Option<EntityId>,
    /// True if its normals are flipped.
    pub reverse_orientation: bool,
}

/// Shapes that are instantiated together.
#[derive(Clone, Debug)]
pub struct ObjectDefinition {
    /// The name.
    pub name: String,
    /// The place of the definition.
    pub span: Span,
    /// Its shapes; their transforms lead to the space in which the object was defined.
    pub shapes: Vec<ShapeUse>,
}

/// An instance of an object. There may be millions of them.
#[derive(Clone, Debug)]
pub struct InstanceUse {
    /// The index of its definition.
    pub object: u32,
    /// The place of the directive.
    pub span: Span,
    /// From the definition's space to the world's; if it moves, its value at the start.
    pub transform: PackedTransform,
    /// If it moves, the transform at the end.
    pub end_transform: Option<Box<PackedTransform>>,
}
