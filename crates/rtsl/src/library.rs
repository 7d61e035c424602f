//! RTSL text that is built in: the standard library of shaders, and the prelude.

/// A file of the library.
#[derive(Clone, Copy, Debug)]
pub struct LibraryFile {
    /// Its name, as diagnostics show it: `shaders/primitives/sphere.rtsl`.
    pub path: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// The standard library's files, sorted by name.
pub fn files() -> &'static [LibraryFile] {
    FILES
}

/// The prelude: what every shader may call, sorted by name.
pub(crate) fn prelude_files() -> &'static [LibraryFile] {
    PRELUDE_FILES
}

const FILES: &[LibraryFile] = include!(concat!(env!("OUT_DIR"), "/shaders_files.rs"));
const PRELUDE_FILES: &[LibraryFile] = include!(concat!(env!("OUT_DIR"), "/prelude_files.rs"));
