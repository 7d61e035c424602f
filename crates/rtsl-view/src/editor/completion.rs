//! The list of what could be typed, below the cursor.

use std::ops::Range;

use egui::{Area, Frame, Id, InputState, Key, Order, Pos2, RichText, ScrollArea, Ui};
use rtsl_ide::CompletionItem;

use crate::theme;

/// The greatest number of items that are listed.
const LISTED: usize = 60;

/// The texts that fit the place of a word.
#[derive(Debug, Default)]
pub struct Completion {
    /// The start of the word, in bytes of the text.
    start: usize,
    items: Vec<CompletionItem>,
    selected: usize,
    /// True while the list is shown.
    is_open: bool,
}

/// The requests of the keys of the list.
#[derive(Clone, Copy, Debug, Default)]
pub struct ListKeys {
    /// The selected item is to be inserted.
    accepts: bool,
    /// The list is to be closed.
    closes: bool,
    /// The number of items further down.
    moves: isize,
}

impl Completion {
    /// Returns the list of an answer about these bytes of a text.
    pub fn new(range: Range<usize>, items: Vec<CompletionItem>) -> Completion {
        Completion { start: range.start, items, selected: 0, is_open: true }
    }

    /// Takes the keys of the list from the input, before a text sees them.
    pub fn take_keys(&self, input: &mut InputState) -> ListKeys {
        let mut keys = ListKeys::default();
        if !self.is_open {
            return keys;
        }
        let mut pressed = |key| input.consume_key(egui::Modifiers::NONE, key);
        keys.accepts = pressed(Key::Enter) | pressed(Key::Tab);
        keys.closes = pressed(Key::Escape);
        keys.moves = isize::from(pressed(Key::ArrowDown)) - isize::from(pressed(Key::ArrowUp));
        keys
    }

    /// Shows the items that fit the word before the cursor, below it. Returns the bytes that are replaced, and their
    /// new text, if an item is chosen.
    pub fn show(
        &mut self,
        ui: &Ui,
        text: &str,
        cursor: usize,
        at: Pos2,
        keys: ListKeys,
    ) -> Option<(Range<usize>, String)> {
        let word = text.get(self.start..cursor);
        // The cursor may have left the word.
        let word = word.filter(|word| word.chars().all(is_of_word)).unwrap_or("\n").to_owned();
        let fitting = self.fitting(&word);
        if fitting.is_empty() || keys.closes {
            *self = Completion::default();
            return None;
        }
        let count = fitting.len() as isize;
        let selected = (self.selected as isize + keys.moves).rem_euclid(count) as usize;
        let clicked = show_list(ui, &fitting, selected, at, keys.moves != 0);
        let chosen = clicked.or(keys.accepts.then_some(selected));
        let inserted = chosen.map(|index| inserted(fitting[index]));
        self.selected = selected;
        self.is_open = inserted.is_none();
        let range = self.start..cursor;
        if !self.is_open {
            *self = Completion::default();
        }
        inserted.map(|inserted| (range, inserted))
    }

    /// The items that begin with a word, the likeliest first.
    fn fitting(&self, word: &str) -> Vec<&CompletionItem> {
        let lower = word.to_lowercase();
        let fits = |item: &&CompletionItem| {
            item.label.to_lowercase().starts_with(&lower) && item.label != word
        };
        let mut fitting: Vec<&CompletionItem> = self.items.iter().filter(fits).collect();
        fitting.sort_by(|one, other| (one.rank, &one.label).cmp(&(other.rank, &other.label)));
        fitting.truncate(LISTED);
        fitting
    }
}

fn show_list(
    ui: &Ui,
    items: &[&CompletionItem],
    selected: usize,
    at: Pos2,
    is_moved: bool,
) -> Option<usize> {
    let mut clicked = None;
    let area = Area::new(Id::unique("completions")).order(Order::Foreground).fixed_pos(at);
    area.show(ui.ctx(), |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            ScrollArea::vertical().max_height(180.0).show(ui, |ui| {
                for (index, item) in items.iter().enumerate() {
                    let label = RichText::new(&item.label).monospace();
                    let line = ui.horizontal(|ui| {
                        let shown = ui.selectable_label(index == selected, label);
                        if let Some(detail) = &item.detail {
                            let detail: String = detail.chars().take(60).collect();
                            ui.label(RichText::new(detail).small().color(theme::FAINT));
                        }
                        shown
                    });
                    if index == selected && is_moved {
                        line.inner.scroll_to_me(None);
                    }
                    if line.inner.clicked() {
                        clicked = Some(index);
                    }
                }
            });
        });
    });
    clicked
}

/// True for the letters of words.
pub fn is_of_word(letter: char) -> bool {
    letter.is_alphanumeric() || letter == '_'
}

fn inserted(item: &CompletionItem) -> String {
    item.insert.as_deref().map_or_else(|| item.label.clone(), without_places)
}

/// Removes the places for the author's own words from a template: `$1`, `$0`, `${1:i}`.
fn without_places(template: &str) -> String {
    let mut text = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once('$') {
        text.push_str(before);
        rest = match after.strip_prefix('{').and_then(|after| after.split_once('}')) {
            Some((place, after)) => {
                text.push_str(place.split_once(':').map_or("", |(_, default)| default));
                after
            }
            None => after.trim_start_matches(|letter: char| letter.is_ascii_digit()),
        };
    }
    text + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_become_plain_texts() {
        let template = "for (int ${1:i} = 0; ${1:i} < $2; ++${1:i}) {\n    $0\n}";
        assert_eq!(without_places(template), "for (int i = 0; i < ; ++i) {\n    \n}");
        assert_eq!(without_places("plain"), "plain");
    }

    #[test]
    fn items_fit_the_word() {
        let item = |label: &str, rank| CompletionItem {
            label: label.to_owned(),
            kind: rtsl_ide::SemanticKind::Function,
            detail: None,
            documentation: None,
            insert: None,
            rank,
        };
        let items = vec![item("sin", 2), item("sinh", 1), item("cos", 0)];
        let completion = Completion::new(4..6, items);
        let found = |word: &str| -> Vec<String> {
            completion.fitting(word).into_iter().map(|it| it.label.clone()).collect()
        };
        assert_eq!(found("si"), ["sinh", "sin"]);
        assert_eq!(found("SI"), ["sinh", "sin"]);
        assert_eq!(found("sin"), ["sinh"], "what stands there is not offered");
        assert_eq!(found("x"), [""; 0]);
    }
}
