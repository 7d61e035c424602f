//! The standard library of shaders, built in.

/// A file of the library.
#[derive(Clone, Copy, Debug)]
pub struct LibraryFile {
    /// Its name, as diagnostics show it: `shaders/primitives/sphere.rtsl`.
    pub path: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// The files, sorted by name.
pub fn files() -> &'static [LibraryFile] {
    FILES
}

const FILES: &[LibraryFile] = include!(concat!(env!("OUT_DIR"), "/library_files.rs"));
