//! The objects of a scene as items of groups, with trees over them.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::Diagnostic;
use rtsl_bvh::{Bounds, Geometry, Group, HitId, INSTANCE, Instance, Item};
use rtsl_math::MovingTransform;
use rtsl_scene::{PlacedGroup, Scene, SceneObject};

use super::compiled_scene::{Object, inverse};
use super::object_class::{ObjectClass, objects_in_order};
use super::shaders::Shader;

/// The objects of a scene as items of groups. This much is the same for scenes with the same shapes.
pub struct PlacedObjects {
    /// What the items of the groups are: first the scene's, then those of the scene's groups, then objects
    /// that move, each a group of its own.
    pub groups: Vec<GroupItems>,
    /// Where groups stand: first the scene's instances, then the objects that move.
    pub instances: Vec<PlacedGroup>,
    /// The classes, by their numbers.
    keys: Vec<ClassKey>,
}

/// What the items of a group are: an item for each object, or for each of its elements, in their
/// order. In the scene's group the instances follow.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GroupItems {
    members: Vec<GroupMember>,
    /// How many items they are.
    count: u32,
}

/// An object of a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GroupMember {
    /// The number of the object.
    pub object: u32,
    /// The first of its items.
    pub first: u32,
    /// The number of its class.
    pub class: u32,
}

/// What objects of one class have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct ClassKey {
    /// The number of the group.
    group: usize,
    /// The number of the shader.
    shader: usize,
    /// Whether its space is not its group's.
    is_placed: bool,
    /// The object whose elements they are, and the first of their items.
    elements: Option<(u32, u32)>,
}

impl GroupItems {
    /// The objects.
    pub fn members(&self) -> &[GroupMember] {
        &self.members
    }

    /// How many items there are.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The object that an item belongs to.
    pub fn member(&self, item: u32) -> Option<GroupMember> {
        if item >= self.count {
            return None;
        }
        // Where every object is one item, it is the one with the item's number.
        let guess = self.members.get(item as usize).filter(|member| member.first == item);
        guess.copied().or_else(|| {
            let after = self.members.partition_point(|member| member.first <= item);
            self.members.get(after.checked_sub(1)?).copied()
        })
    }
}

impl PlacedObjects {
    /// The objects of a scene.
    pub fn new(scene: &Scene, objects: &[Object]) -> PlacedObjects {
        let mut numbers = ClassNumbers::default();
        let Groups { groups, instances } = Groups::of(scene);
        let groups = groups.iter().enumerate().map(|(group, members)| {
            let mut items = GroupItems::default();
            for object in members {
                let elements = scene.objects[*object as usize].elements;
                let placed = &objects[*object as usize];
                let key = ClassKey {
                    group,
                    shader: placed.primitive.shader,
                    is_placed: !placed.inverse.is_identity(),
                    elements: elements.map(|_| (*object, items.count)),
                };
                let class = numbers.number(key);
                items.members.push(GroupMember { object: *object, first: items.count, class });
                items.count += elements.unwrap_or(1);
            }
            items
        });
        PlacedObjects { groups: groups.collect(), instances, keys: numbers.into_keys() }
    }

    /// Builds the trees, or takes those of a scene with the same items and lets them follow. `bounds` are
    /// those of each object, or of its elements, in the space of the object's group.
    pub fn geometry(
        &self,
        bounds: &[Vec<Option<Bounds>>],
        earlier: Option<(&Geometry, &[GroupItems])>,
    ) -> Geometry {
        let earlier = earlier.filter(|(geometry, groups)| self.has_same_items(geometry, groups));
        let group = |number: usize, items: Vec<Item>| match earlier {
            Some((geometry, _)) => geometry.groups[number].moved(items),
            None => Group::new(items),
        };
        let items = |group: &GroupItems| -> Vec<Item> {
            let items = group.members.iter().flat_map(|member| {
                let bounds = bounds[member.object as usize].iter();
                bounds.map(|bounds| Item { bounds: *bounds, class: member.class })
            });
            items.collect()
        };
        let mut lists = self.groups.iter().map(items);
        let mut world = lists.next().unwrap_or_default();
        let placed: Vec<Group> = (1..).zip(lists).map(|(number, it)| group(number, it)).collect();
        let first_instance = world.len() as u32;
        let instances = self.add_instances(&placed, &mut world);
        let groups = std::iter::once(group(0, world)).chain(placed).collect();
        Geometry { groups, instances, first_instance }
    }

    /// Whether all items are what those of another scene are, wherever they stand.
    fn has_same_items(&self, geometry: &Geometry, groups: &[GroupItems]) -> bool {
        self.groups == groups && self.instances.len() == geometry.instances.len()
    }

    /// Adds the instances behind the world's objects.
    fn add_instances(&self, placed: &[Group], world: &mut Vec<Item>) -> Vec<Instance> {
        let instances = self.instances.iter().map(|instance| {
            let PlacedGroup { group, transform, motion } = instance;
            let placed = &placed[*group as usize];
            let own = placed.bounds();
            let bounds = match motion {
                // There is nothing to hit: a box that nothing meets.
                _ if placed.is_empty() => Some(Bounds::NOWHERE),
                None => own.and_then(|bounds| bounds.transformed(*transform)),
                Some(motion) => own.and_then(|bounds| bounds.moved(motion)),
            };
            world.push(Item { bounds, class: INSTANCE });
            Instance { group: group + 1, inverse: inverse(*transform), motion: motion.clone() }
        });
        instances.collect()
    }

    /// Compiles what the classes of elements need. What goes wrong here does so again, and is said, where the
    /// classes are made.
    pub fn prepare_classes(&self, scene: &Scene, objects: &[Object], shaders: &[Shader]) {
        for key in &self.keys {
            if let Some((object, _)) = key.elements {
                let inverse = &objects[object as usize].inverse;
                let object = &scene.objects[object as usize];
                let _ = ObjectClass::prepare_elements(&shaders[key.shader], object, inverse);
            }
        }
    }

    /// What blocks of the trees name as their classes.
    ///
    /// # Errors
    /// If kernels or elements can't be made.
    pub fn classes(
        &self,
        geometry: &Geometry,
        scene: &Scene,
        objects: &[Object],
        shaders: &[Shader],
    ) -> Result<Vec<ObjectClass>, Diagnostic> {
        let classes = self.keys.iter().enumerate().map(|(class, key)| {
            let (shader, class) = (&shaders[key.shader], class as u32);
            let tree = &geometry.groups[key.group].tree;
            let placed = |object: u32| {
                let scene_object: &SceneObject = &scene.objects[object as usize];
                (scene_object.primitive.clone(), objects[object as usize].inverse)
            };
            match key.elements {
                Some((object, first)) => {
                    let (_, inverse) = placed(object);
                    let object = &scene.objects[object as usize];
                    ObjectClass::of_elements(shader, object, &inverse, (tree, class), first)
                }
                None => {
                    let items = &self.groups[key.group];
                    let object = |item| Some(items.member(item)?.object);
                    let numbers = objects_in_order(tree, class, object);
                    ObjectClass::of_objects(shader, key.is_placed, numbers, placed)
                }
            }
        });
        classes.collect()
    }
}

/// The objects of each group, and where groups stand.
struct Groups {
    groups: Vec<Vec<u32>>,
    instances: Vec<PlacedGroup>,
}

impl Groups {
    fn of(scene: &Scene) -> Self {
        let motion = |object: u32| scene.objects[object as usize].motion.as_ref();
        let still = |members: &Vec<u32>| {
            members.iter().copied().filter(|object| motion(*object).is_none()).collect()
        };
        let groups = std::iter::once(&scene.world).chain(&scene.groups).map(still);
        let mut all = Groups { groups: groups.collect(), instances: scene.instances.clone() };
        for (object, motion) in scene.world.iter().filter_map(|it| Some((*it, motion(*it)?))) {
            let group = all.add_group(object);
            all.add_moving(group, motion.clone());
        }
        for (number, members) in scene.groups.iter().enumerate() {
            let placed = || scene.instances.iter().filter(|it| it.group as usize == number);
            for (object, motion) in members.iter().filter_map(|it| Some((*it, motion(*it)?))) {
                let group = all.add_group(object);
                for instance in placed() {
                    let outer = instance.motion.as_deref().cloned();
                    let outer = outer.unwrap_or_else(|| instance.transform.into());
                    all.add_moving(group, Arc::new(outer.after(motion)));
                }
            }
        }
        all
    }

    /// Adds a group of one object; returns its number as instances count.
    fn add_group(&mut self, object: u32) -> u32 {
        self.groups.push(vec![object]);
        self.groups.len() as u32 - 2
    }

    fn add_moving(&mut self, group: u32, motion: Arc<MovingTransform>) {
        let transform = motion.keys()[0];
        self.instances.push(PlacedGroup { group, transform, motion: Some(motion) });
    }
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

/// What a hit is of.
#[derive(Clone, Copy, Debug)]
pub struct HitObject {
    /// The object.
    pub member: GroupMember,
    /// Which of its elements.
    pub element: u32,
    /// The number of the instance of the scene that places it.
    pub instance: Option<u32>,
}

impl HitObject {
    /// What an id names; `None` for no hit.
    pub fn of(geometry: &Geometry, groups: &[GroupItems], id: HitId) -> Option<HitObject> {
        if id == HitId::NONE {
            return None;
        }
        let (group, item, instance) = match id.outer().checked_sub(geometry.first_instance) {
            None => (0, id.outer(), None),
            Some(instance) => {
                let group = geometry.instances.get(instance as usize)?.group;
                (group as usize, id.inner(), Some(instance))
            }
        };
        let member = groups.get(group)?.member(item)?;
        Some(HitObject { member, element: item - member.first, instance })
    }
}
