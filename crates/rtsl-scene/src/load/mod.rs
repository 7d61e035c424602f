//! Loading: from the description of a scene to instances of classes.

mod attributes;
mod emitter;
mod files;
mod images;
mod integrator;
mod made;
mod meshes;
mod reachable;
mod relief;
mod resolver;
mod shared_arrays;
mod standard;
mod warnings;

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

use rtsl::{
    Class, Diagnostic, Diagnostics, Instance, Role, Value, diagnostic_codes as codes, most_similar,
};
use rtsl_math::Transform;

use crate::arguments::{Resolve, argument, texture};
use crate::attributes::{GivenAttribute, WantedAttributes};
use crate::classes::{Classes, Found};
use crate::description::{Description, Entity, EntityId, EntityKind, ShapeUse};
use crate::gltf::FileAttributes;
use crate::parts::SceneParts;
use crate::pbrt::{Images, MadeMesh, MeshShape, NamedEntity, PbrtName, translated};
use crate::presence::{PRESENCE_CLASS, PRESENCE_TEXT, Presences};
use crate::reader::{Parameter, ReferenceKind, SceneFiles, Values};
use crate::scene::{PlacedGroup, PlacedLight, Scene, SceneObject};
use crate::settings::{SETTINGS_OF_INTEGRATORS, Settings};
use crate::shutter::{SHUTTER, Shutter};
use made::Slot;
pub use made::{Earlier, Kept, Made};
use resolver::Resolver;
use shared_arrays::SharedArrays;

/// The entities from which the parts of a scene were made, by the indices of the parts.
#[derive(Clone, Debug)]
pub struct Origins {
    /// The camera's.
    pub camera: EntityId,
    /// The materials'; `None` for the default material.
    pub materials: Vec<Option<EntityId>>,
    /// The lights'.
    pub lights: Vec<EntityId>,
    /// The objects' shapes.
    pub objects: Vec<EntityId>,
}

/// The parameter of the class of textures given by numbers.
const CONSTANT_COLOR: &str = "value";

/// The class of textures given by images.
const IMAGE_TEXTURE: &str = "Image";

/// The alpha parameter of every shape, unless its class declares one of this name.
const ALPHA: &str = "alpha";

/// The greatest depth of references to instances that contain references.
const MAX_REFERENCE_DEPTH: usize = 64;

/// The entities that can be referred to, by kind and name.
pub type Names = BTreeMap<(ReferenceKind, String), EntityId>;

pub fn names_of(description: &Description) -> Names {
    let named = description.entities.iter().enumerate().filter_map(|(index, entity)| {
        let kind = match entity.kind {
            EntityKind::Camera => ReferenceKind::Camera,
            EntityKind::Texture => ReferenceKind::Texture,
            EntityKind::Material | EntityKind::AreaLight => ReferenceKind::Material,
            EntityKind::Light => ReferenceKind::Light,
            EntityKind::Shape => ReferenceKind::Primitive,
            EntityKind::Film
            | EntityKind::Filter
            | EntityKind::Sampler
            | EntityKind::Integrator => return None,
        };
        Some(((kind, entity.name.clone()?), EntityId(index)))
    });
    // Of several entities with one name the first counts.
    named.rev().collect()
}

/// The arguments of an instance, by the names of parameters, and the entities that they depend on.
#[derive(Default)]
struct Arguments {
    values: Vec<(String, Value)>,
    named: Vec<(EntityId, Arc<Instance>)>,
    standard: Vec<Arc<Class>>,
    /// The attributes that a file gives a shape.
    attributes: Vec<GivenAttribute>,
}

/// Makes the instances of a scene.
pub struct Loader<'a, 'f> {
    files: SceneFiles<'a>,
    description: &'a Description,
    classes: &'a mut Classes<'f>,
    diagnostics: &'a mut Diagnostics,
    earlier: Earlier<'a>,
    instances: Vec<Slot>,
    names: Names,
    /// Names that nothing in the scene has, each of which is reported once.
    unknown: BTreeSet<(ReferenceKind, String)>,
    depth: usize,
    /// Messages about parameters without effect, each of which is reported once.
    said: BTreeSet<String>,
    images: Images,
    /// The meshes of files, by path.
    meshes: BTreeMap<PathBuf, MadeMesh>,
    /// The arrays of shapes.
    arrays: SharedArrays,
    /// The entities that are checked although nothing uses them, whose files are not read.
    unused: Option<Vec<EntityId>>,
    /// True if such a file was not read.
    skipped_files: bool,
    /// The attributes that shaders of the scene read.
    wanted: Arc<WantedAttributes>,
    /// Those that a glTF file gives its shapes.
    file_attributes: Arc<FileAttributes>,
    /// The alpha textures of materials with holes.
    presences: Presences,
}

impl<'a, 'f> Loader<'a, 'f> {
    /// Prepares to make the instances of `description`, or to reuse those of `earlier` that did not change.
    pub fn new(
        files: SceneFiles<'a>,
        description: &'a Description,
        classes: &'a mut Classes<'f>,
        earlier: Earlier<'a>,
        diagnostics: &'a mut Diagnostics,
    ) -> Self {
        Loader {
            files,
            description,
            classes,
            diagnostics,
            earlier,
            instances: vec![Slot::Empty; description.entities.len()],
            names: names_of(description),
            unknown: BTreeSet::new(),
            depth: 0,
            said: BTreeSet::new(),
            images: Images::default(),
            meshes: BTreeMap::new(),
            arrays: SharedArrays::default(),
            unused: None,
            skipped_files: false,
            wanted: Arc::default(),
            file_attributes: earlier.attributes.clone(),
            presences: earlier.presences.clone(),
        }
    }

    /// Returns what a later load can use again.
    pub fn into_kept(self) -> Kept {
        let made = self.instances.into_iter().map(|slot| match slot {
            Slot::Made(made) => Some(made),
            Slot::Empty | Slot::Open | Slot::Failed => None,
        });
        Kept { made: made.collect(), attributes: self.file_attributes, presences: self.presences }
    }

    /// Makes the scene; returns `None` if an error was reported.
    pub fn scene(&mut self, settings: Settings) -> Option<(Scene, Origins)> {
        let description = self.description;
        let Some(camera_entity) = description.camera else {
            // If nothing or no camera could be read, an error was reported already.
            if !self.diagnostics.has_errors() {
                self.diagnostics.push(
                    Diagnostic::new(codes::MISPLACED_DIRECTIVE, "the scene has no `WorldBegin`")
                        .help(
                            "camera and settings are given before it, shapes and lights after it",
                        ),
                );
            }
            return None;
        };
        let mut parts = SceneParts::default();
        match Shutter::read(description, &description.entities[camera_entity.0]) {
            Ok(shutter) => parts.shutter = shutter,
            Err(diagnostic) => self.diagnostics.push(*diagnostic),
        }
        if !self.find_files() {
            self.check_without_files();
            return None;
        }
        self.find_wanted_attributes();
        self.read_file_attributes();
        self.read_images();
        self.read_meshes();
        let camera = self.instance(camera_entity);
        let integrator = match description.integrator {
            Some(entity) => self.integrator(entity),
            None => Ok(None),
        };
        let path_tracer = self.path_tracer(&settings);
        let whitted = self.whitted();
        let (camera_to_world, camera_motion) =
            parts.place_camera(&description.entities[camera_entity.0])?;
        let world = self.objects(&description.shapes, &mut parts);
        let groups =
            description.objects.iter().map(|object| self.objects(&object.shapes, &mut parts));
        let groups: Vec<Vec<u32>> = groups.collect();
        let lights = self.lights(&mut parts);
        self.check_unused_entities();
        let instances = description.instances.iter().map(|it| {
            let end = it.end_transform.as_deref().copied().map(Transform::from);
            let (transform, motion) = parts.shutter.place(it.transform.into(), end);
            PlacedGroup { group: it.object, transform: transform.into(), motion }
        });
        let instances = instances.collect();
        let mut scene = Scene {
            settings,
            integrator: integrator.ok()?,
            path_tracer: path_tracer?,
            whitted: whitted?,
            camera: camera?,
            camera_to_world,
            camera_motion,
            materials: parts.materials,
            lights,
            ambient: parts.ambient,
            objects: parts.objects,
            world,
            groups,
            instances,
        };
        self.add_presences(&mut scene);
        self.share_attributes(&mut scene)?;
        let origins = Origins {
            camera: camera_entity,
            materials: parts.material_origins,
            lights: parts.light_origins,
            objects: parts.object_origins,
        };
        Some((scene, origins))
    }

    fn objects(&mut self, shapes: &[ShapeUse], parts: &mut SceneParts) -> Vec<u32> {
        let mut indices = Vec::with_capacity(shapes.len());
        for shape in shapes {
            let primitive = self.instance(shape.shape);
            let material = self.material(shape.material, parts);
            let entity = &self.description.entities[shape.shape.0];
            let placement = self.pbrt_name(entity).map(PbrtName::placement);
            let placement = placement.unwrap_or(Transform::IDENTITY);
            let (transform, motion) = parts.place_entity(entity, placement);
            let emitter = shape
                .area_light
                .map(|light| self.emitter(light, primitive.as_deref(), transform, parts));
            let (Some(primitive), Some(material)) = (primitive, material) else { continue };
            let emitter = match emitter {
                Some(None) => continue,
                Some(emitter) => emitter,
                None => None,
            };
            indices.push(parts.objects.len() as u32);
            parts.object_origins.push(shape.shape);
            parts.objects.push(SceneObject {
                // The instance itself is the first element; a shape with one element is treated like any other object.
                elements: primitive.element_count().filter(|count| *count != 1),
                primitive,
                transform,
                motion,
                material,
                emitter,
                reverse_orientation: shape.reverse_orientation,
                alpha: self.alpha(shape.shape),
            });
        }
        indices
    }

    /// Gives shapes the alpha that their materials have.
    fn add_presences(&mut self, scene: &mut Scene) {
        if Presences::are_in(scene)
            && let Some(class) = self.classes.of_text(PRESENCE_TEXT, PRESENCE_CLASS, None)
        {
            self.presences.add_to(scene, &class);
        }
    }

    /// The alpha texture of a shape whose instance was made.
    fn alpha(&self, shape: EntityId) -> Option<Arc<Instance>> {
        match &self.instances[shape.0] {
            Slot::Made(made) => made.alpha.clone(),
            Slot::Empty | Slot::Open | Slot::Failed => None,
        }
    }

    /// Returns the index of a material among those of the scene.
    fn material(&mut self, material: Option<EntityId>, parts: &mut SceneParts) -> Option<u32> {
        if let Some(index) = parts.material_indices.get(&material) {
            return *index;
        }
        let instance = match material {
            Some(material) => self.instance(material),
            None => self.default_material(),
        };
        let index = instance.map(|instance| {
            parts.materials.push(instance);
            parts.material_origins.push(material);
            parts.materials.len() as u32 - 1
        });
        parts.material_indices.insert(material, index);
        index
    }

    fn lights(&mut self, parts: &mut SceneParts) -> Vec<PlacedLight> {
        let mut lights = Vec::new();
        let used = self.lights_of_lights();
        for id in self.description.lights.iter().filter(|id| !used.contains(id)) {
            let entity = &self.description.entities[id.0];
            if is_ambient(entity) {
                self.add_ambient(entity, &mut parts.ambient);
            } else if let Some(light) = self.instance(*id) {
                let (transform, motion) = parts.place_entity(entity, Transform::IDENTITY);
                if motion.is_some() {
                    let message = "lights cannot move: it keeps its position at shutter open";
                    let diagnostic = Diagnostic::new(codes::IGNORED_SETTING, message);
                    self.diagnostics.push(diagnostic.at(entity.class_span, ""));
                }
                lights.push(PlacedLight { light, transform });
                parts.light_origins.push(*id);
            }
        }
        lights
    }

    /// Returns the lights that other lights refer to: they shine through those only.
    fn lights_of_lights(&self) -> BTreeSet<EntityId> {
        let entities = self.description.lights.iter().map(|id| &self.description.entities[id.0]);
        let texts = entities.flat_map(|it| &it.parameters).filter_map(|it| match &it.values {
            Values::Texts(texts) => Some(texts),
            Values::Numbers(_) | Values::Booleans(_) | Values::Buffer(_) => None,
        });
        let light = |name: &String| self.names.get(&(ReferenceKind::Light, name.clone())).copied();
        texts.flatten().filter_map(light).collect()
    }

    /// `LightSource "ambient" "rgb L" [ r g b ]`: the value of `ambient()` in shaders.
    fn add_ambient(&mut self, entity: &Entity, ambient: &mut [f32; 3]) {
        for parameter in &entity.parameters {
            match (&parameter.values, parameter.name.as_str()) {
                (Values::Numbers(values), "L") if matches!(values.len(), 1 | 3) => {
                    for (channel, sum) in ambient.iter_mut().enumerate() {
                        *sum += values[channel % values.len()] as f32;
                    }
                }
                _ => self.diagnostics.push(
                    Diagnostic::new(
                        codes::UNKNOWN_PARAMETER,
                        format!("`ambient` has no parameter `{}` of this sort", parameter.name),
                    )
                    .at(parameter.declaration, "expected `\"rgb L\"`"),
                ),
            }
        }
    }

    /// Checks textures and materials that are not used, without the files that they name.
    fn check_unused_entities(&mut self) {
        self.unused = Some(Vec::new());
        for (index, entity) in self.description.entities.iter().enumerate() {
            match entity.kind {
                EntityKind::Texture | EntityKind::Material | EntityKind::AreaLight => {
                    self.instance(EntityId(index));
                }
                EntityKind::Camera
                | EntityKind::Film
                | EntityKind::Filter
                | EntityKind::Sampler
                | EntityKind::Integrator
                | EntityKind::Light
                | EntityKind::Shape => {}
            }
        }
        let unused = self.unused.take().unwrap_or_default();
        if self.skipped_files {
            // A later load may use them, and then needs the files.
            unused.into_iter().for_each(|EntityId(index)| self.instances[index] = Slot::Empty);
        }
    }

    /// Returns the instance of an entity, which is made at its first use; `None` if it cannot be made.
    fn instance(&mut self, id: EntityId) -> Option<Arc<Instance>> {
        match &self.instances[id.0] {
            Slot::Made(made) => return Some(made.outermost()),
            Slot::Failed => return None,
            Slot::Open => {
                let entity = &self.description.entities[id.0];
                let message = format!(
                    "{} `{}` refers to itself",
                    entity.kind.word(),
                    entity.name.as_deref().unwrap_or(&entity.class)
                );
                self.diagnostics.push(
                    Diagnostic::new(codes::REFERENCE_CYCLE, message).at(entity.class_span, ""),
                );
                return None;
            }
            Slot::Empty => {}
        }
        self.instances[id.0] = Slot::Open;
        self.depth += 1;
        let made = self.make(id);
        self.depth -= 1;
        if let Some(made) = &made {
            self.warn_of_values(&self.description.entities[id.0], &made.instance);
        }
        let instance = made.as_ref().map(Made::outermost);
        self.instances[id.0] = made.map_or(Slot::Failed, Slot::Made);
        self.unused.iter_mut().for_each(|unused| unused.push(id));
        instance
    }

    fn make(&mut self, id: EntityId) -> Option<Made> {
        let entity = &self.description.entities[id.0];
        if self.depth > MAX_REFERENCE_DEPTH {
            let message = format!("references are nested more than {MAX_REFERENCE_DEPTH} deep");
            self.diagnostics
                .push(Diagnostic::new(codes::LINK_LIMIT, message).at(entity.class_span, ""));
            return None;
        }
        if self.is_left_out(entity) {
            return None;
        }
        let class = self.class(entity)?;
        self.check_format(entity, &class);
        if let Some(made) = self.unchanged(id, &class) {
            return Some(made.clone());
        }
        let mesh = self.pbrt_name(entity).and_then(|_| MeshShape::named(&entity.class));
        let mut arguments = match mesh {
            Some(mesh) => self.mesh_arguments(mesh, entity),
            None => self.arguments(entity, &class),
        }?;
        let derived = self.with_attributes(id, &class, &mut arguments)?;
        if entity.kind == EntityKind::Shape {
            self.arrays.share(&mut arguments.values);
        }
        let alpha = match alpha_parameter(entity, &class) {
            Some(parameter) => self.alpha_texture(parameter, &mut arguments)?,
            None => None,
        };
        let given = arguments.values.iter().map(|(name, value)| (name.as_str(), value.clone()));
        let of = NamedEntity { entity, class: &class, standard: self.pbrt_name(entity) };
        let instance = match Instance::with_wording(&derived, given, of.wording()) {
            Ok(instance) => instance,
            Err(problems) => {
                let placed = problems.into_vec().into_iter().map(|problem| match problem.primary {
                    None => problem.at(entity.class_span, ""),
                    Some(_) => problem,
                });
                self.diagnostics.extend(placed);
                return None;
            }
        };
        let relief = self.relief(entity, &instance, &mut arguments)?;
        let Arguments { named, standard, .. } = arguments;
        let wanted = self.wanted.clone();
        Some(Made { instance, relief, alpha, named, standard, class, wanted })
    }

    /// The instance of an earlier load, if making it again would give the same.
    fn unchanged(&mut self, id: EntityId, class: &Arc<Class>) -> Option<&'a Made> {
        if self.earlier.changed.contains(&id) {
            return None;
        }
        let made = self.earlier.made.get(id.0)?.as_ref()?;
        let same_named = |(entity, earlier): &(EntityId, Arc<Instance>)| {
            self.instance(*entity).is_some_and(|now| Arc::ptr_eq(&now, earlier))
        };
        let unchanged = Arc::ptr_eq(&made.class, class) && made.named.iter().all(same_named);
        let is_shape = self.description.entities[id.0].kind == EntityKind::Shape;
        let unchanged = unchanged && (!is_shape || made.wanted == self.wanted);
        let same_class = |earlier: &Arc<Class>| match self.classes.find(&earlier.name) {
            Found::Class(now) => Arc::ptr_eq(&now, earlier),
            Found::Broken | Found::Nothing => false,
        };
        (unchanged && made.standard.iter().all(same_class)).then_some(made)
    }

    /// The arguments of an entity; `None` if one of them was reported as an error.
    fn arguments(&mut self, entity: &Entity, class: &Class) -> Option<Arguments> {
        let mut arguments = Arguments::default();
        let mut complete = true;
        let standard = self.pbrt_name(entity);
        if standard.is_some_and(PbrtName::has_files) && self.unused.is_some() {
            self.skipped_files = true;
        } else if let Some(standard) = standard {
            let made = standard.make(entity, self.files, &mut self.images);
            self.warn_of_images();
            match made {
                Ok(values) => match standard.image() {
                    Some(reference) => {
                        complete &= self.put_image(&mut arguments, reference, class, values);
                    }
                    None => arguments.values = values,
                },
                Err(diagnostic) => {
                    self.diagnostics.push(*diagnostic);
                    complete = false;
                }
            }
        }
        let is_elsewhere = |it: &str| {
            let takes = class.parameters.iter().any(|parameter| parameter.name == it);
            !takes
                && match entity.kind {
                    EntityKind::Camera => SHUTTER.contains(&it),
                    EntityKind::Shape => it == ALPHA,
                    EntityKind::Material => relief::PARAMETERS.contains(&it),
                    EntityKind::Integrator => SETTINGS_OF_INTEGRATORS.contains(&it),
                    EntityKind::Film
                    | EntityKind::Filter
                    | EntityKind::Sampler
                    | EntityKind::Texture
                    | EntityKind::AreaLight
                    | EntityKind::Light => false,
                }
        };
        let parameters = self.parameters(entity, class).into_iter();
        let is_attribute = |name: &str| {
            let is_own = class.parameters.iter().any(|parameter| parameter.name == name);
            !is_own && self.is_attribute(entity, name)
        };
        let parameters: Vec<Cow<'_, Parameter>> =
            parameters.filter(|it| !is_elsewhere(&it.name) && !is_attribute(&it.name)).collect();
        let of = NamedEntity { entity, class, standard };
        for parameter in parameters {
            let name = parameter.name.clone();
            match self.resolve(&mut arguments, |resolver| argument(of, parameter, resolver)) {
                Some(value) => arguments.values.push((name, value)),
                None => complete = false,
            }
        }
        complete.then_some(arguments)
    }

    /// Splits values made of an image: those that the class does not take are those of a texture that it takes as
    /// `reference`. Returns false if an error was reported.
    fn put_image(
        &mut self,
        arguments: &mut Arguments,
        reference: &str,
        class: &Class,
        values: Vec<(String, Value)>,
    ) -> bool {
        let is_own = |(name, _): &(String, Value)| {
            class.parameters.iter().any(|parameter| parameter.name == *name)
        };
        let (own, image): (Vec<_>, Vec<_>) = values.into_iter().partition(is_own);
        arguments.values = own;
        if image.is_empty() {
            return true;
        }
        let image = image.iter().map(|(name, value)| (name.as_str(), value.clone())).collect();
        let Some(texture) = self.standard_instance(IMAGE_TEXTURE, image) else { return false };
        arguments.standard.push(texture.class().clone());
        arguments.values.push((reference.to_owned(), Value::Instance(texture)));
        true
    }

    /// Converts a parameter and records in `arguments` the entities that it refers to; returns `None` if an error was
    /// reported.
    fn resolve<T>(
        &mut self,
        arguments: &mut Arguments,
        find: impl FnOnce(&mut dyn Resolve) -> Result<T, Box<Diagnostic>>,
    ) -> Option<T> {
        let mut resolver = Resolver::new(self);
        let found = find(&mut resolver);
        let reported = resolver.reported;
        arguments.named.append(&mut resolver.named);
        arguments.standard.append(&mut resolver.standard);
        match found {
            Ok(found) => Some(found),
            Err(diagnostic) => {
                self.diagnostics.extend((!reported).then_some(*diagnostic));
                None
            }
        }
    }

    /// The alpha texture of a shape; none if it is 1 everywhere. `None` if an error was reported.
    fn alpha_texture(
        &mut self,
        parameter: &Parameter,
        arguments: &mut Arguments,
    ) -> Option<Option<Arc<Instance>>> {
        if matches!(&parameter.values, Values::Numbers(values) if *values == [1.0]) {
            return Some(None);
        }
        self.resolve(arguments, |resolver| texture(parameter, resolver)).map(Some)
    }

    /// The parameters of an entity translated to those of its class.
    fn parameters<'e>(&mut self, entity: &'e Entity, class: &Class) -> Vec<Cow<'e, Parameter>> {
        match self.pbrt_name(entity) {
            Some(standard) => translated(entity, standard, class),
            None => {
                let taken_over = self.taken_over(entity, class).into_iter().map(Cow::Owned);
                entity.parameters.iter().map(Cow::Borrowed).chain(taken_over).collect()
            }
        }
    }

    /// The meaning of a pbrt name. A class of the same name in the scene's folder takes precedence.
    fn pbrt_name(&mut self, entity: &Entity) -> Option<&'static PbrtName> {
        let standard = PbrtName::of(entity)?;
        if standard.class == entity.class {
            // A class of the library, to which files are read.
            return Some(standard);
        }
        match self.classes.find(&entity.class) {
            Found::Nothing => Some(standard),
            Found::Class(_) | Found::Broken => None,
        }
    }

    fn unknown_name(&self, kind: ReferenceKind, name: &str) -> Box<Diagnostic> {
        let message = format!("unknown {} `{name}`", kind.word());
        let diagnostic = Diagnostic::new(codes::UNKNOWN_SCENE_NAME, message);
        let names = self.names.keys().filter(|(other, _)| *other == kind);
        Box::new(match most_similar(name, names.map(|(_, name)| name.as_str())) {
            Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
            None => diagnostic,
        })
    }

    fn class(&mut self, entity: &Entity) -> Option<Arc<Class>> {
        if self.is_attribute_texture(entity) {
            return match self.attribute_texture(entity) {
                Ok(class) => Some(class),
                Err(diagnostic) => {
                    self.diagnostics.push(*diagnostic);
                    None
                }
            };
        }
        let standard = self.pbrt_name(entity);
        let class = self.classes.find(standard.map_or(&entity.class, |standard| standard.class));
        let class = match class {
            Found::Class(class) => class,
            Found::Broken => return None,
            Found::Nothing => {
                let message = format!("unknown {} class `{}`", entity.kind.word(), entity.class);
                let diagnostic =
                    Diagnostic::new(codes::UNKNOWN_CLASS, message).at(entity.class_span, "");
                self.diagnostics
                    .push(match most_similar(&entity.class, Classes::standard_names()) {
                    Some(near) => diagnostic.suggest(
                        "did you mean this?",
                        entity.class_span,
                        format!("\"{near}\""),
                    ),
                    None => diagnostic.note(
                        "it is declared neither in the scene's folder nor in the standard library",
                    ),
                });
                return None;
            }
        };
        let role = entity.kind.role();
        if role.is_some_and(|role| !class.roles.contains(&role)) {
            let roles: Vec<&str> = class.roles.iter().map(|role| role.name()).collect();
            let message = format!(
                "`{}` is a class of role {}, expected role {}",
                class.name,
                roles.join(" and "),
                role.map_or("", Role::name)
            );
            self.diagnostics
                .push(Diagnostic::new(codes::WRONG_ROLE, message).at(entity.class_span, ""));
            return None;
        }
        Some(class)
    }
}

/// True for the light that is no instance: the value of `ambient()` in shaders.
fn is_ambient(entity: &Entity) -> bool {
    entity.kind == EntityKind::Light && entity.class == "ambient"
}

/// The alpha parameter of a shape, unless its class declares one of that name.
fn alpha_parameter<'e>(entity: &'e Entity, class: &Class) -> Option<&'e Parameter> {
    let is_own = class.parameters.iter().any(|parameter| parameter.name == ALPHA);
    let mut given = entity.parameters.iter();
    given.find(|it| entity.kind == EntityKind::Shape && it.name == ALPHA && !is_own)
}
