//! Scenes: what their text describes.

mod description;

pub use description::{
    Description, Entity, EntityId, EntityKind, InstanceUse, ObjectDefinition, ShapeUse,
};
