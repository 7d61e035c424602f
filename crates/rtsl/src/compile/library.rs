//! The standard library of shaders, which is built in.

use std::collections::BTreeMap;
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
    static FILES: LazyLock<BTreeMap<&str, &LibraryFile>> = LazyLock::new(|| {
        // Comments have false names, too: the first file counts.
        let mut files = BTreeMap::new();
        classes().for_each(|(class, file)| {
            files.entry(class).or_insert(file);
        });
        files
    });
    FILES.get(name).copied()
}

/// Returns the names of all classes of the standard library with their files, in the order of files.
pub fn classes() -> impl Iterator<Item = (&'static str, &'static LibraryFile)> {
    files().iter().flat_map(|file| declared_classes(file.text).map(move |class| (class, file)))
}

/// Returns the names that follow the word `class` in a text, without parsing it. Comments may add false ones.
pub fn declared_classes(text: &str) -> impl Iterator<Item = &str> {
    let separator = |letter: char| !(letter.is_ascii_alphanumeric() || letter == '_');
    let mut words = text.split(separator).filter(|word| !word.is_empty());
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
    let of_name = classes().filter(|(class, _)| *class == name);
    for (_, file) in of_name {
        let Some(unit) = compiler.compile(file.path, file.text).unit else { continue };
        if unit.class(name).is_ok() {
            return Ok(unit);
        }
    }
    let mut names: Vec<&str> = classes().map(|(class, _)| class).collect();
    names.sort_unstable();
    Err(unknown_class(name, names))
}
