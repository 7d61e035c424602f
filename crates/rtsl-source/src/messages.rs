//! Errors and warnings of a scene and of the shaders it uses, each with the texts it speaks of.

use crate::{Diagnostic, Diagnostics, SourceMap, render};

/// Diagnostics with the texts that their places point into, in the order they arose.
#[derive(Clone, Debug, Default)]
pub struct Messages {
    parts: Vec<(SourceMap, Diagnostics)>,
}

impl Messages {
    /// Adds diagnostics about `sources`.
    pub fn push(&mut self, sources: SourceMap, diagnostics: Diagnostics) {
        if !diagnostics.is_empty() {
            self.parts.push((sources, diagnostics));
        }
    }

    /// One diagnostic that is about no text.
    pub fn one(diagnostic: Diagnostic) -> Self {
        let mut messages = Messages::default();
        messages.push_one(diagnostic);
        messages
    }

    /// Adds a diagnostic that is about no text.
    pub fn push_one(&mut self, diagnostic: Diagnostic) {
        let mut diagnostics = Diagnostics::new();
        diagnostics.push(diagnostic);
        self.push(SourceMap::new(), diagnostics);
    }

    /// Whether any is an error.
    pub fn has_errors(&self) -> bool {
        self.parts.iter().any(|(_, diagnostics)| diagnostics.has_errors())
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Each diagnostic with the texts it is about.
    pub fn iter(&self) -> impl Iterator<Item = (&SourceMap, &Diagnostic)> {
        let parts = self.parts.iter();
        parts.flat_map(|(sources, list)| list.iter().map(move |diagnostic| (sources, diagnostic)))
    }

    /// All of them as text for a terminal.
    pub fn to_text(&self, color: bool) -> String {
        let parts = self.parts.iter();
        parts.map(|(sources, list)| render::all_to_text(sources, list.iter(), color)).collect()
    }
}
