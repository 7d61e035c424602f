//! The standard library of shaders, which is built in.

use rtsl_source::Diagnostic;

use super::compiler::Compiler;
use super::unit::Unit;
use crate::errors::unknown_class;

pub use super::library_file::LibraryFile;
use super::library_file::SHADERS;

/// Returns the standard library's files, sorted by name.
pub fn files() -> &'static [LibraryFile] {
    SHADERS
}

/// Returns the standard library's file of this name.
pub fn file(path: &str) -> Option<&'static LibraryFile> {
    files().iter().find(|file| file.path == path)
}

/// Compiles the file of the standard library that has a class.
///
/// ```
/// use rtsl::{Compiler, Instance, library};
///
/// let unit = library::unit_of_class(&Compiler::default(), "Torus")?;
/// let torus = Instance::new(unit.class("Torus")?, [("minorRadius", 0.3.into())])?;
/// assert!(library::files().iter().any(|file| file.text.contains("class Torus")));
/// # let _ = torus;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// If no file of the library has it; the diagnostic suggests a similar name.
pub fn unit_of_class(compiler: &Compiler, name: &str) -> Result<Unit, Diagnostic> {
    let mut names = Vec::new();
    for file in files() {
        let Some(unit) = compiler.compile(file.path, file.text).unit else { continue };
        if unit.classes().iter().any(|class| class.name == name) {
            return Ok(unit);
        }
        names.extend(unit.classes().iter().map(|class| class.name.clone()));
    }
    names.sort();
    Err(unknown_class(name, names.iter().map(String::as_str)))
}
