//! Indices of object classes, for AOVs.

use super::compiled_scene::CompiledScene;
use super::object::Object;

/// The classes of a scene's objects, in the order of their first objects.
pub struct ObjectClasses {
    /// Their names.
    pub names: Vec<String>,
    /// The index of each shader's class; -1 for shaders that are not shapes.
    indices: Vec<f32>,
}

impl ObjectClasses {
    /// Collects the classes of a scene.
    pub fn of(scene: &CompiledScene) -> Self {
        let mut classes =
            ObjectClasses { names: Vec::new(), indices: vec![-1.0; scene.shaders.len()] };
        for object in &scene.objects {
            let shader = object.primitive.shader;
            if classes.indices[shader] < 0.0 {
                classes.indices[shader] = classes.names.len() as f32;
                classes.names.push(scene.shaders[shader].program.class().name.clone());
            }
        }
        classes
    }

    /// Returns the index of an object's class.
    pub fn index(&self, object: &Object) -> f32 {
        self.indices[object.primitive.shader]
    }
}
