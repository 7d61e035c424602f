//! Scenes: [`reader`] turns files into a [`Description`], and [`load_scene`] finds the classes that a description
//! names, reads its [`mesh`]es and pictures, and creates instances of the classes.
//!
//! This crate uses the language through the public interface of `rtsl` and depends on no renderer.

mod area;
mod arguments;
mod attributes;
mod bounds;
mod classes;
mod composition;
mod curvature;
mod description;
pub mod export;
mod framing;
pub mod gltf;
mod load;
pub mod materialx;
pub mod mesh;
mod mesh_scene;
mod not_scene;
mod parts;
mod pbrt;
mod presence;
pub mod reader;
mod scene;
mod settings;
mod shutter;
mod source;
pub mod spectrum;
mod standard;
mod studio;
mod vector;

pub use attributes::WantedAttributes;
pub use composition::{ComposedShape, Composer, Composition};
pub use description::{
    DescribedClass, Description, Entity, EntityId, EntityKind, InstanceUse, ObjectDefinition,
    SceneOptions, ShapeUse,
};
pub use load::Origins;
pub use mesh_scene::is_mesh_file;
pub use scene::{PlacedGroup, PlacedLight, Scene, SceneObject};
pub use settings::{
    BATCH, Crop, INTERACTIVE, Imaging, MAX_TRACE_DEPTH, RENDERERS, Settings, class_of_renderer,
};
pub use source::{LoadOptions, Loaded, SceneSource, load_scene};
pub use standard::{PATH_TRACER, WHITTED};
