//! A scene ready for path tracing: what rays hit, by groups of surfaces, and what lights them.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rtsl::{
    Diagnostic, Diagnostics, Engine, Method, Objects, Program, SourceMap, diagnostic_codes as codes,
};

use crate::compiled::placed_objects::GroupMember;
use crate::compiled::problems::{Problems, exhausted_budgets};
use crate::compiled::shaders::is_own_material;
use crate::compiled::{BuildStep, CompiledScene};
use crate::messages::Messages;
use crate::scene::{Scene, SceneObject};

use super::kernels::{KernelMaker, Of};
use super::lights::Lights;
use super::material::{MaterialClasses, MaterialSource};
use super::surface_group::{GroupKey, GroupParts, SurfaceGroup};
use super::tracer::PathTracer;

/// Of classes with no more objects than this each is called for by itself: what its methods read of it is read
/// once.
const FEW_OBJECTS: usize = 8;

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
    pub(super) materials: MaterialClasses,
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
    /// The class of the traversal that it, or its elements, belong to.
    pub class: u32,
    /// Its number there; elements have their own.
    pub number: u32,
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
        let compiled = CompiledScene::for_searches(scene.clone(), engine, messages, listener)?;
        let start = Instant::now();
        let materials = MaterialClasses::new(engine, scene);
        let members = members(&compiled);
        let plan = GroupPlan::new(scene, &compiled, &materials, &members);
        let made = KernelMaker::build_with(engine, |maker| {
            let groups = plan.keys.iter().map(|key| {
                let parts = group_parts(key, &compiled, &materials);
                SurfaceGroup::new(maker, *key, &parts)
            });
            let groups: Vec<SurfaceGroup> = groups.collect();
            (groups, Lights::new(maker, scene, &compiled, &materials, &plan.objects))
        });
        let ((groups, lights), problems) = made.map_err(|problems| failed(messages, problems))?;
        messages.push(SourceMap::new(), problems);
        warn_of_shade(&groups, &compiled, &materials, messages);
        let compile_time = compiled.compile_time + start.elapsed();
        let mut scene =
            BatchScene { compiled, compile_time, groups, objects: plan.objects, materials, lights };
        let problems = Problems::default();
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
    /// The greatest number of arrays of scratch of a shader.
    pub(super) fn scratch_arrays(&self) -> usize {
        self.compiled.scratch_arrays
    }
}

/// Says which materials have nothing but `shade`.
fn warn_of_shade(
    groups: &[SurfaceGroup],
    compiled: &CompiledScene,
    materials: &MaterialClasses,
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
        let message = format!("`{class}` has no `BSDF` or `sampleBSDF`: paths end at it");
        messages.push_one(
            Diagnostic::new(codes::IGNORED_SETTING, message)
                .help("`--renderer interactive` runs its `shade`"),
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

/// The programs and instances of a group.
fn group_parts<'a>(
    key: &GroupKey,
    compiled: &'a CompiledScene,
    materials: &'a MaterialClasses,
) -> GroupParts<'a> {
    let class = &compiled.classes[key.class as usize];
    let of_class = |class: u32| -> (&'a Arc<Program>, &'a Objects) {
        let class = &materials.classes[class as usize];
        (&class.program, &class.objects)
    };
    let material = match key.material.0 {
        MaterialSource::Own => (class.program(), &*class.objects),
        MaterialSource::Class(number) => of_class(number),
    };
    GroupParts { class, material, emitter: key.emitter.map(|(class, _)| of_class(class)) }
}

/// Which groups there are, and which object is in which.
struct GroupPlan {
    keys: Vec<GroupKey>,
    objects: Vec<ObjectEntry>,
}

impl GroupPlan {
    fn new(
        scene: &Scene,
        compiled: &CompiledScene,
        materials: &MaterialClasses,
        members: &[GroupMember],
    ) -> Self {
        let mut of_class: BTreeMap<u32, usize> = BTreeMap::new();
        for member in members {
            *of_class.entry(member.class).or_default() += 1;
        }
        let planned: Vec<(GroupMember, Planned)> = members
            .iter()
            .map(|member| {
                let is_alone = of_class[&member.class] <= FEW_OBJECTS;
                (*member, Planned::new(scene, compiled, materials, *member, is_alone))
            })
            .collect();
        // Of which materials the surfaces of a group are.
        let mut numbers: BTreeMap<Rough, [BTreeSet<u32>; 2]> = BTreeMap::new();
        for (_, planned) in &planned {
            let [of_material, of_emitter] = numbers.entry(planned.rough).or_default();
            of_material.insert(planned.entry.material);
            of_emitter.insert(planned.entry.emitter);
        }
        let mut by_key: BTreeMap<GroupKey, u32> = BTreeMap::new();
        let mut objects = vec![ObjectEntry::default(); scene.objects.len()];
        for (member, planned) in &planned {
            let [of_material, of_emitter] = &numbers[&planned.rough];
            let key = planned.rough.key(of(of_material), of(of_emitter));
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
fn of(numbers: &BTreeSet<u32>) -> Of {
    match (numbers.first(), numbers.len()) {
        (Some(only), 1) => Of::One(*only),
        _ => Of::Each,
    }
}

/// A group, but for which of their classes' instances the surfaces have.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Rough {
    class: u32,
    shape: Of,
    material: MaterialSource,
    emitter: Option<u32>,
    is_sampled: bool,
}

impl Rough {
    fn key(self, material: Of, emitter: Of) -> GroupKey {
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
            is_sampled: self.is_sampled,
        }
    }
}

/// An object with its group to be.
struct Planned {
    rough: Rough,
    entry: ObjectEntry,
}

impl Planned {
    fn new(
        scene: &Scene,
        compiled: &CompiledScene,
        materials: &MaterialClasses,
        member: GroupMember,
        is_alone: bool,
    ) -> Self {
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
        Planned {
            rough: Rough {
                class: member.class,
                shape: if is_one { Of::One(number) } else { Of::Each },
                material,
                emitter: emitter.map(|(class, _)| class),
                is_sampled: is_sampled(object, class.program()),
            },
            entry: ObjectEntry {
                group: 0,
                material: material_number,
                emitter: emitter.map_or(0, |(_, number)| number),
                class: member.class,
                number,
            },
        }
    }
}

/// Whether an object is a light whose samples have densities that hits of it can be asked for.
fn is_sampled(object: &SceneObject, program: &Program) -> bool {
    object.emitter.is_some()
        && program.has(Method::GenerateSample)
        && program.has(Method::SamplePdf)
}
