//! The lines of texts on which a debugger can stop.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_ir::{Place, Source};

/// The lines with statements, by the names of their texts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SteppedLines {
    texts: BTreeMap<String, SteppedText>,
}

/// A text with the lines of its statements.
#[derive(Clone, Debug, PartialEq)]
pub struct SteppedText {
    /// The text.
    pub source: Arc<Source>,
    /// The lines, from 1, in order.
    pub lines: Vec<u32>,
}

impl SteppedLines {
    /// Returns the texts.
    pub fn texts(&self) -> impl Iterator<Item = &SteppedText> {
        self.texts.values()
    }

    /// Drops what follows in a text, which its author has not written.
    pub fn cut(&mut self, name: &str, length: usize) {
        let Some(text) = self.texts.get_mut(name) else { return };
        let Some(kept) = text.source.text.get(..length) else { return };
        let source = Source::new(name, kept);
        let last = kept.lines().count() as u32;
        text.lines.retain(|line| *line <= last);
        text.source = Arc::new(source);
    }

    /// Adds the line of a statement.
    pub fn add(&mut self, place: &Place) {
        let name = &place.source.name;
        if !self.texts.contains_key(name) {
            let text = SteppedText { source: place.source.clone(), lines: Vec::new() };
            self.texts.insert(name.clone(), text);
        }
        let text = self.texts.get_mut(name).map(|text| &mut text.lines);
        let line = place.line();
        if let Some(lines) = text
            && let Err(index) = lines.binary_search(&line)
        {
            lines.insert(index, line);
        }
    }
}
