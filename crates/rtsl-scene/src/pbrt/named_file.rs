//! The file that an entity names by `filename`.

use std::path::PathBuf;

use rtsl::{Diagnostic, diagnostic_codes as codes};
use rtsl_memory::Amount;

use crate::description::Entity;
use crate::reader::{Input, Parameter, SceneFiles, unreadable};

/// A file, and where the scene names it.
pub struct NamedFile<'e> {
    /// Relative to the working directory, or absolute.
    pub path: PathBuf,
    parameter: &'e Parameter,
}

impl<'e> NamedFile<'e> {
    /// # Errors
    /// If the entity names no file.
    pub fn of(entity: &'e Entity, files: SceneFiles<'_>) -> Result<NamedFile<'e>, Box<Diagnostic>> {
        match entity.text("filename").filter(|(name, _)| !name.is_empty()) {
            Some((name, parameter)) => Ok(NamedFile { path: files.path(name), parameter }),
            None => {
                let message = format!("`{}` names no file", entity.class);
                let diagnostic = Diagnostic::new(codes::MISSING_PARAMETER, message);
                Err(Box::new(diagnostic.at(entity.class_span, "expected `\"string filename\"`")))
            }
        }
    }

    /// Reads the file. What is made of it takes at most `growth` bytes of memory for each byte.
    ///
    /// # Errors
    /// If the file cannot be read, or the budget does not allow that memory.
    pub fn read(&self, files: SceneFiles<'_>, growth: usize) -> Result<Input, Box<Diagnostic>> {
        let input = files.read(&self.path).and_then(|mut input| {
            input.held.grow_to(Amount(input.bytes.len() as u64).times(growth))?;
            Ok(input)
        });
        input.map_err(|error| self.at(unreadable(&self.path, &error)))
    }

    /// A diagnostic on the file, with the place where the scene names it.
    pub fn at(&self, diagnostic: Diagnostic) -> Box<Diagnostic> {
        Box::new(diagnostic.at(self.parameter.values_span, "named here"))
    }
}
