//! Scenes: what their text describes, and what they are once classes are found and instances
//! are made.

mod arguments;
mod classes;
mod description;
mod exr_picture;
mod format_parameters;
mod load;
mod mesh_shape;
mod parallelogram;
mod parts;
mod picture;
#[allow(clippy::module_inception, reason = "the noun of the folder is the noun of the file")]
mod scene;
mod settings;
mod shutter;
mod source;
mod standard_names;

pub use description::{
    Description, Entity, EntityId, EntityKind, InstanceUse, ObjectDefinition, ShapeUse,
};
pub use load::Origins;
pub use picture::{Encoding, Picture, PictureError};
pub use scene::{PlacedGroup, PlacedLight, Scene, SceneObject};
pub use settings::Settings;
pub use source::{LoadOptions, Loaded, SceneSource, load_scene};
