//! The object under a pixel.

use rtsl_scene::EntityId;

/// The closest hit of the ray through a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Picked {
    /// The shape's entity.
    pub shape: EntityId,
    /// The shape's name, or its line in the scene's text.
    pub title: String,
    /// The shape's class.
    pub class: String,
    /// The material's entity; `None` for the default material, and for shapes that are their own material.
    pub material: Option<EntityId>,
    /// The class that shades the shape.
    pub material_class: String,
    /// The distance from the camera.
    pub distance: f64,
    /// The hit point in world space.
    pub position: [f64; 3],
}
