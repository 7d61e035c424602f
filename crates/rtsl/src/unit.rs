//! Compiled files.

use std::sync::Arc;

use rtsl_ir::class::Class;
use rtsl_source::{Diagnostic, Diagnostics, SourceMap};

use crate::errors;

/// The classes of a file.
#[derive(Clone, Debug, Default)]
pub struct Unit {
    pub(crate) classes: Vec<Arc<Class>>,
}

impl Unit {
    /// The classes, in the order of the text.
    pub fn classes(&self) -> &[Arc<Class>] {
        &self.classes
    }

    /// The class of this name.
    ///
    /// # Errors
    /// Where there is none, with the name that was probably meant.
    pub fn class(&self, name: &str) -> Result<&Arc<Class>, Diagnostic> {
        let names = self.classes.iter().map(|class| class.name.as_str());
        let found = self.classes.iter().find(|class| class.name == name);
        found.ok_or_else(|| errors::unknown_class(name, names))
    }
}

/// What compiling a file gave.
#[derive(Clone, Debug)]
pub struct Compilation {
    /// The classes; `None` if there are errors.
    pub unit: Option<Unit>,
    /// Errors and warnings.
    pub diagnostics: Diagnostics,
    /// The texts that the diagnostics' spans point into.
    pub sources: SourceMap,
}

impl Compilation {
    /// All diagnostics as text for a terminal.
    pub fn report(&self, color: bool) -> String {
        rtsl_source::render::all_to_text(&self.sources, self.diagnostics.iter(), color)
    }
}
