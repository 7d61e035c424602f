//! The objects of a scene as items of groups, with trees over them.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rtsl::{Diagnostic, Method};
use rtsl_bvh::{Bounds, Geometry, Group, HitId, INSTANCE, Instance, Item};
use rtsl_math::{MovingTransform, Transform};
use rtsl_scene::{PlacedGroup, Scene, SceneObject};

use super::object::Object;
use super::object_class::{ObjectClass, items_in_order};
use super::placement::inverse;
use super::shaders::Shader;

/// The objects of a scene as items of groups. Scenes with the same shapes share them.
pub struct PlacedObjects {
    /// The items of the groups: first the scene's, then those of the scene's groups, then moving objects, each in a
    /// group to itself.
    pub groups: Vec<GroupItems>,
    /// The instances of moving objects, which follow the scene's.
    moving: Vec<PlacedGroup>,
    /// The keys of the classes, by index.
    keys: Vec<ClassKey>,
}

/// The items of a group: one for each object, or for each of its elements, in order. In the scene's group the instances
/// follow.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GroupItems {
    members: Vec<GroupMember>,
    /// The number of items.
    count: u32,
    /// True if not every object is one item.
    has_meshes: bool,
    /// For each [`ITEMS_OF_BLOCK`] items, the index of the object to which the first belongs.
    blocks: Vec<u32>,
}

/// Small, so that few objects share a block, and large, so that the index of a mesh takes little memory.
const ITEMS_OF_BLOCK: u32 = 16;

/// An object of a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GroupMember {
    /// The index of the object.
    pub object: u32,
    /// The index of its first item.
    pub first: u32,
    /// The index of its class.
    pub class: u32,
    /// The class of its items in leaves: the first of those whose elements one kernel tests together.
    pub leaf_class: u32,
}

/// The key of a class: the properties that its objects share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct ClassKey {
    /// The index of the group.
    group: usize,
    /// The index of the shader.
    shader: usize,
    /// True if the objects have transforms to their group's space.
    is_placed: bool,
    /// The object whose elements they are, and the index of its first item.
    elements: Option<(u32, u32)>,
}

impl GroupItems {
    /// Returns the objects.
    pub fn members(&self) -> &[GroupMember] {
        &self.members
    }

    /// Returns the number of items.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Returns the object that an item belongs to.
    #[inline(always)]
    pub fn member(&self, item: u32) -> Option<GroupMember> {
        if self.has_meshes {
            self.find_member(item)
        } else {
            self.members.get(item as usize).copied()
        }
    }

    /// The same if objects have any numbers of items.
    fn find_member(&self, item: u32) -> Option<GroupMember> {
        if item >= self.count {
            return None;
        }
        let block = (item / ITEMS_OF_BLOCK) as usize;
        let start = *self.blocks.get(block)? as usize;
        let end = self.blocks.get(block + 1).map_or(self.members.len(), |next| *next as usize + 1);
        let of_block = self.members.get(start..end)?;
        let after = of_block.partition_point(|member| member.first <= item);
        of_block.get(after.checked_sub(1)?).copied()
    }

    /// Adds an object with so many items.
    fn push(&mut self, object: u32, class: u32, items: u32) {
        let index = self.members.len() as u32;
        self.has_meshes |= items != 1;
        self.members.push(GroupMember { object, first: self.count, class, leaf_class: class });
        self.count += items;
        let blocks = self.count.div_ceil(ITEMS_OF_BLOCK) as usize;
        self.blocks.resize(blocks, index);
    }
}

impl PlacedObjects {
    /// Collects the objects of a scene.
    pub fn new(scene: &Scene, objects: &[Object], shaders: &[Shader]) -> PlacedObjects {
        let mut indices = ClassIndices::default();
        let Groups { groups, moving } = Groups::of(scene);
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
                let class = indices.index(key);
                items.push(*object, class, elements.unwrap_or(1));
            }
            items
        });
        let mut groups: Vec<GroupItems> = groups.collect();
        let keys = indices.into_keys();
        let leaf_classes = leaf_classes(&keys, objects, shaders);
        for member in groups.iter_mut().flat_map(|items| &mut items.members) {
            member.leaf_class = leaf_classes[member.class as usize];
        }
        PlacedObjects { groups, moving, keys }
    }

    /// Returns the instances of groups: first the scene's, then those of moving objects.
    pub fn instances<'s>(&'s self, scene: &'s Scene) -> impl Iterator<Item = &'s PlacedGroup> {
        scene.instances.iter().chain(&self.moving)
    }

    /// Builds the trees, or refits those of a scene with the same items. `bounds` are those of each object, or of its
    /// elements, in the space of the object's group. They are dropped as items take their place: those of ten million
    /// triangles take 280 MB, when the memory of a build is greatest.
    pub fn geometry(
        &self,
        scene: &Scene,
        mut bounds: Vec<Vec<Option<Bounds>>>,
        earlier: Option<(&Geometry, &[GroupItems])>,
    ) -> Geometry {
        let count = scene.instances.len() + self.moving.len();
        let earlier = earlier.filter(|(geometry, groups)| {
            self.groups == *groups && count == geometry.instances.len()
        });
        let group = |index: usize, items: Vec<Item>| match earlier {
            Some((geometry, _)) => geometry.groups[index].moved(items),
            None => Group::new(items),
        };
        let items = |group: &GroupItems| -> Vec<Item> {
            let mut items = Vec::with_capacity(group.count as usize);
            for GroupMember { object, leaf_class: class, .. } in &group.members {
                let bounds = std::mem::take(&mut bounds[*object as usize]).into_iter();
                items.extend(bounds.map(|bounds| Item { bounds, class: *class }));
            }
            items
        };
        let mut lists = self.groups.iter().map(items);
        let mut world = lists.next().unwrap_or_default();
        let placed: Vec<Group> = (1..).zip(lists).map(|(index, it)| group(index, it)).collect();
        let first_instance = world.len() as u32;
        let instances = self.add_instances(scene, &placed, &mut world);
        let groups = std::iter::once(group(0, world)).chain(placed).collect();
        Geometry { groups, instances, first_instance }
    }

    /// Adds the instances after the world's objects.
    fn add_instances(
        &self,
        scene: &Scene,
        placed: &[Group],
        world: &mut Vec<Item>,
    ) -> Vec<Instance> {
        let instances = self.instances(scene).map(|instance| {
            let PlacedGroup { group, transform, motion } = instance;
            let transform = Transform::from(*transform);
            let placed = &placed[*group as usize];
            let own = placed.bounds();
            let bounds = match motion {
                // An empty group gets a box that no ray meets.
                _ if placed.is_empty() => Some(Bounds::NOWHERE),
                None => own.and_then(|bounds| bounds.transformed(transform)),
                Some(motion) => own.and_then(|bounds| bounds.moved(motion)),
            };
            world.push(Item { bounds, class: INSTANCE });
            Instance { group: group + 1, inverse: inverse(transform), motion: motion.clone() }
        });
        instances.collect()
    }

    /// Compiles the kernels of elements. Errors are not reported here, because they occur again when the classes are
    /// created.
    pub fn prepare_classes(&self, scene: &Scene, objects: &[Object], shaders: &[Shader]) {
        for key in &self.keys {
            if let Some((object, _)) = key.elements {
                let inverse = &objects[object as usize].inverse;
                let object = &scene.objects[object as usize];
                let _ = ObjectClass::prepare_elements(&shaders[key.shader], object, inverse);
            }
        }
    }

    /// Creates the classes of the leaves of the trees.
    ///
    /// # Errors
    /// If kernels or elements cannot be created.
    pub fn classes(
        &self,
        geometry: &Geometry,
        scene: &Scene,
        objects: &[Object],
        shaders: &[Shader],
    ) -> Result<Vec<ObjectClass>, Diagnostic> {
        let items = items_in_order(geometry, self.keys.len());
        let mut together: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
        for GroupMember { class, leaf_class, .. } in self.groups.iter().flat_map(|it| &it.members) {
            together.entry(*leaf_class).or_default().insert(*class);
        }
        let mut made: BTreeMap<u32, ObjectClass> = BTreeMap::new();
        for (leaf_class, classes) in together {
            let ClassKey { group, shader, is_placed, elements } = self.keys[leaf_class as usize];
            let (shader, items) = (&shaders[shader], &items[leaf_class as usize]);
            let member = |item: &u32| self.groups[group].member(*item);
            let inverse = |object: u32| objects[object as usize].inverse;
            let Some((first, _)) = elements else {
                let order = items.iter().map(|item| member(item).map_or(0, |it| it.object));
                let placed = |object: u32| {
                    (scene.objects[object as usize].primitive.clone(), inverse(object))
                };
                let class = ObjectClass::of_objects(shader, is_placed, order.collect(), placed)?;
                made.insert(leaf_class, class);
                continue;
            };
            let indices: BTreeMap<u32, u32> = classes.iter().copied().zip(0..).collect();
            let order = items.iter().map(|item| {
                let GroupMember { class, first, .. } = member(item)?;
                Some((*indices.get(&class)?, item - first))
            });
            let order: Vec<(u32, u32)> = order.map(Option::unwrap_or_default).collect();
            let elements = classes.iter().filter_map(|class| self.keys[*class as usize].elements);
            let meshes: Vec<&SceneObject> =
                elements.map(|(object, _)| &scene.objects[object as usize]).collect();
            let of_meshes = ObjectClass::of_elements(shader, &meshes, &inverse(first), &order)?;
            made.extend(classes.into_iter().zip(of_meshes));
        }
        Ok(made.into_values().collect())
    }
}

/// Returns, for each class, the first one of those whose elements are in leaves together: meshes of one shader in one
/// group, at one place, if `intersect` reads nothing that they share. A room of 800 meshes has a class for each
/// otherwise: leaves hold few of their triangles, and a call of a kernel tests a ray or two.
fn leaf_classes(keys: &[ClassKey], objects: &[Object], shaders: &[Shader]) -> Vec<u32> {
    let mut are_alike: BTreeMap<usize, bool> = BTreeMap::new();
    let mut firsts = BTreeMap::new();
    let leaf_class = |(class, key): (u32, &ClassKey)| {
        let ClassKey { group, shader, is_placed: _, elements } = *key;
        let Some((object, _)) = elements else { return class };
        let program = &shaders[shader].program;
        let are_alike = *are_alike
            .entry(shader)
            .or_insert_with(|| program.reads_elements_alone(Method::Intersect));
        let inverse =
            objects[object as usize].inverse.columns.map(|column| column.map(f32::to_bits));
        if are_alike { *firsts.entry((group, shader, inverse)).or_insert(class) } else { class }
    };
    (0..).zip(keys).map(leaf_class).collect()
}

/// The objects of each group, and the instances of moving objects.
struct Groups {
    groups: Vec<Vec<u32>>,
    moving: Vec<PlacedGroup>,
}

impl Groups {
    fn of(scene: &Scene) -> Self {
        let motion = |object: u32| scene.objects[object as usize].motion.as_ref();
        let still = |members: &Vec<u32>| {
            members.iter().copied().filter(|object| motion(*object).is_none()).collect()
        };
        let groups = std::iter::once(&scene.world).chain(&scene.groups).map(still);
        let mut all = Groups { groups: groups.collect(), moving: Vec::new() };
        for (object, motion) in scene.world.iter().filter_map(|it| Some((*it, motion(*it)?))) {
            let group = all.add_group(object);
            all.add_moving(group, motion.clone());
        }
        for (index, members) in scene.groups.iter().enumerate() {
            let placed = || scene.instances.iter().filter(|it| it.group as usize == index);
            for (object, motion) in members.iter().filter_map(|it| Some((*it, motion(*it)?))) {
                let group = all.add_group(object);
                for instance in placed() {
                    let outer = instance.motion.as_deref().cloned();
                    let outer = outer.unwrap_or_else(|| Transform::from(instance.transform).into());
                    all.add_moving(group, Arc::new(outer.after(motion)));
                }
            }
        }
        all
    }

    /// Adds a group of one object; returns its index for instances.
    fn add_group(&mut self, object: u32) -> u32 {
        self.groups.push(vec![object]);
        self.groups.len() as u32 - 2
    }

    fn add_moving(&mut self, group: u32, motion: Arc<MovingTransform>) {
        let transform = motion.keys()[0].into();
        self.moving.push(PlacedGroup { group, transform, motion: Some(motion) });
    }
}

/// Assigns indices to classes, in the order of their first use.
#[derive(Default)]
struct ClassIndices {
    indices: BTreeMap<ClassKey, u32>,
}

impl ClassIndices {
    fn index(&mut self, key: ClassKey) -> u32 {
        let next = self.indices.len() as u32;
        *self.indices.entry(key).or_insert(next)
    }

    /// Returns the keys of the classes by index.
    fn into_keys(self) -> Vec<ClassKey> {
        let mut keys: Vec<(u32, ClassKey)> =
            self.indices.into_iter().map(|(key, index)| (index, key)).collect();
        keys.sort_unstable();
        keys.into_iter().map(|(_, key)| key).collect()
    }
}

/// The object that a ray hit.
#[derive(Clone, Copy, Debug)]
pub struct HitObject {
    /// The object.
    pub member: GroupMember,
    /// The index of its element.
    pub element: u32,
    /// The index of the instance of the scene that places it.
    pub instance: Option<u32>,
}

impl HitObject {
    /// Resolves an id; `None` for no hit.
    #[inline(always)]
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Single objects, meshes shorter and longer than blocks, and empty ones.
    #[test]
    fn items_belong_to_the_objects_that_they_were_added_for() {
        let counts = [1, 0, 1, 40, 2, 16, 0, 0, 3, 1, 1, 100, 0];
        let (mut items, mut owners) = (GroupItems::default(), Vec::new());
        for (object, count) in (0..).zip(counts) {
            items.push(object, 0, count);
            owners.extend(std::iter::repeat_n(object, count as usize));
        }
        let found = (0..items.count()).map(|item| items.member(item).map(|it| it.object));
        assert_eq!(found.collect::<Option<Vec<u32>>>(), Some(owners));
        assert_eq!(items.member(items.count()), None);
        assert_eq!(GroupItems::default().member(0), None);
    }
}
