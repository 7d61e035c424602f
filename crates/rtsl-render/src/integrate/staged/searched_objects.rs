//! The objects of scenes that have few, among which kernels search for hits.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::{SearchedClass, SearchedItem, SearchedObject, SearchedScene};
use rtsl_bvh::SLACK;

use super::staged_method::Surface;
use crate::compiled::group_plan::Classes;
use crate::compiled::object_class::ObjectClass;
use crate::compiled::placed_objects::GroupMember;

/// The greatest number of items that kernels test instead of a hierarchy. With 16 spheres both take as long, and with
/// 18 bilinear patches kernels take four fifths of the time (Zen 4, AVX-512).
const MAX_ITEMS: u32 = 20;

/// Returns the objects of a scene for kernels that test all of them; `None` if a hierarchy is faster, or needed for
/// instances or alpha textures. `surface_of` returns the surfaces of objects.
pub fn searched_objects(
    classes: &Classes<'_>,
    surface_of: impl Fn(u32) -> Surface,
) -> Option<SearchedScene> {
    let scene = classes.compiled;
    let group = scene.items.first()?;
    let is_small = (1..=MAX_ITEMS).contains(&group.count());
    if !is_small || !scene.geometry.instances.is_empty() || !classes.alpha.is_empty() {
        return None;
    }
    let tree = &scene.geometry.groups.first()?.tree;
    // Meshes have a traversal class each.
    let mut by_class: BTreeMap<(usize, bool), SearchedClass> = BTreeMap::new();
    for leaf in &tree.leaves {
        let class = scene.class(leaf.class);
        let (program, is_placed) = (class.program(), class.is_placed());
        let searched =
            by_class.entry((Arc::as_ptr(program).addr(), is_placed)).or_insert_with(|| {
                SearchedClass { program: program.clone(), is_placed, objects: Vec::new() }
            });
        for (index, item) in leaf.items().iter().enumerate() {
            let bounds = leaf.boxes.get(index);
            let [[x, y, z], [max_x, max_y, max_z]] = [bounds.min, bounds.max];
            searched.objects.push(SearchedObject {
                data: class.objects.clone(),
                index: ObjectClass::item_index(leaf, index),
                bounds: [x, y, z, max_x, max_y, max_z],
                item: *item,
            });
        }
    }
    let mut searched: Vec<SearchedClass> = by_class.into_values().collect();
    searched.iter_mut().for_each(|class| class.objects.sort_unstable_by_key(|it| it.item));
    // In an order that addresses do not determine.
    searched.sort_unstable_by_key(|class| class.objects[0].item);
    let items = (0..group.count()).map(|item| {
        let GroupMember { object, first, .. } = group.member(item)?;
        let (element, surface) = (item - first, surface_of(object));
        let (group, surface) = (surface.group, surface.index_of(element));
        Some(SearchedItem { object, element, group, surface })
    });
    let items: Vec<SearchedItem> = items.collect::<Option<_>>()?;
    SearchedScene::new(&searched, &items, (scene.epsilon, SLACK))
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use rtsl::{Engine, EngineOptions, Messages};
    use rtsl_scene::reader::MemoryFiles;
    use rtsl_scene::{LoadOptions, load_scene};

    use crate::compiled::render_scene::RenderScene;

    /// The way in which paths of a scene search.
    #[derive(Debug, PartialEq)]
    enum Way {
        StageEnds,
        SearchKernels,
        Hierarchy,
    }

    fn way(integrator: &str, spheres: usize) -> Way {
        let shapes: String = (0..spheres)
            .map(|index| format!("Shape \"Sphere\" \"point3 center\" [{index} 0 0]\n"))
            .collect();
        let text = format!(
            "Camera \"Pinhole\"\nIntegrator \"{integrator}\"\nWorldBegin\n\
             Material \"Lambertian\"\n{shapes}"
        );
        let files = MemoryFiles([(PathBuf::from("scene.pbrt"), text)].into());
        let loaded = load_scene(Path::new("scene.pbrt"), &files, &LoadOptions::default());
        let loaded = loaded.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
        let (engine, _) = Engine::new(EngineOptions::default()).unwrap();
        let scene =
            RenderScene::new(&loaded.scene, &engine, &[], &mut Messages::default(), &|_| {});
        let scene = scene.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)));
        let staged = scene.integrator.staged.as_ref().expect("the test has machine code");
        match (staged.program.searches_at_end(), staged.nearest_search()) {
            (true, None) => Way::StageEnds,
            (false, Some(_)) => Way::SearchKernels,
            (false, None) => Way::Hierarchy,
            (true, Some(_)) => panic!("a kernel searches for no one"),
        }
    }

    #[test]
    fn the_number_of_objects_and_the_integrator_decide_how_paths_search() {
        assert_eq!(way("Path", 3), Way::StageEnds);
        assert_eq!(way("AmbientOcclusion", 3), Way::StageEnds);
        assert_eq!(way("Whitted", 3), Way::StageEnds);
        assert_eq!(way("Path", 30), Way::Hierarchy);
    }
}
