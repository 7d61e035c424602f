//! The pane of the editor: the texts of the scene in tabs, with their errors while someone types.

mod analyst;
mod buffer;
mod completion;
mod highlight;
mod text_view;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use egui::{Context, Panel, RichText, ScrollArea, Ui};

use crate::costs::LineCosts;
use crate::theme;
use analyst::{Analyst, Answer, Found, Question, Request};
use buffer::{Buffer, SaveError};
use completion::Completion;
use text_view::{TextView, Typing};

/// The texts of a scene.
pub struct Editor {
    buffers: Vec<Buffer>,
    current: usize,
    analyst: Analyst,
    typing: Typing,
    /// The line of the current text to be scrolled into view, from 1.
    sought: Option<usize>,
    /// The lines at which runs of the debugger end, by the names of texts.
    breakpoints: BTreeMap<String, BTreeSet<u32>>,
    /// The error of the last file that could not be opened or saved.
    error: Option<String>,
}

/// The notes beside the lines of texts.
#[derive(Default)]
pub struct Notes<'a> {
    /// The text and the line at which the debugger stands.
    pub position: Option<(&'a str, u32)>,
    /// The values beside the lines of that text.
    pub values: Option<&'a BTreeMap<u32, String>>,
    /// The costs of lines.
    pub costs: Option<&'a LineCosts>,
}

/// An action of someone in the editor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Done {
    /// A file was saved.
    Saved,
    /// Breakpoints were set or removed.
    Breakpoints,
}

impl Editor {
    /// Returns an editor without texts. Includes of texts come from `search_path`, too.
    pub fn new(context: &Context, search_path: Vec<PathBuf>) -> Editor {
        let context = context.clone();
        Editor {
            buffers: Vec::new(),
            current: 0,
            analyst: Analyst::new(search_path, move || context.request_repaint()),
            typing: Typing::default(),
            sought: None,
            breakpoints: BTreeMap::new(),
            error: None,
        }
    }

    /// Opens the files of the scene that are not open yet, shaders first; those that are no texts are left out.
    pub fn open_all(&mut self, files: &[PathBuf]) {
        let is_shader = |path: &&PathBuf| path.extension().is_some_and(|it| it == "rtsl");
        let is_scene = |path: &&PathBuf| path.extension().is_some_and(|it| it == "pbrt");
        let shaders = files.iter().filter(is_shader);
        for path in shaders.chain(files.iter().filter(is_scene)) {
            if self.index_of(&path.display().to_string()).is_none()
                && let Ok(buffer) = Buffer::open(path)
            {
                self.add(buffer);
            }
        }
    }

    /// Shows a line of a text, from 1. A text that is no file is shown as `built_in` says.
    pub fn go_to(&mut self, name: &str, line: Option<usize>, built_in: Option<&str>) {
        self.sought = line;
        if let Some(index) = self.index_of(name) {
            self.current = index;
            return;
        }
        let is_file = rtsl::library::file(name).is_none() && Path::new(name).is_file();
        let opened = match (is_file, built_in) {
            (false, Some(text)) => Ok(Buffer::built_in(name.to_owned(), text.to_owned())),
            _ => Buffer::open(Path::new(name)),
        };
        match opened {
            Ok(buffer) => {
                self.add(buffer);
                self.current = self.buffers.len() - 1;
            }
            Err(error) => self.error = Some(format!("cannot open `{name}`: {error}")),
        }
    }

    /// Sets a breakpoint.
    pub fn set_breakpoint(&mut self, name: &str, line: u32) {
        self.breakpoints.entry(name.to_owned()).or_default().insert(line);
    }

    /// Returns the breakpoints: names of texts, and lines.
    pub fn breakpoints(&self) -> impl Iterator<Item = (&str, u32)> {
        let texts = self.breakpoints.iter();
        texts.flat_map(|(name, lines)| lines.iter().map(move |line| (name.as_str(), *line)))
    }

    /// Returns the titles of texts that differ from their files.
    pub fn unsaved(&self) -> Vec<&str> {
        self.buffers.iter().filter(|it| it.is_unsaved()).map(Buffer::title).collect()
    }

    /// Looks whether other programs have changed the files.
    pub fn look_at_files(&mut self) {
        for index in 0..self.buffers.len() {
            self.buffers[index].look_at_file();
            // Includes may have changed, so that all texts are analysed again.
            self.analyse(index);
        }
    }

    /// Saves the current text. Returns true if it was written.
    pub fn save(&mut self) -> bool {
        self.save_at(self.current)
    }

    /// Saves all texts. Returns true if all of them could be written.
    pub fn save_all(&mut self) -> bool {
        (0..self.buffers.len())
            .all(|index| !self.buffers[index].is_unsaved() || self.save_at(index))
    }

    fn save_at(&mut self, index: usize) -> bool {
        let Some(buffer) = self.buffers.get_mut(index).filter(|buffer| buffer.is_editable()) else {
            return false;
        };
        let saved = buffer.save();
        self.error = match &saved {
            // The bar above the text tells of it.
            Ok(()) | Err(SaveError::Conflict(_)) => None,
            Err(error) => Some(error.to_string()),
        };
        self.look_at_files();
        saved.is_ok()
    }

    /// True while something about a text is being found out.
    pub fn is_busy(&self) -> bool {
        self.analyst.is_busy()
    }

    fn index_of(&self, name: &str) -> Option<usize> {
        let is_same = |buffer: &Buffer| is_same_text(&buffer.name, name);
        self.buffers.iter().position(is_same)
    }

    fn add(&mut self, buffer: Buffer) {
        self.buffers.push(buffer);
        self.analyse(self.buffers.len() - 1);
    }

    fn analyse(&mut self, index: usize) {
        self.ask(index, Question::Findings);
    }

    fn ask(&mut self, index: usize, question: Question) {
        let Some(buffer) = self.buffers.get(index).filter(|buffer| buffer.is_shader()) else {
            return;
        };
        let (name, version, text) = (buffer.name.clone(), buffer.version, buffer.text.clone());
        self.analyst.ask(Request { name, version, text, question });
    }

    fn take_answers(&mut self) {
        while let Some(Answer { name, found }) = self.analyst.answer() {
            let index = self.buffers.iter().position(|buffer| buffer.name == name);
            let Some(index) = index else { continue };
            match found {
                Found::Findings(findings) => self.buffers[index].findings = findings.into(),
                Found::Hover(offset, text) if index == self.current => {
                    self.typing.described = Some((offset, text));
                }
                Found::Completions(range, items) if index == self.current => {
                    self.typing.completion = Completion::new(range, items);
                }
                Found::Hover(..) | Found::Completions(..) => {}
            }
        }
    }

    // The pane.

    /// Shows the pane.
    pub fn show(&mut self, ui: &mut Ui, notes: &Notes<'_>) -> Option<Done> {
        self.take_answers();
        let mut done = None;
        self.show_tabs(ui, &mut done);
        self.show_conflict(ui);
        if let Some(error) = self.error.clone() {
            ui.horizontal_wrapped(|ui| {
                ui.colored_label(theme::ERROR, error);
                if ui.small_button("×").clicked() {
                    self.error = None;
                }
            });
        }
        if self.buffers.is_empty() {
            ui.label(RichText::new("The scene has no shader of its own.").color(theme::FAINT));
            return done;
        }
        self.show_problems(ui);
        self.show_text(ui, notes, &mut done);
        done
    }

    fn show_tabs(&mut self, ui: &mut Ui, done: &mut Option<Done>) {
        ui.horizontal_wrapped(|ui| {
            for (index, buffer) in self.buffers.iter().enumerate() {
                let mark = if buffer.is_unsaved() { " •" } else { "" };
                let title = format!("{}{mark}", buffer.title());
                let tab = ui.selectable_label(index == self.current, title);
                if tab.on_hover_text(&buffer.name).clicked() {
                    self.current = index;
                    self.typing = Typing::default();
                }
            }
            let current = self.buffers.get(self.current);
            if current.is_some_and(|buffer| !buffer.is_editable()) {
                ui.label(RichText::new("built in, read-only").color(theme::FAINT));
            }
            let can_save = current.is_some_and(Buffer::is_unsaved);
            let save = ui.add_enabled(can_save, egui::Button::new("Save"));
            if save.on_hover_text("Writes the file, and shows its effect (ctrl + S)").clicked()
                && self.save()
            {
                *done = Some(Done::Saved);
            }
        });
    }

    fn show_conflict(&mut self, ui: &mut Ui) {
        let Some(buffer) = self.buffers.get_mut(self.current) else { return };
        let what = match &buffer.conflict {
            None => return,
            Some(buffer::Conflict::Changed(_)) => "Another program has changed the file.",
            Some(buffer::Conflict::Removed) => "The file is gone.",
        };
        let mut resolved = None;
        ui.horizontal_wrapped(|ui| {
            ui.colored_label(theme::WARNING, what);
            if ui.button("Load the file").clicked() {
                resolved = Some(true);
            }
            if ui.button("Keep this text").clicked() {
                resolved = Some(false);
            }
        });
        if let Some(takes_file) = resolved {
            buffer.resolve(takes_file);
            self.analyse(self.current);
        }
    }

    fn show_problems(&mut self, ui: &mut Ui) {
        let problems = &self.buffers[self.current].findings.problems;
        if problems.is_empty() {
            return;
        }
        let mut chosen = None;
        let panel = Panel::bottom("problems").resizable(true).default_size(96.0).min_size(40.0);
        panel.show(ui, |ui| {
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                for problem in problems {
                    let color = if problem.is_error { theme::ERROR } else { theme::WARNING };
                    let line = format!("{} {}: {}", problem.line, problem.code, problem.message);
                    let label = egui::Label::new(RichText::new(line).color(color)).wrap();
                    let label = ui.add(label.sense(egui::Sense::click()));
                    if label.on_hover_cursor(egui::CursorIcon::PointingHand).clicked() {
                        chosen = Some(problem.line);
                    }
                    for detail in &problem.details {
                        let text = RichText::new(detail).small().color(theme::FAINT);
                        ui.add(egui::Label::new(text).wrap());
                    }
                }
            });
        });
        self.sought = chosen.or(self.sought);
    }

    fn show_text(&mut self, ui: &mut Ui, notes: &Notes<'_>, done: &mut Option<Done>) {
        let buffer = &mut self.buffers[self.current];
        let name = buffer.name.clone();
        let none = BTreeSet::new();
        let view = TextView {
            breakpoints: self.breakpoints.get(&name).unwrap_or(&none),
            position: notes.position.filter(|(text, _)| is_same_text(text, &name)).map(|it| it.1),
            values: notes
                .values
                .filter(|_| notes.position.is_some_and(|(text, _)| is_same_text(text, &name))),
            costs: notes.costs.and_then(|costs| costs.of_text(|text| is_same_text(text, &name))),
            sought: self.sought.take(),
        };
        let asked = view.show(ui, buffer, &mut self.typing);
        if let Some(line) = asked.breakpoint {
            let lines = self.breakpoints.entry(name).or_default();
            if !lines.remove(&line) {
                lines.insert(line);
            }
            *done = done.take().or(Some(Done::Breakpoints));
        }
        if asked.is_changed {
            self.analyse(self.current);
        }
        asked.questions.into_iter().for_each(|question| self.ask(self.current, question));
    }

    /// Returns the current text.
    #[cfg(test)]
    pub fn text(&self) -> &str {
        &self.buffers[self.current].text
    }

    /// Returns the messages about the current text.
    #[cfg(test)]
    pub fn problems(&self) -> Vec<(usize, String)> {
        let problems = self.buffers[self.current].findings.problems.iter();
        problems.map(|problem| (problem.line, problem.message.clone())).collect()
    }
}

/// True if two names mean one text: that of a file, whatever way leads to it.
pub fn is_same_text(one: &str, other: &str) -> bool {
    let real = |name: &str| Path::new(name).canonicalize().ok();
    one == other
        || (Path::new(one).file_name() == Path::new(other).file_name()
            && real(one).is_some_and(|path| Some(path) == real(other)))
}
