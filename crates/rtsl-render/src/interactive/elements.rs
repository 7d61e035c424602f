//! Meshes as the tracer takes them now: each element an object of its own.

use std::sync::Arc;

use rtsl::{Diagnostics, Instance, Numbers, Scalar, Value};

use crate::scene::{Scene, SceneObject};

/// The scene with an object for each element of its meshes, in their place.
///
/// # Errors
/// If an instance can't be made.
pub fn expand_elements(mut scene: Scene) -> Result<Scene, Diagnostics> {
    if scene.objects.iter().all(|object| object.elements.is_none()) {
        return Ok(scene);
    }
    let mut expanded = Vec::new();
    let mut ranges = Vec::with_capacity(scene.objects.len());
    for object in &scene.objects {
        let first = expanded.len() as u32;
        match object.elements {
            None => expanded.push(object.clone()),
            Some(count) => {
                for index in 0..count {
                    let primitive = element(&object.primitive, index)?;
                    expanded.push(SceneObject { primitive, elements: None, ..object.clone() });
                }
            }
        }
        ranges.push(first..expanded.len() as u32);
    }
    for group in scene.groups.iter_mut().chain([&mut scene.world]) {
        let objects = group.iter().flat_map(|object| ranges[*object as usize].clone());
        *group = objects.collect();
    }
    scene.objects = expanded;
    Ok(scene)
}

/// An instance with the buffers of `mesh`: its classes have no other parameters but the element.
fn element(mesh: &Instance, index: u32) -> Result<Arc<Instance>, Diagnostics> {
    let class = mesh.class();
    let buffers = class.parameters.iter().filter_map(|parameter| {
        let words = mesh.buffer(&parameter.name)?;
        let place = class.buffers.iter().find(|place| place.name == parameter.name)?;
        let numbers = Numbers::from_words(place.scalar, words.clone());
        Some((parameter.name.as_str(), Value::Numbers(numbers)))
    });
    let number = Value::Numbers(Numbers::from_words(Scalar::I32, [index]));
    let element = class.element().map(|element| (element.parameter, number));
    Instance::new(class, buffers.chain(element))
}
