//! What is wrong with a mesh.

use std::io;

use rtsl_memory::OverBudget;

/// Why a mesh cannot be used. The text is a clause, to be preceded by the name of the mesh.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// The file, or one that it names, cannot be read.
    #[error("{0}")]
    Unreadable(io::Error),
    /// It is no file of its format, or uses what is not supported.
    #[error("{0}")]
    Malformed(String),
    /// The file ends too soon.
    #[error("the file ends within {0}")]
    Truncated(String),
    /// It has no face.
    #[error("it has no face")]
    Empty,
    /// Numbers that do not come in groups of a vertex or a triangle.
    #[error("{0} numbers make no whole {1}")]
    Incomplete(usize, &'static str),
    /// A corner that is no vertex.
    #[error("a face has the corner {index}, but there are {vertices} vertices")]
    IndexOutOfRange {
        /// The corner's index.
        index: i64,
        /// The number of vertices.
        vertices: usize,
    },
    /// A vertex that lies nowhere.
    #[error("vertex {0} has a coordinate that is not finite")]
    NotFinite(usize),
    /// Normals or texture coordinates of some of the vertices only.
    #[error("it has {vertices} vertices, but {found} {what}")]
    CountMismatch {
        /// What there are too few or too many of.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        vertices: usize,
    },
    /// More than kernels can address.
    #[error("it has more than {0} {1}")]
    TooLarge(usize, &'static str),
    /// More memory than there is for the files of a scene.
    #[error("it {0}")]
    OverBudget(OverBudget),
}

impl MeshError {
    /// What can be done about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            MeshError::Unreadable(_) => "paths are relative to the folder of the scene",
            MeshError::Malformed(_) => "export it again, as plain triangles without compression",
            MeshError::Truncated(_) => "it was cut off: copy or export it again",
            MeshError::Empty => "a mesh needs at least one face with three corners",
            MeshError::Incomplete(..) => {
                "give three numbers for a vertex or triangle, four for a quadrilateral"
            }
            MeshError::IndexOutOfRange { .. } => "indices count vertices from 0",
            MeshError::NotFinite(_) => "remove what is not a number or infinite",
            MeshError::CountMismatch { .. } => "give one for each vertex, or none at all",
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
