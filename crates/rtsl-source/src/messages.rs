//! The errors and warnings of a scene and of the shaders it uses, with their source texts.

use crate::{Diagnostic, Diagnostics, SourceMap, render};

/// Diagnostics with the source maps that their spans refer to, in the order they arose.
#[derive(Clone, Debug, Default)]
pub struct Messages {
    parts: Vec<(SourceMap, Diagnostics)>,
    notes: Vec<String>,
}

impl Messages {
    /// Adds diagnostics about `sources`.
    pub fn push(&mut self, sources: SourceMap, diagnostics: Diagnostics) {
        if !diagnostics.is_empty() {
            self.parts.push((sources, diagnostics));
        }
    }

    /// A list of one diagnostic that refers to no text.
    pub fn one(diagnostic: Diagnostic) -> Self {
        let mut messages = Messages::default();
        messages.push_one(diagnostic);
        messages
    }

    /// Adds a diagnostic that refers to no text.
    pub fn push_one(&mut self, diagnostic: Diagnostic) {
        let mut diagnostics = Diagnostics::new();
        diagnostics.push(diagnostic);
        self.push(SourceMap::new(), diagnostics);
    }

    /// Adds a note for the user about something that is as it should be.
    pub fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// Returns the notes.
    pub fn notes(&self) -> impl Iterator<Item = &str> {
        self.notes.iter().map(String::as_str)
    }

    /// True if any diagnostic is an error.
    pub fn has_errors(&self) -> bool {
        self.parts.iter().any(|(_, diagnostics)| diagnostics.has_errors())
    }

    /// True if there are no diagnostics.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Each diagnostic with the source map it refers to.
    pub fn iter(&self) -> impl Iterator<Item = (&SourceMap, &Diagnostic)> {
        let parts = self.parts.iter();
        parts.flat_map(|(sources, list)| list.iter().map(move |diagnostic| (sources, diagnostic)))
    }

    /// Formats all diagnostics for a terminal.
    pub fn to_text(&self, color: bool) -> String {
        let parts = self.parts.iter();
        parts.map(|(sources, list)| render::all_to_text(sources, list.iter(), color)).collect()
    }
}
