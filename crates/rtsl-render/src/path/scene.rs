//! A scene prepared for path tracing: surface groups and lights.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use rtsl::{
    Diagnostic, Diagnostics, Engine, Messages, Method, Objects, Program, SourceMap,
    diagnostic_codes as codes,
};
use rtsl_bvh::RAYS_OF_STREAM;
use rtsl_scene::Scene;

use super::instance_classes::InstanceClasses;
use super::kernels::{Batching, KernelMaker};
use super::lights::{Lights, is_sampled};
use super::material::MaterialSource;
use super::surface_group::{GroupKey, GroupParts, SurfaceGroup};
use super::tracer::PathTracer;
use crate::compiled::placed_objects::GroupMember;
use crate::compiled::runtime_errors::{RuntimeErrors, exhausted_budgets};
use crate::compiled::shaders::is_own_material;
use crate::compiled::{BuildStep, CompiledScene, SceneBuilder};

/// In classes with at most so many objects, each is called separately: its members are then read once.
const MAX_OBJECTS_ALONE: usize = 8;

/// A scene ready for path tracing.
pub struct BatchScene {
    /// The compiled scene with the acceleration structure.
    pub compiled: CompiledScene,
    /// The time for compiling kernels.
    pub compile_time: Duration,
    /// The groups.
    pub(super) groups: Vec<SurfaceGroup>,
    /// The entries of objects.
    pub(super) objects: Vec<ObjectEntry>,
    /// The materials.
    pub(super) materials: InstanceClasses,
    /// The alpha textures.
    pub(super) alpha: InstanceClasses,
    /// The lights.
    pub(super) lights: Lights,
}

/// The indices of an object's parts.
#[derive(Clone, Copy, Debug, Default)]
pub struct ObjectEntry {
    /// Its group.
    pub group: u32,
    /// The index of its material among those of its class.
    pub material: u32,
    /// The index of its emitter among those of its class.
    pub emitter: u32,
    /// The index of its alpha texture among those of its class.
    pub alpha: u32,
    /// The traversal class of the object or its elements.
    pub class: u32,
    /// Its index there; elements have separate ones.
    pub number: u32,
    /// The index of its first item in its group.
    pub first_item: u32,
}

impl BatchScene {
    /// Compiles kernels for a scene and builds its acceleration structure. Warnings go to `messages`; `listener` is
    /// called with the next step.
    ///
    /// # Errors
    /// If a class lacks a method that its use needs, or a kernel cannot be compiled.
    pub fn new(
        scene: &Scene,
        engine: &Engine,
        messages: &mut Messages,
        listener: &dyn Fn(BuildStep),
    ) -> Result<Self, Messages> {
        let builder = SceneBuilder::new(engine).listener(listener);
        let builder = if has_shade(engine, scene) { builder } else { builder.for_searches() };
        let compiled = builder.build(scene.clone(), messages)?;
        let start = Instant::now();
        let materials = InstanceClasses::new(engine, &scene.materials);
        let textures: Vec<_> = scene.objects.iter().filter_map(|it| it.alpha.clone()).collect();
        let alpha = InstanceClasses::new(engine, &textures);
        let members = members(&compiled);
        let classes = Classes { compiled: &compiled, materials: &materials, alpha: &alpha };
        let plan = GroupPlan::new(scene, classes, &members);
        let made = KernelMaker::build_with(engine, |maker| {
            let groups = plan.keys.iter().map(|key| {
                let parts = classes.parts_of(key);
                SurfaceGroup::new(maker, *key, &parts)
            });
            let groups: Vec<SurfaceGroup> = groups.collect();
            (groups, Lights::new(maker, scene, &compiled, &materials, &plan.objects))
        });
        let ((groups, lights), diagnostics) = made.map_err(|errors| failed(messages, errors))?;
        messages.push(SourceMap::new(), diagnostics);
        // Paths are incoherent, so searches need all kernels at once.
        let has_streams = compiled.geometry.suits_stream(RAYS_OF_STREAM);
        compiled.classes.par_iter().for_each(|class| class.make_all(has_streams));
        warn_of_shade(&groups, &compiled, &materials, messages);
        let compile_time = compiled.compile_time + start.elapsed();
        let mut scene = BatchScene {
            compiled,
            compile_time,
            groups,
            objects: plan.objects,
            materials,
            alpha,
            lights,
        };
        let errors = RuntimeErrors::default();
        let tracer = PathTracer { scene: &scene, errors: &errors, with_features: false };
        let probes = tracer.probe_lights();
        if errors.any() {
            return Err(exhausted_budgets(&scene.compiled, &errors));
        }
        scene.lights.select_by(&probes);
        Ok(scene)
    }
}

impl BatchScene {
    /// True if rays may pass surfaces because of alpha textures.
    pub(super) fn has_alpha(&self) -> bool {
        !self.alpha.classes.is_empty()
    }

    /// True if any material has only `shade`.
    pub(super) fn has_shade(&self) -> bool {
        self.groups.iter().any(|group| group.material.shade.is_some())
    }

    /// True if any surface reads the ray's footprint.
    pub(super) fn has_footprints(&self) -> bool {
        self.groups.iter().any(|group| group.needs.footprints)
    }

    /// Returns the greatest number of scratch arrays of a shader.
    pub(super) fn scratch_arrays(&self) -> usize {
        self.compiled.scratch_arrays
    }
}

/// True if surfaces of a scene have only `shade`.
pub(crate) fn has_shade(engine: &Engine, scene: &Scene) -> bool {
    scene.objects.iter().any(|object| {
        let material = match is_own_material(object) {
            true => &object.primitive,
            false => &scene.materials[object.material as usize],
        };
        let program = engine.program(material);
        program.has(Method::Shade) && !program.has(Method::SampleBsdf)
    })
}

/// Warns about materials that have only `shade`.
fn warn_of_shade(
    groups: &[SurfaceGroup],
    compiled: &CompiledScene,
    materials: &InstanceClasses,
    messages: &mut Messages,
) {
    let shading = groups.iter().filter(|group| group.material.shade.is_some());
    let classes: BTreeSet<&str> = shading
        .map(|group| match group.key.material.0 {
            MaterialSource::Own => compiled.classes[group.key.class as usize].name.as_str(),
            MaterialSource::Class(class) => {
                materials.classes[class as usize].program.class().name.as_str()
            }
        })
        .collect();
    for class in classes {
        let message = format!("`{class}` has only `shade`, which does not support path tracing");
        messages.push_one(
            Diagnostic::new(codes::SHADE_ONLY, message).note(
                "the image shows the light that `shade` computes, which may not be all of it",
            ),
        );
    }
}

fn failed(messages: &mut Messages, diagnostics: Diagnostics) -> Messages {
    messages.push(SourceMap::new(), diagnostics);
    std::mem::take(messages)
}

/// Returns every object with its index in the traversal's classes.
fn members(compiled: &CompiledScene) -> Vec<GroupMember> {
    let members = compiled.items.iter().flat_map(|items| items.members());
    let mut members: Vec<GroupMember> = members.copied().collect();
    members.sort_unstable_by_key(|member| member.object);
    members
}

/// The classes of the parts of surfaces.
#[derive(Clone, Copy)]
struct Classes<'a> {
    compiled: &'a CompiledScene,
    materials: &'a InstanceClasses,
    alpha: &'a InstanceClasses,
}

impl<'a> Classes<'a> {
    /// Returns the programs and instances of a group.
    fn parts_of(&self, key: &GroupKey) -> GroupParts<'a> {
        let class = &self.compiled.classes[key.class as usize];
        let class_sizes =
            |classes: &'a InstanceClasses, class: u32| -> (&'a Arc<Program>, &'a Objects) {
                let class = &classes.classes[class as usize];
                (&class.program, &class.objects)
            };
        let material = match key.material.0 {
            MaterialSource::Own => (class.program(), &*class.objects),
            MaterialSource::Class(number) => class_sizes(self.materials, number),
        };
        GroupParts {
            class,
            material,
            emitter: key.emitter.map(|(class, _)| class_sizes(self.materials, class)),
            alpha: key.alpha.map(|(class, _)| class_sizes(self.alpha, class)),
        }
    }
}

/// The groups, and the group of each object.
struct GroupPlan {
    keys: Vec<GroupKey>,
    objects: Vec<ObjectEntry>,
}

impl GroupPlan {
    fn new(scene: &Scene, classes: Classes<'_>, members: &[GroupMember]) -> Self {
        // Indices of alpha textures, in the order of the objects that have them.
        let mut alpha_indices = 0_usize..;
        let mut class_sizes: BTreeMap<u32, usize> = BTreeMap::new();
        for member in members {
            *class_sizes.entry(member.class).or_default() += 1;
        }
        let planned: Vec<(GroupMember, Planned)> = members
            .iter()
            .map(|member| {
                let is_alone = class_sizes[&member.class] <= MAX_OBJECTS_ALONE;
                let has_alpha = scene.objects[member.object as usize].alpha.is_some();
                let alpha_index = if has_alpha { alpha_indices.next() } else { None };
                (*member, Planned::new(scene, classes, *member, is_alone, alpha_index))
            })
            .collect();
        // The instances of materials, emitters and alpha textures in each group.
        let mut numbers: BTreeMap<GroupSeed, [BTreeSet<u32>; 3]> = BTreeMap::new();
        for (_, planned) in &planned {
            let [of_material, of_emitter, of_alpha] = numbers.entry(planned.seed).or_default();
            of_material.insert(planned.entry.material);
            of_emitter.insert(planned.entry.emitter);
            of_alpha.insert(planned.entry.alpha);
        }
        let mut by_key: BTreeMap<GroupKey, u32> = BTreeMap::new();
        let mut objects = vec![ObjectEntry::default(); scene.objects.len()];
        for (member, planned) in &planned {
            let key = planned.seed.key(numbers[&planned.seed].each_ref().map(of));
            let next = by_key.len() as u32;
            let group = *by_key.entry(key).or_insert(next);
            objects[member.object as usize] = ObjectEntry { group, ..planned.entry };
        }
        let mut keys: Vec<(u32, GroupKey)> =
            by_key.into_iter().map(|(key, group)| (group, key)).collect();
        keys.sort_unstable_by_key(|(group, _)| *group);
        GroupPlan { keys: keys.into_iter().map(|(_, key)| key).collect(), objects }
    }
}

/// Selects one instance if it is the only one.
fn of(numbers: &BTreeSet<u32>) -> Batching {
    match (numbers.first(), numbers.len()) {
        (Some(only), 1) => Batching::One(*only),
        _ => Batching::Each,
    }
}

/// A group before the instances of its classes are known.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct GroupSeed {
    class: u32,
    shape: Batching,
    material: MaterialSource,
    emitter: Option<u32>,
    alpha: Option<u32>,
    is_sampled: bool,
}

impl GroupSeed {
    fn key(self, [material, emitter, alpha]: [Batching; 3]) -> GroupKey {
        let of_material = match self.material {
            // The material is the shape, with the same indices.
            MaterialSource::Own => self.shape,
            MaterialSource::Class(_) => material,
        };
        GroupKey {
            class: self.class,
            shape: self.shape,
            material: (self.material, of_material),
            emitter: self.emitter.map(|class| (class, emitter)),
            alpha: self.alpha.map(|class| (class, alpha)),
            is_sampled: self.is_sampled,
        }
    }
}

/// An object with the seed of its group.
struct Planned {
    seed: GroupSeed,
    entry: ObjectEntry,
}

impl Planned {
    fn new(
        scene: &Scene,
        classes: Classes<'_>,
        member: GroupMember,
        is_alone: bool,
        alpha_index: Option<usize>,
    ) -> Self {
        let Classes { compiled, materials, alpha } = classes;
        let object = &scene.objects[member.object as usize];
        let class = &compiled.classes[member.class as usize];
        let number = class.number_of(member.object, 0).unwrap_or(0);
        let is_one = is_alone && !class.has_elements();
        let (material, material_number) = match is_own_material(object) {
            true => (MaterialSource::Own, 0),
            false => {
                let (class, number) = materials.numbers[object.material as usize];
                (MaterialSource::Class(class), number)
            }
        };
        let emitter = object.emitter.map(|emitter| materials.numbers[emitter as usize]);
        let alpha = alpha_index.map(|texture| alpha.numbers[texture]);
        Planned {
            seed: GroupSeed {
                class: member.class,
                shape: if is_one { Batching::One(number) } else { Batching::Each },
                material,
                emitter: emitter.map(|(class, _)| class),
                alpha: alpha.map(|(class, _)| class),
                is_sampled: emitter.is_some_and(|(emitter, _)| {
                    is_sampled(&materials.classes[emitter as usize].program, class.program())
                }),
            },
            entry: ObjectEntry {
                group: 0,
                material: material_number,
                emitter: emitter.map_or(0, |(_, number)| number),
                alpha: alpha.map_or(0, |(_, number)| number),
                class: member.class,
                number,
                first_item: member.first,
            },
        }
    }
}
