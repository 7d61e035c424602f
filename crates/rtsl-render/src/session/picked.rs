//! What lies under a pixel.

use rtsl_scene::EntityId;

/// The nearest hit of the ray through a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Picked {
    /// The shape in the scene's text.
    pub shape: EntityId,
    /// The shape's name, or the line that it stands in.
    pub title: String,
    /// The shape's class.
    pub class: String,
    /// The material in the scene's text; `None` for the default material, and for shapes that are
    /// their own.
    pub material: Option<EntityId>,
    /// The class that shades it.
    pub material_class: String,
    /// The distance from the camera.
    pub distance: f64,
    /// The place in the world.
    pub position: [f64; 3],
}
