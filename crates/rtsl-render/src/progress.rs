//! What a render is at, for people who wait.

/// A step of a render, or a part of its last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// It reads the scene and the shaders that this names.
    Reading,
    /// It makes kernels.
    Compiling {
        /// How many shaders there are, those that differ only in values counted once.
        shaders: usize,
    },
    /// It bounds shapes and builds the hierarchy over them.
    Building {
        /// How many shapes and elements there are.
        primitives: u64,
    },
    /// It renders tiles.
    Rendering {
        /// How many are done.
        done: usize,
        /// How many there are.
        of: usize,
    },
}
