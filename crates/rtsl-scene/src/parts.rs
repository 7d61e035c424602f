//! A scene under construction.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl::Instance;
use rtsl_math::{MovingTransform, Transform};

use super::description::{Entity, EntityId};
use super::scene::SceneObject;
use super::shutter::Shutter;

/// The lists that grow during loading.
#[derive(Default)]
pub struct SceneParts {
    pub materials: Vec<Arc<Instance>>,
    /// The indices of materials by entity; `None` is the default material.
    pub material_indices: BTreeMap<Option<EntityId>, Option<u32>>,
    pub objects: Vec<SceneObject>,
    pub ambient: [f32; 3],
    pub material_origins: Vec<Option<EntityId>>,
    pub light_origins: Vec<EntityId>,
    pub object_origins: Vec<EntityId>,
    pub shutter: Shutter,
}

/// The transform at shutter open, and the motion during the shutter interval.
pub type Placement = (Transform, Option<Arc<MovingTransform>>);

impl SceneParts {
    /// The placement of a shape or light to which `first` is applied first.
    pub fn place_entity(&self, entity: &Entity, first: Transform) -> Placement {
        let end = entity.end_transform.map(|end| end.after(first));
        self.shutter.place(entity.transform.after(first), end)
    }

    /// The placement of the camera, from its own space to the world's; `None` if it has no inverse.
    pub fn place_camera(&self, camera: &Entity) -> Option<Placement> {
        let start = camera.transform.inverse()?;
        let end = match camera.end_transform {
            Some(end) => Some(end.inverse()?),
            None => None,
        };
        Some(self.shutter.place(start, end))
    }
}
