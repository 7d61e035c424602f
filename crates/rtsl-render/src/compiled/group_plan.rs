//! The surface groups of a scene.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rtsl::{Objects, Program};
use rtsl_scene::Scene;

use super::CompiledScene;
use super::instance_classes::{InstanceClassId, InstanceClasses};
use super::kernels::Batching;
use super::material::MaterialSource;
use super::object::is_own_material;
use super::object_entry::ObjectEntry;
use super::placed_objects::GroupMember;
use super::surface_group::{GroupKey, GroupParts};
use crate::lights::is_sampled;

/// In classes with at most so many objects, each is called separately: its members are then read once.
const MAX_OBJECTS_ALONE: usize = 8;

/// The classes of the parts of surfaces.
#[derive(Clone, Copy)]
pub struct Classes<'a> {
    /// The traversal classes of shapes.
    pub compiled: &'a CompiledScene,
    /// The classes of materials and emitters.
    pub materials: &'a InstanceClasses,
    /// The classes of alpha textures.
    pub alpha: &'a InstanceClasses,
}

impl<'a> Classes<'a> {
    /// Returns the program whose methods are a group's material.
    pub fn material_of(&self, key: &GroupKey) -> &'a Arc<Program> {
        match key.material.0 {
            MaterialSource::Own => self.compiled.class(key.class).program(),
            MaterialSource::Class(class) => &self.materials[class].program,
        }
    }

    /// Returns the programs and instances of a group.
    pub fn parts_of(&self, key: &GroupKey) -> GroupParts<'a> {
        let class = self.compiled.class(key.class);
        let class_sizes = |classes: &'a InstanceClasses,
                           class: InstanceClassId|
         -> (&'a Arc<Program>, &'a Objects) {
            let class = &classes[class];
            (&class.program, &class.objects)
        };
        let material = match key.material.0 {
            MaterialSource::Own => (class.program(), &*class.objects),
            MaterialSource::Class(index) => class_sizes(self.materials, index),
        };
        GroupParts {
            compiled: self.compiled,
            material,
            emitter: key.emitter.map(|(class, _)| class_sizes(self.materials, class)),
            alpha: key.alpha.map(|(class, _)| class_sizes(self.alpha, class)),
        }
    }
}

/// The groups, and the group of each object.
pub struct GroupPlan {
    /// The keys of the groups, by index.
    pub keys: Vec<GroupKey>,
    /// The entries of the objects.
    pub objects: Vec<ObjectEntry>,
}

impl GroupPlan {
    /// Groups the objects of a scene.
    pub fn new(scene: &Scene, classes: Classes<'_>) -> Self {
        let members = members(classes.compiled);
        // Indices of alpha textures, in the order of the objects that have them.
        let mut alpha_indices = 0_usize..;
        let mut class_sizes: BTreeMap<u32, usize> = BTreeMap::new();
        for member in &members {
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
        let mut instances: BTreeMap<GroupSeed, [BTreeSet<u32>; 3]> = BTreeMap::new();
        for (_, planned) in &planned {
            let [of_material, of_emitter, of_alpha] = instances.entry(planned.seed).or_default();
            of_material.insert(planned.entry.material);
            of_emitter.insert(planned.entry.emitter);
            of_alpha.insert(planned.entry.alpha);
        }
        let mut by_key: BTreeMap<GroupKey, u32> = BTreeMap::new();
        let mut objects = vec![ObjectEntry::default(); scene.objects.len()];
        for (member, planned) in &planned {
            let key = planned.seed.key(instances[&planned.seed].each_ref().map(of));
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
fn of(instances: &BTreeSet<u32>) -> Batching {
    match (instances.first(), instances.len()) {
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
    emitter: Option<InstanceClassId>,
    alpha: Option<InstanceClassId>,
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
        let class = compiled.class(member.class);
        let index = class.index_of(member.object, 0).unwrap_or(0);
        let is_one = is_alone && !class.has_elements();
        let (material, material_index) = match is_own_material(object) {
            true => (MaterialSource::Own, 0),
            false => {
                let (class, index) = materials.place(object.material as usize);
                (MaterialSource::Class(class), index)
            }
        };
        let emitter = object.emitter.map(|emitter| materials.place(emitter as usize));
        let alpha = alpha_index.map(|texture| alpha.place(texture));
        Planned {
            seed: GroupSeed {
                class: member.class,
                shape: if is_one { Batching::One(index) } else { Batching::Each },
                material,
                emitter: emitter.map(|(class, _)| class),
                alpha: alpha.map(|(class, _)| class),
                is_sampled: emitter.is_some_and(|(emitter, _)| {
                    is_sampled(&materials[emitter].program, class.program(), object.elements)
                }),
            },
            entry: ObjectEntry {
                group: 0,
                material: material_index,
                emitter: emitter.map_or(0, |(_, index)| index),
                alpha: alpha.map_or(0, |(_, index)| index),
                class: member.class,
                index,
            },
        }
    }
}

/// Returns every object with its index in the traversal's classes.
fn members(compiled: &CompiledScene) -> Vec<GroupMember> {
    let members = compiled.items.iter().flat_map(|items| items.members());
    let mut members: Vec<GroupMember> = members.copied().collect();
    members.sort_unstable_by_key(|member| member.object);
    members
}
