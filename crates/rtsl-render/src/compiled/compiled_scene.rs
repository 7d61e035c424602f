//! A scene with kernels for its shaders and an acceleration structure over its objects.

use std::sync::Arc;
use std::time::Duration;

use rtsl_bvh::Geometry;
use rtsl_math::{Affine, MovingTransform};
use rtsl_scene::Settings;

use super::extents::Extents;
use super::light::Light;
use super::object::Object;
use super::object_class::ObjectClass;
use super::placed_objects::GroupItems;
use super::placement::Placement;
use super::shader_instance::ShaderInstance;
use super::shaders::Shader;

/// A scene prepared for rendering.
pub struct CompiledScene {
    /// Film, sampler and integrator.
    pub settings: Settings,
    /// All shaders.
    pub shaders: Vec<Shader>,
    /// The camera.
    pub camera: ShaderInstance,
    /// The transform from the camera's space to the world's; of a moving camera, at shutter open.
    pub camera_to_world: Affine,
    /// The same over the shutter interval, if it moves.
    pub camera_motion: Option<Arc<MovingTransform>>,
    /// The lights without a shape.
    pub lights: Vec<Light>,
    /// The value of `ambient()`.
    pub ambient: [f32; 3],
    /// The objects.
    pub objects: Vec<Object>,
    /// The acceleration structure. It depends on the bounds of shapes but not on their kernels, so that scenes with the
    /// same shapes can share it.
    pub geometry: Arc<Geometry>,
    /// The objects of the items in the geometry's groups.
    pub items: Vec<GroupItems>,
    /// The classes of the leaves of the geometry's trees.
    pub classes: Vec<ObjectClass>,
    /// The transforms from a group's space to the world's, for the instances of the geometry; of moving instances, at
    /// shutter open.
    pub instance_transforms: Vec<Affine>,
    /// The extents of its objects' bounding boxes.
    pub extents: Arc<Extents>,
    /// The distance beyond which hits of rays count, unless the camera sets another: 0 unless the scene sets it, since
    /// cameras are in no surface, and the origins of other rays are offset from surfaces.
    pub epsilon: f32,
    /// The greatest number of scratch arrays of a shader.
    pub scratch_arrays: usize,
    /// The SIMD width of the kernels in lanes.
    pub width: u32,
    /// True if the engine has a trace. The picture then has one pixel, and samples are taken one by one: of a packet of
    /// camera rays only the first lane counts.
    pub is_traced: bool,
    /// The time for compiling kernels.
    pub compile_time: Duration,
    /// The time for bounds and the acceleration structure.
    pub build_time: Duration,
}

impl CompiledScene {
    /// Returns the shader of an instance.
    pub fn shader(&self, instance: &ShaderInstance) -> &Shader {
        &self.shaders[instance.shader]
    }

    /// Returns a traversal class.
    #[inline]
    pub fn class(&self, index: u32) -> &ObjectClass {
        &self.classes[index as usize]
    }

    /// True if instances place the objects of a traversal class, all of which are in one group.
    pub fn is_placed_by_instances(&self, class: u32) -> bool {
        // The first items are in the world.
        let mut members = self.items.iter().skip(1).flat_map(|items| items.members());
        members.any(|member| member.class == class)
    }

    /// Returns the placement of an instance of the geometry.
    pub fn placement(&self, instance: u32) -> Option<Placement<'_>> {
        let forward = *self.instance_transforms.get(instance as usize)?;
        Some(Placement::new(self.geometry.instances.get(instance as usize)?, forward))
    }
}
