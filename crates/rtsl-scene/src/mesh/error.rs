//! Errors of meshes.

use std::io;

use rtsl_memory::OverBudget;

/// An error of a mesh. Its text is a clause, to be preceded by the name of the mesh.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// The file, or one that it names, cannot be read.
    #[error("{0}")]
    Unreadable(io::Error),
    /// The file breaks the rules of its format.
    #[error("{0}")]
    Malformed(String),
    /// The file has another format than its name says.
    #[error("{0}")]
    OtherFormat(String),
    /// Data in the file are compressed in a way that cannot be decoded.
    #[error("{0}")]
    Compressed(String),
    /// The file is truncated.
    #[error("the file ends within {0}")]
    Truncated(String),
    /// The mesh has no faces.
    #[error("it has no face")]
    Empty,
    /// An array whose length is no multiple of the numbers of a vertex or a triangle.
    #[error("{0} numbers make no whole {1}")]
    Incomplete(usize, &'static str),
    /// A corner that is not a valid vertex index.
    #[error("a face has the corner {index}, but there are {vertices} vertices")]
    IndexOutOfRange {
        /// The corner's index.
        index: i64,
        /// The number of vertices.
        vertices: usize,
    },
    /// A vertex with an infinite or NaN coordinate.
    #[error("vertex {0} has a coordinate that is not finite")]
    NotFinite(usize),
    /// Normals or texture coordinates for some of the vertices only.
    #[error("it has {vertices} vertices, but {found} {what}")]
    CountMismatch {
        /// The name of the attribute.
        what: &'static str,
        /// The number found.
        found: usize,
        /// The number expected.
        vertices: usize,
    },
    /// An attribute with another number of scalars than shaders read.
    #[error(
        "its attribute `{attribute}` has {found} numbers for a vertex, but `{name}` has {wanted}"
    )]
    OtherAttribute {
        /// The name in the file.
        attribute: String,
        /// The number found.
        found: usize,
        /// The name in shaders.
        name: String,
        /// The numbers expected.
        wanted: String,
    },
    /// An array too long for the indices of kernels.
    #[error("it has more than {0} {1}")]
    TooLarge(usize, &'static str),
    /// The memory budget for the files of a scene is exceeded.
    #[error("it {0}")]
    OverBudget(OverBudget),
}

/// A part of a mesh that is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshWarning {
    /// Materials, which a mesh does not have.
    Materials,
    /// The first of the vertices that no face uses and that have infinite or NaN coordinates.
    NotFinite(usize),
}

impl MeshError {
    /// Returns advice for the user.
    pub fn remedy(&self) -> &'static str {
        match self {
            MeshError::Unreadable(_) => "paths are relative to the folder of the scene",
            MeshError::Malformed(_) => {
                "it is damaged, or its exporter has a fault: export it again"
            }
            MeshError::OtherFormat(_) => "convert it, or correct its name",
            MeshError::Compressed(_) => "export it again, without compression",
            MeshError::Truncated(_) => "it was cut off: copy or export it again",
            MeshError::Empty => "a mesh needs at least one face with three corners",
            MeshError::Incomplete(..) => {
                "give three numbers for a vertex or triangle, four for a quadrilateral"
            }
            MeshError::IndexOutOfRange { .. } => "indices count vertices from 0",
            MeshError::NotFinite(_) => "remove infinite and NaN coordinates",
            MeshError::CountMismatch { .. } => "give one for each vertex, or none at all",
            MeshError::OtherAttribute { .. } => {
                "declare the attribute in the shader with a type of as many numbers, or with another name"
            }
            MeshError::TooLarge(..) => "split it into several shapes",
            MeshError::OverBudget(_) => "allow more with `--input-memory`",
        }
    }
}

impl From<io::Error> for MeshError {
    fn from(error: io::Error) -> Self {
        if error.kind() == io::ErrorKind::UnexpectedEof {
            return MeshError::Truncated("a number".to_owned());
        }
        match OverBudget::of(&error) {
            Some(over) => MeshError::OverBudget(*over),
            None => MeshError::Unreadable(error),
        }
    }
}

impl From<OverBudget> for MeshError {
    fn from(error: OverBudget) -> Self {
        MeshError::OverBudget(error)
    }
}
