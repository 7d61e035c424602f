//! A scene ready for path tracing: what rays hit, by groups of surfaces, and what lights them.

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
use crate::compiled::{BuildStep, CompiledScene};

/// Of classes with no more objects than this each is called for by itself: what its methods read of it is read
/// once.
const MAX_OBJECTS_ALONE: usize = 8;

/// A scene ready for path tracing.
pub struct BatchScene {
    /// What rays are traced against, and how.
    pub compiled: CompiledScene,
    /// The time that kernels took.
    pub compile_time: Duration,
    /// The groups.
    pub(super) groups: Vec<SurfaceGroup>,
    /// What is known of each object.
    pub(super) objects: Vec<ObjectEntry>,
    /// The materials.
    pub(super) materials: InstanceClasses,
    /// The textures that cut out shapes.
    pub(super) alpha: InstanceClasses,
    /// The lights.
    pub(super) lights: Lights,
}

/// What is known of an object.
#[derive(Clone, Copy, Debug, Default)]
pub struct ObjectEntry {
    /// Its group.
    pub group: u32,
    /// The number of its material among those of its class.
    pub material: u32,
    /// The number of its emitter among those of its class.
    pub emitter: u32,
    /// The number of the texture that cuts it out among those of its class.
    pub cut_out: u32,
    /// The class of the traversal that it, or its elements, belong to.
    pub class: u32,
    /// Its number there; elements have their own.
    pub number: u32,
    /// The first of its items in its group.
    pub first_item: u32,
}

impl BatchScene {
    /// Makes kernels for a scene and builds its acceleration structure. Warnings go to `messages`; `listener` is
    /// told what comes next.
    ///
    /// # Errors
    /// If a class lacks a method that its use needs, or a kernel can't be made.
    pub fn new(
        scene: &Scene,
        engine: &Engine,
        messages: &mut Messages,
        listener: &dyn Fn(BuildStep),
    ) -> Result<Self, Messages> {
        let compiled = if has_shade(engine, scene) {
            CompiledScene::with_progress(scene.clone(), engine, messages, listener)?
        } else {
            CompiledScene::for_searches(scene.clone(), engine, messages, listener)?
        };
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
        let ((groups, lights), problems) = made.map_err(|problems| failed(messages, problems))?;
        messages.push(SourceMap::new(), problems);
        // Paths go every way, so that searches want them all at once.
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
        let problems = RuntimeErrors::default();
        let tracer = PathTracer { scene: &scene, problems: &problems, with_features: false };
        let probes = tracer.probe_lights();
        if problems.any() {
            return Err(exhausted_budgets(&scene.compiled, &problems));
        }
        scene.lights.select_by(&probes);
        Ok(scene)
    }
}

impl BatchScene {
    /// Whether rays pass through some of what they hit.
    pub(super) fn has_cut_outs(&self) -> bool {
        !self.alpha.classes.is_empty()
    }

    /// Whether any material has nothing but `shade`.
    pub(super) fn has_shade(&self) -> bool {
        self.groups.iter().any(|group| group.material.shade.is_some())
    }

    /// Whether any surface asks how wide rays are.
    pub(super) fn has_footprints(&self) -> bool {
        self.groups.iter().any(|group| group.needs.footprints)
    }

    /// The greatest number of arrays of scratch of a shader.
    pub(super) fn scratch_arrays(&self) -> usize {
        self.compiled.scratch_arrays
    }
}

/// Whether surfaces of a scene have nothing but `shade`.
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

/// Says which materials have nothing but `shade`.
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
        let message = format!("`{class}` has nothing but `shade`, which runs as it stands");
        messages.push_one(
            Diagnostic::new(codes::SHADE_ONLY, message)
                .note("its picture is what it computes, whether that is all light or not"),
        );
    }
}

fn failed(messages: &mut Messages, problems: Diagnostics) -> Messages {
    messages.push(SourceMap::new(), problems);
    std::mem::take(messages)
}

/// Every object with its place among the traversal's classes.
fn members(compiled: &CompiledScene) -> Vec<GroupMember> {
    let members = compiled.items.iter().flat_map(|items| items.members());
    let mut members: Vec<GroupMember> = members.copied().collect();
    members.sort_unstable_by_key(|member| member.object);
    members
}

/// The classes of all that surfaces are made of.
#[derive(Clone, Copy)]
struct Classes<'a> {
    compiled: &'a CompiledScene,
    materials: &'a InstanceClasses,
    alpha: &'a InstanceClasses,
}

impl<'a> Classes<'a> {
    /// The programs and instances of a group.
    fn parts_of(&self, key: &GroupKey) -> GroupParts<'a> {
        let class = &self.compiled.classes[key.class as usize];
        let of_class =
            |classes: &'a InstanceClasses, class: u32| -> (&'a Arc<Program>, &'a Objects) {
                let class = &classes.classes[class as usize];
                (&class.program, &class.objects)
            };
        let material = match key.material.0 {
            MaterialSource::Own => (class.program(), &*class.objects),
            MaterialSource::Class(number) => of_class(self.materials, number),
        };
        GroupParts {
            class,
            material,
            emitter: key.emitter.map(|(class, _)| of_class(self.materials, class)),
            cut_out: key.cut_out.map(|(class, _)| of_class(self.alpha, class)),
        }
    }
}

/// Which groups there are, and which object is in which.
struct GroupPlan {
    keys: Vec<GroupKey>,
    objects: Vec<ObjectEntry>,
}

impl GroupPlan {
    fn new(scene: &Scene, classes: Classes<'_>, members: &[GroupMember]) -> Self {
        // Of the objects with cut-outs, in their order.
        let mut with_cut_outs = 0_usize..;
        let mut of_class: BTreeMap<u32, usize> = BTreeMap::new();
        for member in members {
            *of_class.entry(member.class).or_default() += 1;
        }
        let planned: Vec<(GroupMember, Planned)> = members
            .iter()
            .map(|member| {
                let is_alone = of_class[&member.class] <= MAX_OBJECTS_ALONE;
                let has_cut_out = scene.objects[member.object as usize].alpha.is_some();
                let cut_out = if has_cut_out { with_cut_outs.next() } else { None };
                (*member, Planned::new(scene, classes, *member, is_alone, cut_out))
            })
            .collect();
        // Of which materials the surfaces of a group are.
        let mut numbers: BTreeMap<GroupSeed, [BTreeSet<u32>; 3]> = BTreeMap::new();
        for (_, planned) in &planned {
            let [of_material, of_emitter, of_cut_out] = numbers.entry(planned.rough).or_default();
            of_material.insert(planned.entry.material);
            of_emitter.insert(planned.entry.emitter);
            of_cut_out.insert(planned.entry.cut_out);
        }
        let mut by_key: BTreeMap<GroupKey, u32> = BTreeMap::new();
        let mut objects = vec![ObjectEntry::default(); scene.objects.len()];
        for (member, planned) in &planned {
            let key = planned.rough.key(numbers[&planned.rough].each_ref().map(of));
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

/// One instance, if it is the only one.
fn of(numbers: &BTreeSet<u32>) -> Batching {
    match (numbers.first(), numbers.len()) {
        (Some(only), 1) => Batching::One(*only),
        _ => Batching::Each,
    }
}

/// A group, but for which of their classes' instances the surfaces have.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct GroupSeed {
    class: u32,
    shape: Batching,
    material: MaterialSource,
    emitter: Option<u32>,
    cut_out: Option<u32>,
    is_sampled: bool,
}

impl GroupSeed {
    fn key(self, [material, emitter, cut_out]: [Batching; 3]) -> GroupKey {
        let of_material = match self.material {
            // The shape's numbers are the material's.
            MaterialSource::Own => self.shape,
            MaterialSource::Class(_) => material,
        };
        GroupKey {
            class: self.class,
            shape: self.shape,
            material: (self.material, of_material),
            emitter: self.emitter.map(|class| (class, emitter)),
            cut_out: self.cut_out.map(|class| (class, cut_out)),
            is_sampled: self.is_sampled,
        }
    }
}

/// An object with its group to be.
struct Planned {
    rough: GroupSeed,
    entry: ObjectEntry,
}

impl Planned {
    fn new(
        scene: &Scene,
        classes: Classes<'_>,
        member: GroupMember,
        is_alone: bool,
        cut_out: Option<usize>,
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
        let cut_out = cut_out.map(|texture| alpha.numbers[texture]);
        Planned {
            rough: GroupSeed {
                class: member.class,
                shape: if is_one { Batching::One(number) } else { Batching::Each },
                material,
                emitter: emitter.map(|(class, _)| class),
                cut_out: cut_out.map(|(class, _)| class),
                is_sampled: emitter.is_some_and(|(emitter, _)| {
                    is_sampled(&materials.classes[emitter as usize].program, class.program())
                }),
            },
            entry: ObjectEntry {
                group: 0,
                material: material_number,
                emitter: emitter.map_or(0, |(_, number)| number),
                cut_out: cut_out.map_or(0, |(_, number)| number),
                class: member.class,
                number,
                first_item: member.first,
            },
        }
    }
}
