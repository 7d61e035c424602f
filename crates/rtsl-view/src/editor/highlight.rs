//! The colours of a text: those of its words, and lines under errors.

use std::ops::Range;
use std::sync::Arc;

use egui::text::{LayoutJob, TextFormat, TextWrapping};
use egui::{Color32, FontId, Stroke};
use rtsl_ide::{SemanticKind, SemanticToken};

use super::analyst::{Findings, Problem};
use crate::theme;

/// The colours of a text, which are found once for each change.
#[derive(Debug, Default)]
pub struct Highlighter(Option<(Arc<Findings>, Arc<LayoutJob>)>);

impl Highlighter {
    /// Returns a text with its colours.
    pub fn job(&mut self, text: &str, findings: &Arc<Findings>, font: &FontId) -> Arc<LayoutJob> {
        match &self.0 {
            Some((of, job)) if Arc::ptr_eq(of, findings) && job.text == text => job.clone(),
            _ => {
                let job = Arc::new(highlighted(text, findings, font));
                self.0 = Some((findings.clone(), job.clone()));
                job
            }
        }
    }
}

/// Returns a text with its colours. What was found about an earlier version of it is used where the text is the same.
fn highlighted(text: &str, findings: &Findings, font: &FontId) -> LayoutJob {
    let moved = Moved::new(&findings.text, text);
    let mut marks: Vec<(Range<usize>, Mark)> = Vec::new();
    for token in &findings.tokens {
        if let Some(range) = moved.range(token.start as usize..token.end as usize) {
            marks.push((range, Mark::Color(color_of(token))));
        }
    }
    for problem in &findings.problems {
        if let Some(range) = problem_range(problem, &moved, text) {
            let color = if problem.is_error { theme::ERROR } else { theme::WARNING };
            marks.push((range, Mark::Line(color)));
        }
    }
    job(text, marks, font)
}

/// Returns the place of a problem in a text that has changed since: at least a letter, of which a line can be seen.
pub fn problem_range(problem: &Problem, moved: &Moved, text: &str) -> Option<Range<usize>> {
    if problem.start == problem.end && problem.start == 0 {
        return None;
    }
    let Range { start, end } = moved.range(problem.start..problem.end)?;
    let is_empty = text.get(start..end).is_none_or(|text| text.trim().is_empty());
    let next = text.get(start..)?.chars().next().map_or(0, char::len_utf8);
    Some(start..if is_empty { start + next } else { end })
}

/// The places of an earlier text in a later one: what is before and after the change is the same.
pub struct Moved {
    same_start: usize,
    same_end: usize,
    earlier: usize,
    later: usize,
}

impl Moved {
    /// Compares two versions of a text.
    pub fn new(earlier: &str, later: &str) -> Moved {
        let count = |pairs: &mut dyn Iterator<Item = (u8, u8)>| {
            pairs.take_while(|(one, other)| one == other).count()
        };
        let same_start = count(&mut earlier.bytes().zip(later.bytes()));
        let rest = earlier.len().min(later.len()) - same_start;
        let mut ends = earlier.bytes().rev().zip(later.bytes().rev()).take(rest);
        let same_end = count(&mut ends);
        Moved { same_start, same_end, earlier: earlier.len(), later: later.len() }
    }

    /// Returns the place of a part of the earlier text, unless it has changed.
    pub fn range(&self, part: Range<usize>) -> Option<Range<usize>> {
        if self.earlier == self.later && self.same_start == self.earlier {
            return Some(part);
        }
        // A word that touches the change may be another by now.
        if part.end < self.same_start {
            return Some(part);
        }
        let start = self.earlier - self.same_end;
        if part.start > start {
            let moved = |position: usize| position + self.later - self.earlier;
            return Some(moved(part.start)..moved(part.end));
        }
        None
    }
}

/// A property of a part of a text.
#[derive(Clone, Copy)]
enum Mark {
    Color(Color32),
    Line(Color32),
}

fn job(text: &str, marks: Vec<(Range<usize>, Mark)>, font: &FontId) -> LayoutJob {
    let is_place = |place: &usize| text.is_char_boundary(*place);
    let ends = marks.iter().flat_map(|(range, _)| [range.start, range.end]);
    let mut ends: Vec<usize> = ends.chain([0, text.len()]).filter(is_place).collect();
    ends.sort_unstable();
    ends.dedup();
    let mut job = LayoutJob {
        wrap: TextWrapping::no_max_width(),
        keep_trailing_whitespace: true,
        ..LayoutJob::default()
    };
    // Marks of words do not overlap, and there are few others.
    let (mut words, mut lines) = (Vec::new(), Vec::new());
    for (range, mark) in marks {
        match mark {
            Mark::Color(color) => words.push((range, color)),
            Mark::Line(color) => lines.push((range, color)),
        }
    }
    words.sort_by_key(|(range, _)| range.start);
    let mut words = words.into_iter().peekable();
    for pair in ends.windows(2) {
        let part = pair[0]..pair[1];
        while words.next_if(|(range, _)| range.end <= part.start).is_some() {}
        let holds = |range: &Range<usize>| range.start <= part.start && part.end <= range.end;
        let color = words.peek().filter(|(range, _)| holds(range)).map(|(_, color)| *color);
        let line = lines.iter().find(|(range, _)| holds(range)).map(|(_, color)| *color);
        let format = TextFormat {
            font_id: font.clone(),
            color: color.unwrap_or(theme::TEXT),
            underline: line.map_or(Stroke::NONE, |color| Stroke::new(1.5, color)),
            ..TextFormat::default()
        };
        job.append(&text[part], 0.0, format);
    }
    if job.sections.is_empty() {
        job.append("", 0.0, TextFormat::simple(font.clone(), theme::TEXT));
    }
    job
}

fn color_of(token: &SemanticToken) -> Color32 {
    match token.kind {
        SemanticKind::Keyword => Color32::from_rgb(0xC0, 0x90, 0xE0),
        SemanticKind::Type | SemanticKind::Struct | SemanticKind::Enumeration => {
            Color32::from_rgb(0x60, 0xC0, 0xB0)
        }
        SemanticKind::Class | SemanticKind::Module => Color32::from_rgb(0x80, 0xD0, 0x90),
        SemanticKind::Function | SemanticKind::Method => Color32::from_rgb(0xE0, 0xD0, 0x90),
        SemanticKind::Variable if token.is_of_language => Color32::from_rgb(0x70, 0xB8, 0xF0),
        SemanticKind::Variable | SemanticKind::Parameter => Color32::from_rgb(0xC8, 0xD8, 0xE8),
        SemanticKind::Property => Color32::from_rgb(0xA8, 0xC8, 0xF0),
        SemanticKind::Number | SemanticKind::Choice => Color32::from_rgb(0xD0, 0xB0, 0x80),
        SemanticKind::Text => Color32::from_rgb(0xD0, 0x98, 0x78),
        SemanticKind::Comment => Color32::from_rgb(0x80, 0x90, 0x80),
        SemanticKind::Macro => Color32::from_rgb(0xD8, 0x90, 0xB0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_move_with_their_text() {
        let moved = Moved::new("one two three", "one twenty three");
        assert_eq!(moved.range(0..3), Some(0..3));
        assert_eq!(moved.range(4..7), None, "it is another word");
        assert_eq!(moved.range(8..13), Some(11..16));
        let same = Moved::new("same", "same");
        assert_eq!(same.range(0..4), Some(0..4));
    }

    #[test]
    fn parts_cover_the_whole_text() {
        let text = "float größe = 1;\n";
        let word = SemanticToken {
            start: 0,
            end: 5,
            kind: SemanticKind::Type,
            is_declaration: false,
            is_readonly: false,
            is_of_language: true,
        };
        let problem = Problem {
            start: 6,
            end: 13,
            line: 1,
            is_error: true,
            code: "E0201",
            message: String::new(),
            details: Vec::new(),
        };
        let findings =
            Findings { text: text.to_owned(), tokens: vec![word], problems: vec![problem] };
        let job = highlighted(text, &findings, &FontId::monospace(12.0));
        job.debug_sanity_check();
        assert_eq!(job.text, text);
        let lines: Vec<bool> =
            job.sections.iter().map(|it| it.format.underline.width > 0.0).collect();
        assert_eq!(lines, [false, false, true, false]);
        let empty = highlighted("", &Findings::default(), &FontId::monospace(12.0));
        assert_eq!(empty.text, "");
    }
}
