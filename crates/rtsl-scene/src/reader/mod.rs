//! The reader of scenes: the pbrt-v4 text format, with the names of RTSL classes as its types.
//!
//! ```text
//! LookAt 0 2 -8  0 0 0  0 1 0
//! Camera "Pinhole" "float fov" 40
//! WorldBegin
//! LightSource "PointLight" "point3 position" [ 4 8 -4 ] "string name" "lamp"
//! Material "Lambertian" "rgb albedo" [ 0.7 0.5 0.3 ]
//! Shape "Torus" "float R" 2
//! ```
//!
//! The result is a [`Description`]: classes are not looked up and parameters are not matched against them here. RTSL
//! extends the format in three ways: the types of RTSL (`uint`, `vec4`, `mat3`) and references (`texture`, `material`,
//! `primitive`, `light`, `camera`) as types of parameters; and `"string name"`, which names a shape, light or camera,
//! so that other parts of the scene and the command line ([`defines`]) can refer to it. RTSL classes have no strings,
//! so this collides with none of their parameters.
//!
//! No input makes the reader panic or recurse without bound: the depth of includes and the number of directives that
//! one scene may expand to are limited, and all memory is reserved in a budget before it is allocated.

mod command_memory;
mod conversion;
mod current_transform;
pub mod defines;
mod directive;
mod fence;
mod files;
#[cfg(test)]
mod format_page;
mod gzip;
mod interpreter;
mod lexer;
mod limits;
mod moved_files;
mod parameter;
mod parser;
mod recorded_files;
mod shared_files;
mod spectra;
mod state;
mod upgrade;
mod writer;

pub use conversion::{Conversion, ConversionOptions, FILE_PARAMETERS, convert_scene};
pub use fence::Fence;
pub use files::{
    DiskFiles, EmbeddedFiles, FileSource, Input, MemoryFiles, Opened, SceneFiles, file_start,
    resolve, unreadable, with_slashes,
};
pub use gzip::is_compressed;
pub use interpreter::{read_scene, read_scene_within};
pub use moved_files::MovedFiles;
pub use parameter::{
    COLOR, Component, Parameter, ParameterType, ReferenceKind, Values, parameter_type_words,
};
pub use recorded_files::{Digest, RecordedFiles};
pub use shared_files::FilesRef;
pub(crate) use upgrade::format_parameters;
pub use writer::push_quoted;

#[cfg(doc)]
use crate::Description;
