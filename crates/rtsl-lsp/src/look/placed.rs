//! The looks that editors show: their notes, at the lines where they are now.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use lsp_types::Uri;
use serde_json::{Value, json};

use super::unchanged::unchanged_lines;
use super::{Fault, LineNote, Look, LookKind, TextNotes};
use crate::place::uri_of;
use crate::workspace::{Workspace, small_text, without_links};

/// The looks that are shown: one of each kind.
#[derive(Debug, Default)]
pub struct Looks {
    costs: Vec<PlacedText>,
    pixel: Vec<PlacedText>,
}

/// A text with notes.
#[derive(Debug)]
struct PlacedText {
    /// The path without links.
    path: PathBuf,
    uri: Uri,
    /// The text that the program has run.
    text: String,
    notes: TextNotes,
}

/// Something at a line of an open text.
#[derive(Debug)]
pub struct PlacedNote<'l, T> {
    /// The line in the open text, from 0.
    pub line: u32,
    /// The note or the fault.
    pub note: &'l T,
}

impl Looks {
    /// Shows a look instead of an earlier one of its kind, and returns the texts with notes for the answer. `texts` are
    /// those that were open when the run started.
    pub fn show(
        &mut self,
        kind: LookKind,
        look: Look,
        texts: &BTreeMap<PathBuf, String>,
        workspace: &Workspace,
    ) -> Value {
        let placed = look.texts.into_iter().filter_map(|notes| placed(notes, texts, workspace));
        let placed: Vec<PlacedText> = placed.collect();
        let files = placed.iter().map(|text| text.answer(workspace)).collect();
        match kind {
            LookKind::Costs => self.costs = placed,
            LookKind::Pixel => self.pixel = placed,
        }
        files
    }

    /// Forgets all looks.
    pub fn clear(&mut self) {
        *self = Looks::default();
    }

    /// Returns the URIs of the texts with faults.
    pub fn faulty(&self, workspace: &Workspace) -> Vec<Uri> {
        let faulty = self.pixel.iter().filter(|text| !text.notes.faults.is_empty());
        faulty.map(|text| text.shown_uri(workspace)).collect()
    }

    /// Returns the notes of a text, sorted by kinds and lines. Lines that have changed since the run have none.
    pub fn notes<'l>(&'l self, path: &Path, text: &str) -> Vec<PlacedNote<'l, LineNote>> {
        let mut notes = Vec::new();
        for placed in self.of(path) {
            let lines = unchanged_lines(&placed.text, text);
            notes.extend(placed.notes.notes.iter().filter_map(|note| {
                let line = (*lines.get(note.line as usize)?)?;
                Some(PlacedNote { line, note })
            }));
        }
        notes
    }

    /// Returns the faults of a text, likewise.
    pub fn faults<'l>(&'l self, path: &Path, text: &str) -> Vec<PlacedNote<'l, Fault>> {
        let mut faults = Vec::new();
        for placed in self.of(path).filter(|placed| !placed.notes.faults.is_empty()) {
            let lines = unchanged_lines(&placed.text, text);
            let line_of = |line: u32| *lines.get(line as usize)?;
            faults.extend(placed.notes.faults.iter().filter_map(|note| {
                let line = line_of(note.start.0)?;
                let is_whole = line_of(note.end.0)? - line == note.end.0 - note.start.0;
                is_whole.then_some(PlacedNote { line, note })
            }));
        }
        faults
    }

    /// Returns the place of a line of a pixel's text; `None` if it has changed since the run.
    pub fn line_now(&self, path: &Path, text: &str, line: u32) -> Option<u32> {
        let path = without_links(path);
        let placed = self.pixel.iter().find(|text| text.path == path)?;
        *unchanged_lines(&placed.text, text).get(line as usize)?
    }

    fn of(&self, path: &Path) -> impl Iterator<Item = &PlacedText> {
        let path = without_links(path);
        self.costs.iter().chain(&self.pixel).filter(move |text| text.path == path)
    }
}

impl PlacedText {
    /// The text for the answer, with the lines of the open text.
    fn answer(&self, workspace: &Workspace) -> Value {
        let open = workspace.open_at(&self.path);
        let lines = open.map(|(_, text)| unchanged_lines(&self.text, text));
        let notes = self.notes.notes.iter().filter_map(|note| {
            let line = match &lines {
                Some(lines) => (*lines.get(note.line as usize)?)?,
                None => note.line,
            };
            let mut members = note.data.clone();
            members.insert("line".to_owned(), json!(line));
            members.insert("label".to_owned(), json!(note.label));
            members.insert("tooltip".to_owned(), json!(note.tooltip));
            Some(Value::Object(members))
        });
        let lines: Vec<Value> = notes.collect();
        json!({"uri": self.shown_uri(workspace).as_str(), "lines": lines})
    }

    /// The URI by which the editor knows the text.
    fn shown_uri(&self, workspace: &Workspace) -> Uri {
        workspace.open_at(&self.path).map_or_else(|| self.uri.clone(), |(uri, _)| uri.clone())
    }
}

/// Finds a text on the disk. Texts that are generated have no place.
fn placed(
    notes: TextNotes,
    texts: &BTreeMap<PathBuf, String>,
    workspace: &Workspace,
) -> Option<PlacedText> {
    let named = path_of_name(&notes.name, workspace)?;
    let path = without_links(&named);
    let text = texts.get(&path).cloned().or_else(|| small_text(&path))?;
    Some(PlacedText { path, uri: uri_of(&named)?, text, notes })
}

/// The path of a text: in the folder of the library's files, or relative to the folder where the program runs.
pub fn path_of_name(name: &str, workspace: &Workspace) -> Option<PathBuf> {
    match rtsl::library::file(name) {
        Some(file) => workspace.library.path_of(name, file.text),
        None => std::path::absolute(name).ok(),
    }
}
