//! The texts of the standard library, which are built into the program.

/// A file that is built into the program.
#[derive(Clone, Copy, Debug)]
pub struct LibraryFile {
    /// Its name, as diagnostics show it: `shaders/primitives/sphere.rtsl`.
    pub path: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// The standard library, sorted by name.
pub(super) const SHADERS: &[LibraryFile] = include!(concat!(env!("OUT_DIR"), "/shaders_files.rs"));
