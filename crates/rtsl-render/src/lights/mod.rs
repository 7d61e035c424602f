//! The light sources of a scene: its lights, and its emissive shapes.

mod lit_lanes;
mod probe;
mod sample;
mod selection;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, OnceLock};

use rtsl::{
    Engine, HostQuery, Kernel, LightSelection, LightSelector, LinkedMethod, Method, Objects,
    PROVIDED_BY_LIGHT_SAMPLES, Program, QueryForm, Weighing,
};
use rtsl_scene::Scene;

use crate::compiled::CompiledScene;
use crate::compiled::group_plan::Classes;
use crate::compiled::instance_classes::{InstanceClassId, InstanceClasses};
use crate::compiled::kernels::{Batching, KernelMaker};
use crate::compiled::object_entry::ObjectEntry;
use crate::compiled::surface_group::needs_of;
use crate::integrate::wavefront::{NO_INSTANCE, PathHit};
use crate::surfaces::{ReadSurfaces, SurfaceKernels};

pub use probe::probe_lights;
pub use sample::{LightMemory, Weights};
use selection::{LightProbe, Selection};

/// The lights of a scene.
pub struct Lights {
    /// Lights without a shape, by class.
    pub classes: Vec<LightClass>,
    /// Area lights, by the classes of shapes and emitters.
    pub shapes: Vec<ShapeLightClass>,
    /// Every light that is sampled.
    pub entries: Vec<LightEntry>,
    /// The lights that rays hit which leave the scene.
    pub skies: Vec<Sky>,
    /// By object and instance, the entry of its first element.
    first_of_object: BTreeMap<(u32, u32), u32>,
    selection: Selection,
    selector: OnceLock<LightSelector>,
}

/// Lights without a shape, of one program.
pub struct LightClass {
    program: Arc<Program>,
    objects: Arc<Objects>,
    /// The lights of the scene, by their index among the objects.
    lights: Vec<u32>,
    of: Batching,
    illumination: Arc<Kernel>,
    /// True if any has a transform.
    is_placed: bool,
}

/// Shapes of one traversal class with emitters of one class.
pub struct ShapeLightClass {
    /// The traversal class.
    class: u32,
    of: Batching,
    generate: Arc<Kernel>,
    /// The emitters' class, and the radiance by their `emission`.
    emitter: (InstanceClassId, Batching),
    emission: Arc<Kernel>,
    /// The class of the shapes' alpha textures, and the radiance that their `lookup` leaves.
    alpha: Option<(InstanceClassId, Batching, Arc<Kernel>)>,
    /// The kernels that compute what these read of sampled points, unless samples provide it.
    surface: Option<SurfaceKernels>,
    /// True if no ray hits the shapes, so that samples alone find their light.
    is_invisible: bool,
}

/// The key of shapes that are sampled together: their traversal class, the classes of their emitters and alpha
/// textures, and whether rays pass them everywhere.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct ShapeLightKey {
    class: u32,
    emitter: InstanceClassId,
    alpha: Option<InstanceClassId>,
    is_invisible: bool,
}

/// A light that is sampled.
#[derive(Clone, Copy, Debug)]
pub struct LightEntry {
    /// Its class: those of area lights come after those of lights without a shape.
    class: u32,
    /// Its index among the objects of the class.
    index: u32,
    /// The hit of a ray that hits it; for a light without a shape, the object is the index of the light in the scene.
    hit: PathHit,
}

/// A light that rays hit which leave the scene.
pub struct Sky {
    /// The index of the light in the scene.
    pub light: u32,
    /// Its class's program.
    pub program: Arc<Program>,
    /// The lights of the class, and its index among them.
    pub objects: (Arc<Objects>, u32),
    /// `emission`.
    pub emission: Arc<Kernel>,
    /// `evaluatePDF`, and the entry of the light, if it is sampled.
    pub density: Option<(Arc<Kernel>, u32)>,
}

impl Lights {
    /// Collects the lights of a scene.
    pub fn new(
        maker: &mut KernelMaker<'_>,
        scene: &Scene,
        classes: Classes<'_>,
        objects: &[ObjectEntry],
    ) -> Self {
        let mut lights = Lights {
            classes: Vec::new(),
            shapes: Vec::new(),
            entries: Vec::new(),
            skies: Vec::new(),
            first_of_object: BTreeMap::new(),
            selection: Selection::default(),
            selector: OnceLock::new(),
        };
        lights.add_classes(maker, scene, classes.compiled);
        lights.add_shapes(maker, scene, classes, objects);
        let unknown = LightProbe { bounds: None, strength: 1.0, is_near: false };
        lights.selection = Selection::new(&vec![unknown; lights.entries.len()]);
        lights
    }

    /// Sets the selection probabilities of lights from these probes.
    pub fn select_by(&mut self, probes: &[LightProbe]) {
        self.selection = Selection::new(probes);
        self.selector = OnceLock::new();
    }

    /// Removes lights from those that rays hit which leave the scene if all samples of theirs, which they claim to be
    /// found by such rays, lie at finite distances. Returns the names of their classes.
    pub fn remove_unreachable_skies(&mut self, probes: &[LightProbe]) -> BTreeSet<String> {
        let is_unreachable = |sky: &mut Sky| {
            sky.density.as_ref().is_some_and(|(_, entry)| probes[*entry as usize].is_near)
        };
        let removed = self.skies.extract_if(.., is_unreachable);
        removed.map(|sky| sky.program.class().name.clone()).collect()
    }

    /// True if no light is sampled.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Returns the kernels that select lights, made at the first call: stages select the lights of most scenes.
    pub fn selector(&self, engine: &Engine) -> &LightSelector {
        self.selector.get_or_init(|| {
            let lights = self.selection.lights();
            engine.light_selector(lights).unwrap_or_else(|_| {
                let interpreted = Engine::interpreter().light_selector(lights);
                interpreted.expect("the interpreter runs the texts of the library")
            })
        })
    }

    /// Returns the [way](LightSelection::way) to a light in the light hierarchy.
    pub fn way_to_entry(&self, entry: u32) -> u32 {
        self.selection.way_to(entry)
    }

    /// Returns the selection of lights for stages, which have these indices of the entries.
    pub fn selection(&self, indices: &[usize]) -> LightSelection {
        self.selection.for_stages(|entry| indices[entry])
    }

    /// Returns the way to an element of an object of the world in the light hierarchy as stages take it, if the object
    /// is a light.
    pub fn way_to(&self, object: u32, element: u32) -> Option<u32> {
        Some(self.selection.way_to(self.first_of_object.get(&(object, NO_INSTANCE))? + element))
    }

    /// Returns the area lights of an entry; `None` for lights without a shape.
    pub fn shapes_of(&self, entry: &LightEntry) -> Option<&ShapeLightClass> {
        self.shapes.get((entry.class as usize).checked_sub(self.classes.len())?)
    }

    /// Returns the class and method that compute the colour of a sample of this light.
    pub fn sampled_method<'a>(
        &'a self,
        entry: u32,
        emitters: &'a InstanceClasses,
    ) -> (&'a str, Method) {
        let class = self.entries[entry as usize].class as usize;
        match self.classes.get(class) {
            Some(class) => (&class.program.class().name, Method::Illumination),
            None => {
                let (emitter, _) = self.shapes[class - self.classes.len()].emitter;
                let program = &emitters[emitter].program;
                (&program.class().name, Method::Emission)
            }
        }
    }

    /// Returns the entry of the light that a ray hit, if it is sampled.
    pub fn entry_of(&self, hit: &PathHit) -> Option<u32> {
        let first = self.first_of_object.get(&(hit.object, hit.instance))?;
        Some(first + hit.element)
    }

    fn add_classes(
        &mut self,
        maker: &mut KernelMaker<'_>,
        scene: &Scene,
        compiled: &CompiledScene,
    ) {
        let mut by_program: BTreeMap<usize, usize> = BTreeMap::new();
        let mut members: Vec<(Arc<Program>, Vec<u32>)> = Vec::new();
        for (light, placed) in (0..).zip(&scene.lights) {
            let program = maker.engine().program(&placed.light);
            let next = members.len();
            let class = *by_program.entry(Arc::as_ptr(&program) as usize).or_insert(next);
            if class == next {
                members.push((program, Vec::new()));
            }
            members[class].1.push(light);
        }
        for (program, lights) in members {
            self.add_class(maker, scene, compiled, &program, lights);
        }
    }

    fn add_class(
        &mut self,
        maker: &mut KernelMaker<'_>,
        scene: &Scene,
        compiled: &CompiledScene,
        program: &Arc<Program>,
        lights: Vec<u32>,
    ) {
        let instances = lights.iter().map(|light| &*scene.lights[*light as usize].light);
        let objects = Arc::new(program.differing_objects(instances));
        let of = if lights.len() == 1 { Batching::One(0) } else { Batching::Each };
        let is_placed =
            lights.iter().any(|it| !compiled.lights[*it as usize].forward.is_identity());
        let mut kernel = |method: Method, of: Batching, query: HostQuery| {
            let first_column = compiled.scratch_arrays as u32;
            let form = QueryForm { query, are_grouped: false, are_sampled: false, first_column };
            program.has(method).then(|| maker.query(program, of, &objects, false, form)).flatten()
        };
        let one = Batching::One(0);
        let emission = kernel(Method::Emission, one, HostQuery::SkyEmission);
        let methods = [Method::Illumination, Method::Emission, Method::EvaluatePdf];
        // Rays that leave the scene find samples at infinity, too.
        let is_weighed = methods.into_iter().all(|method| program.has(method));
        let density =
            is_weighed.then(|| kernel(Method::EvaluatePdf, one, HostQuery::SkyDensity)).flatten();
        let query = HostQuery::Illumination { is_placed, is_weighed };
        let illumination = kernel(Method::Illumination, of, query);
        let first = self.entries.len() as u32;
        if let Some(illumination) = illumination {
            let class = self.classes.len() as u32;
            self.entries.extend((0..).zip(&lights).map(|(index, light)| LightEntry {
                class,
                index,
                hit: PathHit { object: *light, instance: NO_INSTANCE, ..PathHit::default() },
            }));
            self.classes.push(LightClass {
                program: program.clone(),
                objects: objects.clone(),
                is_placed,
                lights: lights.clone(),
                of,
                illumination,
            });
        }
        let Some(emission) = emission else { return };
        self.skies.extend((0..).zip(&lights).map(|(index, light)| Sky {
            light: *light,
            program: program.clone(),
            objects: (objects.clone(), index),
            emission: emission.clone(),
            density: density.clone().map(|density| (density, first + index)),
        }));
    }

    fn add_shapes(
        &mut self,
        maker: &mut KernelMaker<'_>,
        scene: &Scene,
        classes: Classes<'_>,
        objects: &[ObjectEntry],
    ) {
        let Classes { compiled, materials, alpha } = classes;
        let mut by_key: BTreeMap<ShapeLightKey, Vec<u32>> = BTreeMap::new();
        let mut textures = 0..;
        for (object, placed) in (0..).zip(&scene.objects) {
            let texture = placed.alpha.as_ref().and_then(|_| textures.next());
            let Some(emitter) = placed.emitter else { continue };
            let class = objects[object as usize].class;
            let program = compiled.class(class).program();
            let (emitter, _) = materials.place(emitter as usize);
            if !is_sampled(&materials[emitter].program, program, placed.elements) {
                continue;
            }
            let is_invisible = placed.is_invisible();
            let texture = texture.filter(|_| !is_invisible);
            let alpha = texture.map(|texture| alpha.place(texture).0);
            let key = ShapeLightKey { class, emitter, alpha, is_invisible };
            by_key.entry(key).or_default().push(object);
        }
        for (key, members) in by_key {
            let of = match members.as_slice() {
                [only] if scene.objects[*only as usize].elements.is_none() => {
                    let entry = &objects[*only as usize];
                    [entry.index, entry.emitter, entry.alpha].map(Batching::One)
                }
                _ => [Batching::Each; 3],
            };
            let made = ShapeLightClass::new(maker, classes, key, of);
            let index = self.shapes.len() as u32;
            self.shapes.extend(made);
            for object in members {
                self.add_object(scene, compiled, object, key.class, index);
            }
        }
        // Lights without a shape come first.
        let without = self.classes.len() as u32;
        for entry in &mut self.entries {
            if entry.class & SHAPE != 0 {
                entry.class = (entry.class & !SHAPE) + without;
            }
        }
    }

    /// Adds all instances of an object, or its elements.
    fn add_object(
        &mut self,
        scene: &Scene,
        compiled: &CompiledScene,
        object: u32,
        class: u32,
        shapes: u32,
    ) {
        let group = compiled
            .items
            .iter()
            .position(|items| items.members().iter().any(|member| member.object == object));
        let places: Vec<u32> = match group {
            Some(0) => vec![NO_INSTANCE],
            Some(group) => {
                let instances = (0..).zip(&compiled.geometry.instances);
                let placing = instances.filter(|(_, it)| it.group as usize == group);
                placing.map(|(instance, _)| instance).collect()
            }
            None => Vec::new(),
        };
        let elements = scene.objects[object as usize].elements.unwrap_or(1);
        let class = compiled.class(class);
        for instance in places {
            self.first_of_object.insert((object, instance), self.entries.len() as u32);
            self.entries.extend((0..elements).map(|element| LightEntry {
                class: shapes | SHAPE,
                index: class.index_of(object, element).unwrap_or(0),
                hit: PathHit { path: 0, object, element, instance },
            }));
        }
    }
}

impl LightEntry {
    /// Returns the hit of a ray that hits the light; for a light without a shape, the object is the index of the light
    /// in the scene.
    pub fn hit(&self) -> &PathHit {
        &self.hit
    }
}

impl ShapeLightClass {
    /// The traversal class.
    pub fn class(&self) -> u32 {
        self.class
    }

    /// True if the shapes are cut out by textures.
    pub fn has_alpha(&self) -> bool {
        self.alpha.is_some()
    }

    /// True if no ray hits the shapes.
    pub fn is_invisible(&self) -> bool {
        self.is_invisible
    }

    /// Compiles the kernels of a class, for the instances by which shapes, emitters and alpha textures are selected.
    fn new(
        maker: &mut KernelMaker<'_>,
        classes: Classes<'_>,
        key: ShapeLightKey,
        [of, of_emitter, of_alpha]: [Batching; 3],
    ) -> Option<Self> {
        let shapes = classes.compiled.class(key.class);
        let emitters = &classes.materials[key.emitter];
        let first_column = classes.compiled.scratch_arrays as u32;
        // Emitters and textures have the same kernels whatever the shapes.
        let form = |query: HostQuery| QueryForm {
            query,
            are_grouped: false,
            are_sampled: false,
            first_column,
        };
        let point = QueryForm {
            are_grouped: classes.compiled.is_placed_by_instances(key.class),
            are_sampled: true,
            ..form(HostQuery::SampledPoint)
        };
        let is_placed = shapes.is_placed();
        let generate = maker.query(shapes.program(), of, &shapes.objects, is_placed, point);
        let last = if key.is_invisible { Weighing::OfInvisible } else { Weighing::OfFound };
        let weighing = if key.alpha.is_some() { Weighing::Later } else { last };
        let query = form(HostQuery::SampledEmission(weighing));
        let (emitter, objects) = (&emitters.program, &emitters.objects);
        let emission = maker.query(emitter, of_emitter, objects, false, query);
        let textures = key.alpha.map(|class| &classes.alpha[class]);
        let lookup = textures.and_then(|textures| {
            let query = form(HostQuery::SampledAlpha(last));
            maker.query(&textures.program, of_alpha, &textures.objects, false, query)
        });
        let lookup_method = textures.and_then(|it| it.program.method(Method::Lookup).ok());
        let readers = emitters.program.method(Method::Emission).ok().into_iter();
        let readers: Vec<_> = readers.chain(lookup_method).collect();
        let read =
            ReadSurfaces { needs: needs_of(&readers), are_sampled: true, ..Default::default() };
        let surface = (!readers.iter().all(|it| is_provided(it)))
            .then(|| SurfaceKernels::new(maker, classes.compiled, key.class, of, read));
        let (generate, emission) = generate.zip(emission)?;
        Some(ShapeLightClass {
            class: key.class,
            of,
            generate,
            emitter: (key.emitter, of_emitter),
            emission,
            alpha: key.alpha.zip(lookup).map(|(class, lookup)| (class, of_alpha, lookup)),
            surface: surface.flatten(),
            is_invisible: key.is_invisible,
        })
    }
}

/// Meshes of more faces are not sampled if their emission varies over them, as it does on a model with a few bright
/// windows in a texture: most faces are black, and each would be a light.
const MAX_TEXTURED_FACES: u32 = 1 << 16;

/// True if samples provide all state that a method reads.
fn is_provided(method: &LinkedMethod) -> bool {
    method.reads.iter().all(|read| PROVIDED_BY_LIGHT_SAMPLES.contains(&read.name))
}

/// True if shapes of a program, with so many elements, are sampled as lights with the `emission` of another program's
/// materials: if samples can be weighted against hits. Other emissive shapes contribute only when rays hit them.
pub fn is_sampled(emitter: &Program, shape: &Program, elements: Option<u32>) -> bool {
    let has_few = elements.is_none_or(|count| count <= MAX_TEXTURED_FACES);
    let is_usable = |it: &LinkedMethod| !it.reads_scratch && (has_few || is_provided(it));
    emitter.method(Method::Emission).is_ok_and(|it| is_usable(&it))
        && shape.has(Method::GenerateSample)
        && shape.has(Method::SamplePdf)
}

/// Marks classes of area lights until the number of other classes is known.
const SHAPE: u32 = 1 << 31;
