//! The objects of a scene in groups, with trees over them, and their members in the trees' order.

use std::collections::BTreeMap;

use crate::acceleration::{Bounds, Geometry, Group, HitId, INSTANCE, Instance, Item};
use crate::scene::Scene;

use super::compiled::{Object, inverse};
use super::object_class::{ClassKey, ObjectClass};
use super::shaders::Shader;

/// The objects of a scene as items of groups. This much is the same for scenes with the same shapes.
pub struct PlacedObjects {
    /// What the items of the groups are.
    pub items: Vec<GroupItems>,
    /// The classes of the items, group by group.
    item_classes: Vec<Vec<u32>>,
    /// The classes, by their numbers.
    keys: Vec<ClassKey>,
}

/// What the items of a group are. In the scene's group the instances follow.
#[derive(Clone, Debug)]
pub struct GroupItems {
    objects: Vec<u32>,
}

impl GroupItems {
    /// The object that an item is, if it is one.
    pub fn object(&self, item: u32) -> Option<u32> {
        self.objects.get(item as usize).copied()
    }
}

impl PlacedObjects {
    /// The objects of a scene.
    pub fn new(scene: &Scene, objects: &[Object]) -> PlacedObjects {
        let mut numbers = ClassNumbers::default();
        let groups = || std::iter::once(&scene.world).chain(&scene.groups);
        let item_classes = groups().enumerate().map(|(number, group)| {
            let key = |object: &u32| ClassKey::of(number, &objects[*object as usize]);
            group.iter().map(|object| numbers.number(key(object))).collect()
        });
        PlacedObjects {
            item_classes: item_classes.collect(),
            items: groups().map(|group| GroupItems { objects: group.clone() }).collect(),
            keys: numbers.into_keys(),
        }
    }

    /// Builds the trees. `own_bounds` are in the spaces of the objects' groups.
    pub fn geometry(&self, scene: &Scene, own_bounds: &[Option<Bounds>]) -> Geometry {
        let mut item_lists = self.items.iter().zip(&self.item_classes).map(|(items, classes)| {
            let item = |(object, class): (&u32, &u32)| Item {
                bounds: own_bounds[*object as usize],
                class: *class,
            };
            items.objects.iter().zip(classes).map(item).collect::<Vec<Item>>()
        });
        let mut world = item_lists.next().unwrap_or_default();
        let placed: Vec<Group> = item_lists.map(Group::new).collect();
        let first_instance = world.len() as u32;
        let instances = add_instances(scene, &placed, &mut world);
        let groups = std::iter::once(Group::new(world)).chain(placed).collect();
        Geometry { groups, instances, first_instance }
    }

    /// What blocks of the trees name as their classes.
    pub fn classes(
        &self,
        geometry: &Geometry,
        objects: &[Object],
        shaders: &[Shader],
    ) -> Vec<ObjectClass> {
        let classes = self.keys.iter().enumerate().map(|(class, key)| {
            ObjectClass::new(
                &geometry.groups[key.group].tree,
                class as u32,
                key.is_placed,
                &shaders[key.shader],
                |item| self.items[key.group].object(item).unwrap_or_default(),
                |object| objects[object as usize].primitive.block.clone(),
            )
        });
        classes.collect()
    }
}

/// Adds the instances behind the world's objects.
fn add_instances(scene: &Scene, placed: &[Group], world: &mut Vec<Item>) -> Vec<Instance> {
    let mut instances = Vec::with_capacity(scene.instances.len());
    for instance in &scene.instances {
        let group = &placed[instance.group as usize];
        let bounds = match group.is_empty() {
            // There is nothing to hit: a box that nothing meets.
            true => Some(Bounds::NOWHERE),
            false => group.bounds().and_then(|bounds| bounds.transformed(instance.transform)),
        };
        world.push(Item { bounds, class: INSTANCE });
        instances
            .push(Instance { group: instance.group + 1, inverse: inverse(instance.transform) });
    }
    instances
}

/// Numbers for classes, in the order in which they are met.
#[derive(Default)]
struct ClassNumbers {
    numbers: BTreeMap<ClassKey, u32>,
}

impl ClassNumbers {
    fn number(&mut self, key: ClassKey) -> u32 {
        let next = self.numbers.len() as u32;
        *self.numbers.entry(key).or_insert(next)
    }

    /// The classes by their numbers.
    fn into_keys(self) -> Vec<ClassKey> {
        let mut keys: Vec<(u32, ClassKey)> =
            self.numbers.into_iter().map(|(key, number)| (number, key)).collect();
        keys.sort_unstable();
        keys.into_iter().map(|(_, key)| key).collect()
    }
}

/// Which object a hit is of, and by which instance of the scene it is placed.
#[derive(Clone, Copy, Debug)]
pub struct HitObject {
    /// The number of the object.
    pub object: u32,
    /// The number of the instance.
    pub instance: Option<u32>,
}

impl HitObject {
    /// What an id names; `None` for no hit.
    pub fn of(geometry: &Geometry, items: &[GroupItems], id: HitId) -> Option<HitObject> {
        if id == HitId::NONE {
            return None;
        }
        let world = items.first()?;
        let Some(instance) = id.outer().checked_sub(geometry.first_instance) else {
            return Some(HitObject { object: world.object(id.outer())?, instance: None });
        };
        let group = geometry.instances.get(instance as usize)?.group as usize;
        let object = items.get(group)?.object(id.inner())?;
        Some(HitObject { object, instance: Some(instance) })
    }
}
