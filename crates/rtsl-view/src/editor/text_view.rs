//! A text with its margin: breakpoints, numbers and costs of lines, and values beside them.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use egui::text::{CCursor, CCursorRange, CharIndex, LayoutJob};
use egui::{
    Align, Align2, Color32, FontId, Frame, Galley, Pos2, Rect, RichText, ScrollArea, Sense, Shape,
    TextEdit, Ui,
};

use super::analyst::Question;
use super::buffer::Buffer;
use super::completion::{Completion, ListKeys, is_of_word};
use super::highlight::{Moved, problem_range};
use crate::costs::TextCosts;
use crate::theme;

/// The width of line numbers, and of the column of costs.
const NUMBERS: f32 = 46.0;
const COSTS: f32 = 58.0;

/// The notes beside a text.
pub struct TextView<'a> {
    /// The lines with breakpoints.
    pub breakpoints: &'a BTreeSet<u32>,
    /// The line at which the debugger stands, from 1.
    pub position: Option<u32>,
    /// The values beside lines.
    pub values: Option<&'a BTreeMap<u32, String>>,
    /// The costs of lines.
    pub costs: Option<&'a TextCosts>,
    /// The line to be scrolled into view.
    pub sought: Option<usize>,
}

/// The state of typing in a text.
#[derive(Default)]
pub struct Typing {
    /// The byte under the pointer that was asked about.
    hovered: Option<usize>,
    /// The description of the word at a byte.
    pub described: Option<(usize, Option<String>)>,
    /// The texts that fit the place of the cursor.
    pub completion: Completion,
    /// The width of the lines with the values beside them.
    width: f32,
}

/// The requests of a text view.
#[derive(Default)]
pub struct Asked {
    /// A breakpoint is set at this line, or removed.
    pub breakpoint: Option<u32>,
    /// The text has changed.
    pub is_changed: bool,
    /// Questions about the text.
    pub questions: Vec<Question>,
}

impl TextView<'_> {
    /// Shows a text.
    pub fn show(&self, ui: &mut Ui, buffer: &mut Buffer, typing: &mut Typing) -> Asked {
        let mut asked = Asked::default();
        let id = ui.make_persistent_id(("text", &buffer.name));
        let area = ScrollArea::both().id_salt(&buffer.name).auto_shrink(false);
        area.show(ui, |ui| self.show_in_area(ui, buffer, typing, id, &mut asked));
        asked
    }

    fn margin(&self) -> f32 {
        NUMBERS + if self.costs.is_some() { COSTS } else { 0.0 }
    }

    fn show_in_area(
        &self,
        ui: &mut Ui,
        buffer: &mut Buffer,
        typing: &mut Typing,
        id: egui::Id,
        asked: &mut Asked,
    ) {
        let font = egui::TextStyle::Monospace.resolve(ui.style());
        let behind = ui.painter().add(Shape::Noop);
        let is_editable = buffer.is_editable();
        let (mut text, mut fixed) = (buffer.text.clone(), buffer.text.as_str());
        let (findings, highlighter) = (&buffer.findings, &mut buffer.highlighter);
        let mut layouter = |ui: &Ui, text: &dyn egui::TextBuffer, _wrap: f32| {
            let job = highlighter.job(text.as_str(), findings, &font);
            ui.fonts_mut(|fonts| fonts.layout_job(LayoutJob::clone(&job)))
        };
        let content: &mut dyn egui::TextBuffer = if is_editable { &mut text } else { &mut fixed };
        let margin = egui::Margin { left: self.margin() as i8, top: 2, right: 4, bottom: 2 };
        let keys = match ui.memory(|memory| memory.has_focus(id)) {
            true => ui.input_mut(|input| typing.completion.take_keys(input)),
            false => ListKeys::default(),
        };
        let edit = TextEdit::multiline(content)
            .id(id)
            .frame(Frame::NONE.inner_margin(margin))
            .lock_focus(true)
            .desired_width(f32::INFINITY)
            .min_size(ui.available_size().max(egui::vec2(typing.width, 0.0)))
            .font(font.clone())
            .layouter(&mut layouter);
        let output = edit.show(ui);
        let (galley, origin) = (output.galley.clone(), output.galley_pos);
        let cursor = output.cursor_range.map(|range| range.primary);
        if is_editable && text != buffer.text {
            buffer.replace(text);
            asked.is_changed = true;
            typing.described = None;
            self.ask_for_completions(buffer, cursor.map(|cursor| cursor.index), asked);
        }
        if let Some(cursor) = cursor.filter(|_| is_editable && output.response.has_focus()) {
            let below = galley.pos_from_cursor(cursor).left_bottom() + origin.to_vec2();
            let offset = byte_at(&buffer.text, cursor.index);
            let chosen = typing.completion.show(ui, &buffer.text, offset, below, keys);
            if let Some((range, inserted)) = chosen {
                insert(ui, id, buffer, range, &inserted);
                asked.is_changed = true;
            }
        }
        let painted = Painted { galley: &galley, origin, font: &font };
        self.show_line(ui, &painted, behind);
        typing.width = self.show_values(ui, &painted);
        self.show_margin(ui, &painted, buffer, asked);
        self.show_hover(ui, &output.response, &painted, buffer, typing, asked);
        if let Some(line) = self.sought {
            // The start of the line is what is sought, not its end.
            let left = origin.x - self.margin();
            let columns = left..=left + ui.clip_rect().width();
            if let Some(row) = painted.row(line.saturating_sub(1)) {
                let place = Rect::from_x_y_ranges(columns, row.y_range());
                ui.scroll_to_rect(place, Some(Align::Center));
            }
        }
    }

    fn ask_for_completions(&self, buffer: &Buffer, cursor: Option<CharIndex>, asked: &mut Asked) {
        let Some(offset) = cursor.map(|cursor| byte_at(&buffer.text, cursor)) else { return };
        let before = buffer.text[..offset].chars().next_back();
        if before.is_some_and(|letter| is_of_word(letter) || letter == '.') {
            asked.questions.push(Question::Completions(offset));
        }
    }

    /// Marks the line at which the debugger stands, behind the text.
    fn show_line(&self, ui: &Ui, painted: &Painted<'_>, behind: egui::layers::ShapeIdx) {
        let row = self.position.and_then(|line| painted.row(line as usize - 1));
        if let Some(row) = row {
            let rect = Rect::from_x_y_ranges(ui.clip_rect().x_range(), row.y_range());
            let fill = Color32::from_rgb(0x34, 0x40, 0x30);
            ui.painter().set(behind, Shape::rect_filled(rect, 0.0, fill));
        }
    }

    /// Shows the values beside lines; returns the width of the longest line with them.
    fn show_values(&self, ui: &Ui, painted: &Painted<'_>) -> f32 {
        let mut right = painted.origin.x;
        for (line, text) in self.values.into_iter().flatten() {
            let Some(row) = painted.row(*line as usize - 1) else { continue };
            if row.intersects(ui.clip_rect()) {
                let at = row.right_center() + egui::vec2(24.0, 0.0);
                let color = Color32::from_rgb(0x90, 0xC0, 0x80);
                let font = painted.font.clone();
                let shown = ui.painter().text(at, Align2::LEFT_CENTER, text, font, color);
                right = right.max(shown.right());
            }
        }
        right - painted.origin.x + self.margin()
    }

    /// Paints the margin over the text that is scrolled below it.
    fn show_margin(&self, ui: &mut Ui, painted: &Painted<'_>, buffer: &Buffer, asked: &mut Asked) {
        let clip = ui.clip_rect();
        let left = clip.left();
        let column = Rect::from_min_size(clip.min, egui::vec2(self.margin() - 4.0, clip.height()));
        let painter = ui.painter().clone();
        painter.rect_filled(column, 0.0, ui.visuals().panel_fill);
        let problems = lines_of_problems(buffer);
        let rows = 0..painted.galley.rows.len();
        for (index, row) in rows.filter_map(|index| Some((index, painted.row(index)?))) {
            if row.bottom() < clip.top() || row.top() > clip.bottom() {
                continue;
            }
            let line = index as u32 + 1;
            let number = Rect::from_min_max(
                egui::pos2(left, row.top()),
                egui::pos2(left + NUMBERS - 6.0, row.bottom()),
            );
            let color = match problems.get(&index) {
                Some(true) => theme::ERROR,
                Some(false) => theme::WARNING,
                None if self.position == Some(line) => theme::TEXT,
                None => Color32::from_rgb(0x70, 0x78, 0x80),
            };
            let (font, align) = (painted.font.clone(), Align2::RIGHT_CENTER);
            painter.text(number.right_center(), align, line.to_string(), font, color);
            if self.breakpoints.contains(&line) {
                let at = number.left_center() + egui::vec2(6.0, 0.0);
                painter.circle_filled(at, 4.0, Color32::from_rgb(0xE0, 0x50, 0x50));
            }
            if let Some(costs) = self.costs {
                show_cost(&painter, costs, line, number, painted.font);
            }
        }
        let numbers = column.with_max_x(left + NUMBERS);
        let margin = ui.interact(numbers, ui.scope_id().with("margin"), Sense::click());
        let margin = margin.on_hover_text("Sets or removes a breakpoint for replays");
        if margin.clicked()
            && let Some(at) = margin.interact_pointer_pos()
        {
            let row = painted.row_at(at.y);
            asked.breakpoint = row.map(|row| row as u32 + 1);
        }
    }

    /// Describes the problem or the word under the pointer.
    fn show_hover(
        &self,
        ui: &Ui,
        response: &egui::Response,
        painted: &Painted<'_>,
        buffer: &Buffer,
        typing: &mut Typing,
        asked: &mut Asked,
    ) {
        let pointer =
            response.hover_pos().filter(|at| at.x > ui.clip_rect().left() + self.margin());
        let Some(offset) = pointer.and_then(|at| painted.byte_at(&buffer.text, at)) else {
            typing.hovered = None;
            return;
        };
        if typing.hovered != Some(offset) {
            typing.hovered = Some(offset);
            asked.questions.push(Question::Hover(offset));
        }
        let moved = Moved::new(&buffer.findings.text, &buffer.text);
        let problem = buffer.findings.problems.iter().find(|problem| {
            problem_range(problem, &moved, &buffer.text)
                .is_some_and(|range| range.contains(&offset))
        });
        let word = typing.described.as_ref().filter(|(at, _)| *at == offset);
        let word = word.and_then(|(_, text)| text.as_deref());
        if problem.is_none() && word.is_none() {
            return;
        }
        response.clone().on_hover_ui_at_pointer(|ui| {
            ui.set_max_width(460.0);
            if let Some(problem) = problem {
                let color = if problem.is_error { theme::ERROR } else { theme::WARNING };
                ui.colored_label(color, format!("{}: {}", problem.code, problem.message));
                for detail in &problem.details {
                    ui.label(detail);
                }
            }
            if let Some(text) = word {
                show_markdown(ui, text);
            }
        });
    }
}

/// A text as it is painted.
struct Painted<'a> {
    galley: &'a Galley,
    origin: Pos2,
    font: &'a FontId,
}

impl Painted<'_> {
    /// The rectangle of a line, from 0: lines are not wrapped, so that each is a row.
    fn row(&self, index: usize) -> Option<Rect> {
        let row = self.galley.rows.get(index)?;
        Some(row.rect().translate(self.origin.to_vec2()))
    }

    fn row_at(&self, y: f32) -> Option<usize> {
        let rows = self.galley.rows.iter();
        rows.map(|row| row.rect().y_range())
            .position(|range| (range.min..range.max).contains(&(y - self.origin.y)))
    }

    /// The byte of the letter at a place, if there is one.
    fn byte_at(&self, text: &str, at: Pos2) -> Option<usize> {
        let index = self.row_at(at.y)?;
        let row = self.row(index)?;
        if at.x < row.left() || at.x > row.right() {
            return None;
        }
        let cursor = self.galley.cursor_from_pos(at - self.origin);
        Some(byte_at(text, cursor.index))
    }
}

/// Replaces bytes of a text, and puts the cursor behind what is inserted.
fn insert(ui: &Ui, id: egui::Id, buffer: &mut Buffer, range: Range<usize>, inserted: &str) {
    let mut text = buffer.text.clone();
    text.replace_range(range.clone(), inserted);
    let before = text[..range.start + inserted.len()].chars().count();
    buffer.replace(text);
    let mut state = TextEdit::load_state(ui.ctx(), id).unwrap_or_default();
    let cursor = CCursorRange::one(CCursor::new(CharIndex(before)));
    state.cursor.set_char_range(Some(cursor));
    TextEdit::store_state(ui.ctx(), id, state);
}

fn byte_at(text: &str, CharIndex(index): CharIndex) -> usize {
    text.char_indices().nth(index).map_or(text.len(), |(offset, _)| offset)
}

/// The lines with problems, from 0: true for those with errors.
fn lines_of_problems(buffer: &Buffer) -> BTreeMap<usize, bool> {
    let moved = Moved::new(&buffer.findings.text, &buffer.text);
    let mut lines = BTreeMap::new();
    for problem in &buffer.findings.problems {
        if let Some(range) = problem_range(problem, &moved, &buffer.text) {
            let line = buffer.text[..range.start].matches('\n').count();
            *lines.entry(line).or_default() |= problem.is_error;
        }
    }
    lines
}

fn show_cost(painter: &egui::Painter, costs: &TextCosts, line: u32, number: Rect, font: &FontId) {
    let Some(cost) = costs.lines.get(&line) else { return };
    let left = number.right() + 6.0;
    let column = Rect::from_x_y_ranges(left..=left + COSTS - 6.0, number.y_range());
    // The hottest line fills the column.
    let part = if costs.greatest > 0.0 { cost.share / costs.greatest } else { 0.0 };
    let bar = column.with_max_x(left + column.width() * part.clamp(0.0, 1.0));
    painter.rect_filled(bar.shrink2(egui::vec2(0.0, 1.0)), 1.0, crate::costs::color_of(part));
    let text = format!("{:.1} %", cost.share * 100.0);
    painter.text(column.right_center(), Align2::RIGHT_CENTER, text, font.clone(), theme::TEXT);
}

/// Shows descriptions: paragraphs, and blocks of code.
fn show_markdown(ui: &mut Ui, text: &str) {
    for (index, part) in text.split("```").enumerate() {
        let is_code = index % 2 == 1;
        let part = if is_code { part.strip_prefix("rtsl").unwrap_or(part) } else { part };
        let part = part.trim();
        if part.is_empty() {
            continue;
        }
        let shown = RichText::new(if is_code { part.to_owned() } else { part.replace('`', "") });
        ui.label(if is_code { shown.monospace() } else { shown });
    }
}
