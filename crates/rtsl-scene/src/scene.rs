//! Loaded scenes: instances of classes with their transforms.

use std::sync::Arc;

use rtsl::Instance;
use rtsl_math::{MovingTransform, PackedTransform, Transform};

use super::Settings;
use super::standard::WHITTED;

/// A scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Film, sampler and integrator.
    pub settings: Settings,
    /// The integrator, if the scene names a class.
    pub integrator: Option<Arc<Instance>>,
    /// The path tracer of the standard library with the settings of the scene, for scenes that name no class.
    pub path_tracer: Arc<Instance>,
    /// The integrator of the standard library that shows what `shade` of materials computes, for the interactive
    /// renderer.
    pub whitted: Arc<Instance>,
    /// The camera.
    pub camera: Arc<Instance>,
    /// From the camera's space to the world's, at shutter open.
    pub camera_to_world: Transform,
    /// The same over the shutter interval, if it moves.
    pub camera_motion: Option<Arc<MovingTransform>>,
    /// The materials.
    pub materials: Vec<Arc<Instance>>,
    /// The lights.
    pub lights: Vec<PlacedLight>,
    /// The value of `ambient()`.
    pub ambient: [f32; 3],
    /// The objects.
    pub objects: Vec<SceneObject>,
    /// The indices of the objects outside all groups.
    pub world: Vec<u32>,
    /// Groups of objects that instances place, as indices of objects.
    pub groups: Vec<Vec<u32>>,
    /// Instances of groups.
    pub instances: Vec<PlacedGroup>,
}

impl Scene {
    /// Returns the integrator that makes the picture: the class that the scene names, or that of the settings.
    pub fn integrator(&self) -> &Arc<Instance> {
        self.integrator.as_ref().unwrap_or(match self.settings.integrator {
            Some(WHITTED) => &self.whitted,
            Some(_) | None => &self.path_tracer,
        })
    }

    /// Returns the camera, the materials and the lights, in this order.
    pub fn shading_instances(&self) -> impl Iterator<Item = &Arc<Instance>> {
        let lights = self.lights.iter().map(|light| &light.light);
        [&self.camera].into_iter().chain(&self.materials).chain(lights)
    }

    /// True if camera, materials and lights are the same instances.
    pub fn has_same_shading(&self, other: &Scene) -> bool {
        let mut pairs = self.shading_instances().zip(other.shading_instances());
        self.materials.len() == other.materials.len()
            && self.lights.len() == other.lights.len()
            && self.ambient == other.ambient
            && pairs.all(|(one, other)| Arc::ptr_eq(one, other))
    }

    /// True if the integrators are the same instance, or neither scene names a class.
    pub fn has_same_integrator(&self, other: &Scene) -> bool {
        is_same(self.integrator.as_ref(), other.integrator.as_ref())
    }

    /// True if rays have the same hits: every shape is the same instance at the same place, and the numbers of
    /// materials and lights are equal.
    pub fn has_same_shapes(&self, other: &Scene) -> bool {
        let same = |(one, other): (&SceneObject, &SceneObject)| {
            Arc::ptr_eq(&one.primitive, &other.primitive)
                && one.transform == other.transform
                && one.motion == other.motion
                && one.material == other.material
                && one.emitter == other.emitter
                && one.reverse_orientation == other.reverse_orientation
                && is_same(one.alpha.as_ref(), other.alpha.as_ref())
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

fn is_same(one: Option<&Arc<Instance>>, other: Option<&Arc<Instance>>) -> bool {
    match (one, other) {
        (None, None) => true,
        (Some(one), Some(other)) => Arc::ptr_eq(one, other),
        (None, Some(_)) | (Some(_), None) => false,
    }
}

/// A light and its transform.
#[derive(Clone, Debug)]
pub struct PlacedLight {
    /// The light.
    pub light: Arc<Instance>,
    /// From the light's space to the world's, at shutter open.
    pub transform: Transform,
}

/// A shape with its material.
#[derive(Clone, Debug)]
pub struct SceneObject {
    /// The shape.
    pub primitive: Arc<Instance>,
    /// The number of elements if the shape consists of several, such as the triangles of a mesh.
    pub elements: Option<u32>,
    /// From the shape's space to that of its group, or the world's, at shutter open.
    pub transform: Transform,
    /// The same over the shutter interval, if it moves.
    pub motion: Option<Arc<MovingTransform>>,
    /// The index of its material.
    pub material: u32,
    /// The index of the material whose emission it gives off besides.
    pub emitter: Option<u32>,
    /// True if its normals are flipped.
    pub reverse_orientation: bool,
    /// The alpha texture: 0 is transparent, 1 is opaque, and a value between them is the probability that a ray hits
    /// the surface.
    pub alpha: Option<Arc<Instance>>,
}

impl SceneObject {
    /// The constant transform from the shape's space to that of its group. A moving shape has a group to itself, and
    /// the identity here.
    pub fn fixed_transform(&self) -> Transform {
        match self.motion {
            None => self.transform,
            Some(_) => Transform::IDENTITY,
        }
    }

    /// True if its alpha is the constant 0: rays do not hit it, but as a light it shines.
    pub fn is_invisible(&self) -> bool {
        let alpha = self.alpha.as_ref().filter(|alpha| alpha.class().name == CONSTANT_TEXTURE);
        let value = alpha.and_then(|alpha| alpha.member("value"));
        value.is_some_and(|value| value.iter().all(|word| f32::from_bits(*word) == 0.0))
    }
}

/// The class of textures with one colour.
pub(crate) const CONSTANT_TEXTURE: &str = "Constant";

/// An instance of a group. There may be millions of them.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedGroup {
    /// The index of the group.
    pub group: u32,
    /// From the group's space to the world's, at shutter open.
    pub transform: PackedTransform,
    /// The same over the shutter interval, if it moves.
    pub motion: Option<Arc<MovingTransform>>,
}

#[cfg(test)]
mod tests {
    use super::PlacedGroup;
    use crate::description::InstanceUse;

    #[test]
    fn instances_are_small() {
        assert!(size_of::<InstanceUse>() <= 128, "{}", size_of::<InstanceUse>());
        assert!(size_of::<PlacedGroup>() <= 128, "{}", size_of::<PlacedGroup>());
    }
}
