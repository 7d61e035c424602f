//! The light sources of a scene: its lights, and its emissive shapes.

mod lit_lanes;
mod probe;
mod sample;
mod selection;

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::{Kernel, LinkedMethod, Method, Objects, Outputs, Program, lookup_state};
use rtsl_scene::Scene;

use super::instance_classes::{InstanceClassId, InstanceClasses};
use super::kernels::{Batching, KernelMaker};
use super::object_entry::ObjectEntry;
use super::wavefront::{NO_INSTANCE, PathHit};
use crate::compiled::CompiledScene;

pub use sample::LightMemory;
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
}

/// Lights without a shape, of one program.
pub struct LightClass {
    program: Arc<Program>,
    objects: Arc<Objects>,
    /// The lights of the scene, by their index among the objects.
    lights: Vec<u32>,
    of: Batching,
    illumination: Arc<Kernel>,
    reads_normals: bool,
    /// True if rays that leave the scene can hit them, so that samples are weighted.
    is_weighed: bool,
    /// True if any has a transform.
    is_placed: bool,
}

/// Shapes of one traversal class with emitters of one class.
pub struct ShapeLightClass {
    /// The traversal class.
    class: u32,
    of: Batching,
    generate: Arc<Kernel>,
    /// The emitters' class and their `emission`.
    emitter: (InstanceClassId, Batching),
    emission: Arc<Kernel>,
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
    /// True if `evaluatePDF` reads normals.
    pub reads_normals: bool,
}

impl Lights {
    /// Collects the lights of a scene.
    pub fn new(
        maker: &mut KernelMaker<'_>,
        scene: &Scene,
        compiled: &CompiledScene,
        materials: &InstanceClasses,
        objects: &[ObjectEntry],
    ) -> Self {
        let mut lights = Lights {
            classes: Vec::new(),
            shapes: Vec::new(),
            entries: Vec::new(),
            skies: Vec::new(),
            first_of_object: BTreeMap::new(),
            selection: Selection::default(),
        };
        lights.add_classes(maker, scene, compiled);
        lights.add_shapes(maker, scene, compiled, materials, objects);
        let unknown = LightProbe { bounds: None, strength: 1.0 };
        lights.selection = Selection::new(&vec![unknown; lights.entries.len()]);
        lights
    }

    /// Sets the selection probabilities of lights from these probes.
    pub fn select_by(&mut self, probes: &[LightProbe]) {
        self.selection = Selection::new(probes);
    }

    /// True if no light is sampled.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Returns the probability with which a light is selected for a point.
    pub fn probability(&self, entry: u32, point: [f32; 3]) -> f32 {
        self.selection.probability(entry, point)
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
        let outputs = Outputs::ALL.without_scratch();
        let mut kernel =
            |method: Method, of: Batching| maker.kernel(program, method, (of, &objects), outputs);
        let illumination = kernel(Method::Illumination, of);
        let emission = kernel(Method::Emission, Batching::One(0));
        let density = match program.has(Method::Illumination) && program.has(Method::Emission) {
            true => kernel(Method::EvaluatePdf, Batching::One(0)),
            false => None,
        };
        let reads_normals = |method: Method| {
            let normals = ["rt_GeometricNormal", "rt_ShadingNormal"].map(lookup_state);
            let read = program.method(method).map(|linked| linked.reads.clone());
            read.is_ok_and(|read| read.iter().any(|it| normals.contains(&Some(*it))))
        };
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
                is_placed: lights
                    .iter()
                    .any(|it| !compiled.lights[*it as usize].forward.is_identity()),
                lights: lights.clone(),
                of,
                illumination,
                reads_normals: reads_normals(Method::Illumination),
                is_weighed: density.is_some(),
            });
        }
        let Some(emission) = emission else { return };
        self.skies.extend((0..).zip(&lights).map(|(index, light)| Sky {
            light: *light,
            program: program.clone(),
            objects: (objects.clone(), index),
            emission: emission.clone(),
            density: density.clone().map(|density| (density, first + index)),
            reads_normals: reads_normals(Method::EvaluatePdf),
        }));
    }

    fn add_shapes(
        &mut self,
        maker: &mut KernelMaker<'_>,
        scene: &Scene,
        compiled: &CompiledScene,
        materials: &InstanceClasses,
        objects: &[ObjectEntry],
    ) {
        let mut by_key: BTreeMap<(u32, InstanceClassId), Vec<u32>> = BTreeMap::new();
        for (object, placed) in (0..).zip(&scene.objects) {
            let Some(emitter) = placed.emitter else { continue };
            let class = objects[object as usize].class;
            let program = compiled.class(class).program();
            let (emitter, _) = materials.place(emitter as usize);
            if is_sampled(&materials[emitter].program, program) {
                by_key.entry((class, emitter)).or_default().push(object);
            }
        }
        for ((class, emitter), members) in by_key {
            let of = match members.as_slice() {
                [only] if scene.objects[*only as usize].elements.is_none() => {
                    let entry = &objects[*only as usize];
                    [Batching::One(entry.index), Batching::One(entry.emitter)]
                }
                _ => [Batching::Each; 2],
            };
            let made = shape_class(maker, compiled, materials, (class, emitter), of);
            let index = self.shapes.len() as u32;
            self.shapes.extend(made);
            for object in members {
                self.add_object(scene, compiled, object, (class, index));
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
        (class, shapes): (u32, u32),
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

/// The index of the class of area lights for these classes of shapes and emitters.
fn shape_class(
    maker: &mut KernelMaker<'_>,
    compiled: &CompiledScene,
    materials: &InstanceClasses,
    (class, emitter): (u32, InstanceClassId),
    [of, of_emitter]: [Batching; 2],
) -> Option<ShapeLightClass> {
    let shapes = compiled.class(class);
    let emitters = &materials[emitter];
    let outputs = Outputs::ALL.without_scratch();
    let objects = (of, &*shapes.objects);
    let generate = maker.kernel(shapes.program(), Method::GenerateSample, objects, outputs);
    let objects = (of_emitter, &*emitters.objects);
    let emission = maker.kernel(&emitters.program, Method::Emission, objects, outputs);
    let (generate, emission) = generate.zip(emission)?;
    Some(ShapeLightClass { class, of, generate, emitter: (emitter, of_emitter), emission })
}

/// True if shapes of a program are sampled as lights with the `emission` of another program's materials: if samples can
/// be weighted against hits, and a sample provides all inputs of `emission`. Other emissive shapes contribute only when
/// rays hit them.
pub fn is_sampled(emitter: &Program, shape: &Program) -> bool {
    const KNOWN: [&str; 8] = [
        "rt_RayOrigin",
        "rt_RayDirection",
        "rt_HitPoint",
        "rt_HitDistance",
        "rt_GeometricNormal",
        "rt_ShadingNormal",
        "rt_Epsilon",
        "rt_TimeSeed",
    ];
    let knows = |emission: &LinkedMethod| {
        !emission.reads_scratch && emission.reads.iter().all(|it| KNOWN.contains(&it.name))
    };
    emitter.method(Method::Emission).is_ok_and(|it| knows(&it))
        && shape.has(Method::GenerateSample)
        && shape.has(Method::SamplePdf)
}

/// Marks classes of area lights until the number of other classes is known.
const SHAPE: u32 = 1 << 31;
