//! The objects of scenes that have few, among which kernels search for hits.

use std::collections::BTreeMap;

use rtsl::{SearchedClass, SearchedObject, SearchedScene};
use rtsl_bvh::SLACK;

use super::super::super::group_plan::Classes;
use crate::compiled::object_class::ObjectClass;

/// The greatest number of items that kernels test instead of a hierarchy.
const MAX_ITEMS: u32 = 16;

/// Returns the objects of a scene for kernels that test all of them; `None` if a hierarchy is faster, or needed for
/// instances or alpha textures.
pub fn searched_objects(classes: &Classes<'_>) -> Option<SearchedScene> {
    let scene = classes.compiled;
    let group = scene.items.first()?;
    let is_small = (1..=MAX_ITEMS).contains(&group.count());
    if !is_small || !scene.geometry.instances.is_empty() || !classes.alpha.is_empty() {
        return None;
    }
    let tree = &scene.geometry.groups.first()?.tree;
    let mut by_class: BTreeMap<u32, Vec<SearchedObject>> = BTreeMap::new();
    for leaf in &tree.leaves {
        for (index, item) in leaf.items().iter().enumerate() {
            let bounds = leaf.boxes.get(index);
            let [[x, y, z], [max_x, max_y, max_z]] = [bounds.min, bounds.max];
            by_class.entry(leaf.class).or_default().push(SearchedObject {
                index: ObjectClass::item_index(leaf, index),
                bounds: [x, y, z, max_x, max_y, max_z],
                item: *item,
            });
        }
    }
    let searched = by_class.into_iter().map(|(class, mut objects)| {
        objects.sort_unstable_by_key(|object| object.item);
        let class = scene.class(class);
        SearchedClass {
            program: class.program().clone(),
            is_placed: class.is_placed(),
            data: class.objects.clone(),
            objects,
        }
    });
    let items = (0..group.count()).map(|item| {
        let member = group.member(item)?;
        Some([member.object, item - member.first])
    });
    let items: Vec<[u32; 2]> = items.collect::<Option<_>>()?;
    SearchedScene::new(&searched.collect::<Vec<_>>(), &items, (scene.epsilon, SLACK))
}
