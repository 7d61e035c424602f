//! The entities that a scene uses.

use std::collections::BTreeSet;

use super::Names;
use crate::description::{Description, EntityId, EntityKind, ShapeUse};
use crate::pbrt::PbrtName;
use crate::reader::{ReferenceKind, Values};

/// Returns the names of textures that lights look up: those that they refer to, and the textures of these.
pub fn textures_of_lights(description: &Description, names: &Names) -> BTreeSet<String> {
    let shapes = description.objects.iter().flat_map(|object| &object.shapes);
    let area_lights = shapes.chain(&description.shapes).filter_map(|shape| shape.area_light);
    let lights = description.lights.iter().copied().chain(area_lights);
    let found = reached_from(lights.collect(), description, names).into_iter();
    let entities = found.map(|EntityId(index)| &description.entities[index]);
    let textures = entities.filter(|entity| entity.kind == EntityKind::Texture);
    textures.filter_map(|texture| texture.name.clone()).collect()
}

/// Returns the camera, the lights, the shapes with their materials, and all that they refer to by name, unless it
/// has no effect.
pub fn reachable(description: &Description, names: &Names) -> BTreeSet<EntityId> {
    let of_shape = |it: &ShapeUse| [Some(it.shape), it.material, it.area_light];
    let shapes = description.objects.iter().flat_map(|object| &object.shapes);
    let shapes = shapes.chain(&description.shapes).flat_map(of_shape).flatten();
    let lights = description.lights.iter().copied();
    reached_from(shapes.chain(lights).chain(description.camera).collect(), description, names)
}

/// Returns entities and all that they refer to by name.
fn reached_from(
    mut open: Vec<EntityId>,
    description: &Description,
    names: &Names,
) -> BTreeSet<EntityId> {
    let mut found = BTreeSet::new();
    while let Some(id) = open.pop() {
        if !found.insert(id) {
            continue;
        }
        let entity = &description.entities[id.0];
        let standard = PbrtName::of(entity);
        for parameter in &entity.parameters {
            if standard.is_some_and(|it| it.has_no_effect(&parameter.name)) {
                continue;
            }
            let Values::Texts(texts) = &parameter.values else { continue };
            for text in texts {
                let kinds = [
                    ReferenceKind::Texture,
                    ReferenceKind::Material,
                    ReferenceKind::Light,
                    ReferenceKind::Primitive,
                    ReferenceKind::Camera,
                ];
                open.extend(kinds.iter().filter_map(|kind| names.get(&(*kind, text.clone()))));
            }
        }
    }
    found
}
