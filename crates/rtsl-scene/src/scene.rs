//! Scenes, ready to be rendered: instances of classes, placed.

use std::sync::Arc;

use rtsl::Instance;
use rtsl_math::{MovingTransform, Transform};

use super::Settings;

/// A scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Film, sampler and integrator.
    pub settings: Settings,
    /// The camera.
    pub camera: Arc<Instance>,
    /// From the camera's space to the world's, when the shutter opens.
    pub camera_to_world: Transform,
    /// The same for as long as the shutter is open, if it moves.
    pub camera_motion: Option<Arc<MovingTransform>>,
    /// The materials.
    pub materials: Vec<Arc<Instance>>,
    /// The lights.
    pub lights: Vec<PlacedLight>,
    /// What `ambient()` gives.
    pub ambient: [f32; 3],
    /// The objects.
    pub objects: Vec<SceneObject>,
    /// The objects that stand in the world, by their index.
    pub world: Vec<u32>,
    /// Groups of objects that instances place.
    pub groups: Vec<Vec<u32>>,
    /// Groups, placed.
    pub instances: Vec<PlacedGroup>,
}

impl Scene {
    /// The camera, the materials and the lights, in this order.
    pub fn shading_instances(&self) -> impl Iterator<Item = &Arc<Instance>> {
        let lights = self.lights.iter().map(|light| &light.light);
        [&self.camera].into_iter().chain(&self.materials).chain(lights)
    }

    /// Whether camera, materials and lights are the same objects.
    pub fn has_same_shading(&self, other: &Scene) -> bool {
        let mut pairs = self.shading_instances().zip(other.shading_instances());
        self.materials.len() == other.materials.len()
            && self.lights.len() == other.lights.len()
            && self.ambient == other.ambient
            && pairs.all(|(one, other)| Arc::ptr_eq(one, other))
    }

    /// Whether rays hit the same: every shape is the same object in the same place, and as many
    /// materials and lights stand there to be told apart.
    pub fn has_same_shapes(&self, other: &Scene) -> bool {
        let same = |(one, other): (&SceneObject, &SceneObject)| {
            Arc::ptr_eq(&one.primitive, &other.primitive)
                && one.transform == other.transform
                && one.motion == other.motion
                && one.material == other.material
                && one.emitter == other.emitter
                && one.reverse_orientation == other.reverse_orientation
                && same_texture(one.alpha.as_ref(), other.alpha.as_ref())
        };
        self.objects.len() == other.objects.len()
            && self.objects.iter().zip(&other.objects).all(same)
            && self.world == other.world
            && self.groups == other.groups
            && self.instances == other.instances
            && self.materials.len() == other.materials.len()
            && self.lights.len() == other.lights.len()
    }
}

fn same_texture(one: Option<&Arc<Instance>>, other: Option<&Arc<Instance>>) -> bool {
    match (one, other) {
        (None, None) => true,
        (Some(one), Some(other)) => Arc::ptr_eq(one, other),
        (None, Some(_)) | (Some(_), None) => false,
    }
}

/// A light and its place.
#[derive(Clone, Debug)]
pub struct PlacedLight {
    /// The light.
    pub light: Arc<Instance>,
    /// From its own space to the world's, when the shutter opens.
    pub transform: Transform,
}

/// A shape with what it looks like.
#[derive(Clone, Debug)]
pub struct SceneObject {
    /// The shape.
    pub primitive: Arc<Instance>,
    /// Where the shape stands for many objects, the triangles of a mesh for example: how many.
    pub elements: Option<u32>,
    /// From its own space to that of its group, or the world's, when the shutter opens.
    pub transform: Transform,
    /// The same for as long as the shutter is open, if it moves.
    pub motion: Option<Arc<MovingTransform>>,
    /// The index of its material.
    pub material: u32,
    /// The index of the material whose emission it gives off besides.
    pub emitter: Option<u32>,
    /// Its normals point the other way.
    pub reverse_orientation: bool,
    /// The texture that cuts it out: where its number is 0 there is nothing, where it is 1 all of the
    /// surface is there, and between them it is there as often as the number says.
    pub alpha: Option<Arc<Instance>>,
}

impl SceneObject {
    /// From its own space to that of its group for good; of what moves, its group has its own space.
    pub fn fixed_transform(&self) -> Transform {
        match self.motion {
            None => self.transform,
            Some(_) => Transform::IDENTITY,
        }
    }
}

/// A group, placed.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedGroup {
    /// The index of the group.
    pub group: u32,
    /// From the group's space to the world's, when the shutter opens.
    pub transform: Transform,
    /// The same for as long as the shutter is open, if it moves.
    pub motion: Option<Arc<MovingTransform>>,
}
