//! The names of pbrt, and how the classes of the standard library implement them: a table for each kind of entity, and
//! the translation of parameters that differ by more than their names.

mod aperture;
mod cameras;
mod curve;
mod ies;
mod image_lights;
mod images;
mod lenses;
mod lights;
mod materials;
mod measured;
mod mesh_shape;
mod name;
mod named_file;
mod parallelogram;
mod photometry;
mod portal;
mod shapes;
mod subsurface;
mod tensor;
mod textures;
mod translation;
mod wording;

pub use cameras::{add_missing_camera, share_film_size};
pub use image_lights::given_power;
pub use images::{CONVENTION, Images, NamedImage};
pub use mesh_shape::{MadeMesh, MeshShape};
pub use name::{PbrtName, class_name};
pub use translation::{translated, without_effect};
pub use wording::NamedEntity;
