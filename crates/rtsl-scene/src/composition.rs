//! Scenes that a host makes of instances, without a text.

use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use rtsl::{
    Class, Compiler, Diagnostic, Diagnostics, Instance, Messages, Role, SourceMap, Value,
    diagnostic_codes as codes, library,
};
use rtsl_math::Transform;

use crate::attributes::share_attributes;
use crate::presence::{PRESENCE_CLASS, PRESENCE_TEXT, Presences};
use crate::scene::{PlacedLight, Scene, SceneObject};
use crate::settings::Settings;
use crate::standard::{DEFAULT_MATERIAL, PATH_TRACER, WHITTED, path_tracer_arguments};

/// The parts of a scene that a host makes of instances.
#[derive(Clone, Debug)]
pub struct Composition {
    /// The scene to which the parts are added, such as a loaded one; without it they are all.
    pub base: Option<Scene>,
    /// Film and sampler, in place of those of the base.
    pub settings: Settings,
    /// The integrator; if `None`, that of the base, or that of the renderer.
    pub integrator: Option<Arc<Instance>>,
    /// The camera, with the transform from its space to the world's; if `None`, that of the base.
    pub camera: Option<(Arc<Instance>, Transform)>,
    /// The shapes.
    pub shapes: Vec<ComposedShape>,
    /// The lights.
    pub lights: Vec<PlacedLight>,
    /// The summand of the value of `ambient()`.
    pub ambient: [f32; 3],
}

/// A shape of a composition.
#[derive(Clone, Debug)]
pub struct ComposedShape {
    /// The shape.
    pub primitive: Arc<Instance>,
    /// Its material; if `None`, grey that scatters light evenly.
    pub material: Option<Arc<Instance>>,
    /// A material whose emission it gives off besides.
    pub emitter: Option<Arc<Instance>>,
    /// Its alpha texture.
    pub alpha: Option<Arc<Instance>>,
    /// From the shape's space to the world's.
    pub transform: Transform,
    /// True if its normals are flipped.
    pub reverse_orientation: bool,
}

/// Makes scenes of compositions. What does not change from one to the next has the same instances, by which renderers
/// see what they can keep.
///
/// ```
/// use rtsl::{Compiler, Instance, library};
/// use rtsl_math::Transform;
/// use rtsl_scene::{ComposedShape, Composer, Composition, Settings};
///
/// let instance = |name: &str| {
///     let unit = library::unit_of_class(&Compiler::default(), name).expect("the library has it");
///     Instance::new(unit.class(name).expect("the file has it"), []).expect("all have defaults")
/// };
/// let sphere = ComposedShape {
///     primitive: instance("Sphere"),
///     material: None,
///     emitter: None,
///     alpha: None,
///     transform: Transform::translate([0.0, 0.0, 5.0]),
///     reverse_orientation: false,
/// };
/// let composition = Composition {
///     base: None,
///     settings: Settings::default(),
///     integrator: None,
///     camera: Some((instance("Pinhole"), Transform::IDENTITY)),
///     shapes: vec![sphere],
///     lights: Vec::new(),
///     ambient: [0.0; 3],
/// };
/// let scene = Composer::default().compose(composition).expect("it has no errors");
/// assert_eq!((scene.objects.len(), scene.materials.len()), (1, 1));
/// ```
#[derive(Clone, Debug, Default)]
pub struct Composer {
    presences: Presences,
    /// The path tracer, with the settings that it was made for.
    path_tracer: Option<(Settings, Arc<Instance>)>,
}

impl Composer {
    /// Makes the scene of a composition.
    ///
    /// # Errors
    /// If it has no camera, an instance is not of the role that its use needs, or attributes do not fit each other.
    pub fn compose(&mut self, composition: Composition) -> Result<Scene, Messages> {
        self.scene_of(composition).map_err(|problems| {
            let mut messages = Messages::default();
            messages.push(SourceMap::new(), problems);
            messages
        })
    }

    fn scene_of(&mut self, composition: Composition) -> Result<Scene, Diagnostics> {
        let Composition { base, settings, integrator, camera, shapes, lights, ambient } =
            composition;
        let mut scene = match (base, camera) {
            (Some(base), None) => base,
            (base, Some((camera, camera_to_world))) => {
                check_role(&camera, Role::Camera)?;
                match base {
                    Some(base) => Scene { camera, camera_to_world, camera_motion: None, ..base },
                    None => self.empty_scene(&settings, camera, camera_to_world)?,
                }
            }
            (None, None) => {
                let problem =
                    Diagnostic::new(codes::MISPLACED_DIRECTIVE, "the scene has no camera");
                return Err(one(problem));
            }
        };
        scene.path_tracer = self.path_tracer(&settings)?;
        scene.settings = settings;
        if let Some(integrator) = integrator {
            check_role(&integrator, Role::Integrator)?;
            scene.integrator = Some(integrator);
        }
        let mut materials = Materials::of(&scene);
        for shape in shapes {
            add_shape(&mut scene, &mut materials, shape)?;
        }
        for light in lights {
            check_role(&light.light, Role::Light)?;
            scene.lights.push(light);
        }
        for (sum, value) in scene.ambient.iter_mut().zip(ambient) {
            *sum += value;
        }
        if let Some(class) = presence_class() {
            self.presences.add_to(&mut scene, &class);
        }
        share_attributes(&mut scene).map_err(one)?;
        Ok(scene)
    }

    fn empty_scene(
        &mut self,
        settings: &Settings,
        camera: Arc<Instance>,
        camera_to_world: Transform,
    ) -> Result<Scene, Diagnostics> {
        Ok(Scene {
            settings: settings.clone(),
            integrator: None,
            path_tracer: self.path_tracer(settings)?,
            whitted: standard_instance(WHITTED)?,
            camera,
            camera_to_world,
            camera_motion: None,
            materials: Vec::new(),
            lights: Vec::new(),
            ambient: [0.0; 3],
            objects: Vec::new(),
            world: Vec::new(),
            groups: Vec::new(),
            instances: Vec::new(),
        })
    }

    fn path_tracer(&mut self, settings: &Settings) -> Result<Arc<Instance>, Diagnostics> {
        let arguments = |settings: &Settings| path_tracer_arguments(settings);
        let is_same = |(of, _): &&(Settings, Arc<Instance>)| {
            let same = |(one, other): (&(&str, Value), &(&str, Value))| {
                format!("{one:?}") == format!("{other:?}")
            };
            arguments(of).iter().zip(&arguments(settings)).all(same)
        };
        if let Some((_, made)) = self.path_tracer.as_ref().filter(is_same) {
            return Ok(made.clone());
        }
        let made = Instance::new(&standard_class(PATH_TRACER).map_err(one)?, arguments(settings))?;
        self.path_tracer = Some((settings.clone(), made.clone()));
        Ok(made)
    }
}

/// The indices of materials by address.
struct Materials(BTreeMap<usize, u32>);

impl Materials {
    fn of(scene: &Scene) -> Self {
        let each = scene.materials.iter().zip(0..);
        Materials(each.map(|(material, index)| (Arc::as_ptr(material).addr(), index)).collect())
    }

    fn index(&mut self, scene: &mut Scene, material: Arc<Instance>) -> Result<u32, Diagnostics> {
        check_role(&material, Role::Material)?;
        let next = scene.materials.len() as u32;
        let index = *self.0.entry(Arc::as_ptr(&material).addr()).or_insert(next);
        if index == next {
            scene.materials.push(material);
        }
        Ok(index)
    }
}

fn add_shape(
    scene: &mut Scene,
    materials: &mut Materials,
    shape: ComposedShape,
) -> Result<(), Diagnostics> {
    let ComposedShape { primitive, material, emitter, alpha, transform, reverse_orientation } =
        shape;
    check_role(&primitive, Role::Primitive)?;
    if let Some(alpha) = &alpha {
        check_role(alpha, Role::Texture)?;
    }
    let material = match material {
        Some(material) => material,
        None => standard_instance(DEFAULT_MATERIAL)?,
    };
    let material = materials.index(scene, material)?;
    let emitter = emitter.map(|emitter| materials.index(scene, emitter)).transpose()?;
    scene.world.push(scene.objects.len() as u32);
    scene.objects.push(SceneObject {
        elements: primitive.element_count().filter(|count| *count != 1),
        primitive,
        transform,
        motion: None,
        material,
        emitter,
        reverse_orientation,
        alpha,
    });
    Ok(())
}

fn check_role(instance: &Instance, role: Role) -> Result<(), Diagnostics> {
    let class = instance.class();
    if class.roles.contains(&role) {
        return Ok(());
    }
    let message = format!("`{}` is no {}", class.name, role.name());
    Err(one(Diagnostic::new(codes::WRONG_VALUE, message)))
}

fn one(diagnostic: Diagnostic) -> Diagnostics {
    let mut diagnostics = Diagnostics::new();
    diagnostics.push(diagnostic);
    diagnostics
}

/// The class of alpha textures of materials with holes, compiled once: engines know classes by their addresses.
fn presence_class() -> Option<Arc<Class>> {
    static CLASS: LazyLock<Option<Arc<Class>>> = LazyLock::new(|| {
        let compiled = Compiler::default().compile("presence.rtsl", PRESENCE_TEXT);
        compiled.unit?.class(PRESENCE_CLASS).ok().cloned()
    });
    CLASS.clone()
}

/// Returns a class of the standard library, compiled once.
fn standard_class(name: &'static str) -> Result<Arc<Class>, Diagnostic> {
    static CLASSES: Mutex<BTreeMap<&str, Arc<Class>>> = Mutex::new(BTreeMap::new());
    let mut classes = CLASSES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(class) = classes.get(name) {
        return Ok(class.clone());
    }
    let class = library::unit_of_class(&Compiler::default(), name)?.class(name)?.clone();
    classes.insert(name, class.clone());
    Ok(class)
}

/// Returns the instance with defaults of a class of the standard library, made once.
fn standard_instance(name: &'static str) -> Result<Arc<Instance>, Diagnostics> {
    static INSTANCES: Mutex<BTreeMap<&str, Arc<Instance>>> = Mutex::new(BTreeMap::new());
    let mut instances = INSTANCES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(instance) = instances.get(name) {
        return Ok(instance.clone());
    }
    let instance = Instance::new(&standard_class(name).map_err(one)?, [])?;
    instances.insert(name, instance.clone());
    Ok(instance)
}
