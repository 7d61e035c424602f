//! The standard library of shaders, which is built in.

use std::sync::LazyLock;

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

/// Returns the standard library's file that declares a class.
pub fn file_of_class(name: &str) -> Option<&'static LibraryFile> {
    classes().find(|(class, _)| *class == name).map(|(_, file)| file)
}

/// Returns the names of all classes of the standard library with their files, in the order of files.
pub fn classes() -> impl Iterator<Item = (&'static str, &'static LibraryFile)> {
    static CLASSES: LazyLock<Vec<(&str, &LibraryFile)>> = LazyLock::new(|| {
        let of_file =
            |file: &'static LibraryFile| declared_classes(file.text).map(move |it| (it, file));
        files().iter().flat_map(of_file).collect()
    });
    CLASSES.iter().copied()
}

/// Returns the names that follow the keyword `class` in a text, without parsing it.
pub fn declared_classes(text: &str) -> impl Iterator<Item = &str> {
    let mut words = rtsl_syntax::raw::words(text).into_iter();
    std::iter::from_fn(move || {
        words.by_ref().find(|word| *word == "class")?;
        words.next()
    })
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
    if let Some(file) = file_of_class(name)
        && let Some(unit) = compiler.compile(file.path, file.text).unit
        && unit.class(name).is_ok()
    {
        return Ok(unit);
    }
    let mut names: Vec<&str> = classes().map(|(class, _)| class).collect();
    names.sort_unstable();
    Err(unknown_class(name, names))
}
