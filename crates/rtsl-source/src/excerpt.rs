//! Excerpts of source files for diagnostics, with long lines shortened.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::{FileId, Label, SourceMap, Span};

/// The maximum number of lines shown for a label; further ones are cut off.
const MAX_LINES: usize = 10;
/// The number of lines before and after a label that the renderer may ask for.
const CONTEXT: usize = 4;
/// The length of the longest line shown whole, in bytes.
const MAX_WIDTH: usize = 240;
/// The number of bytes shown before the label in a line that is shortened.
const MARGIN: usize = 60;
/// The text that replaces the parts cut off.
const ELLIPSIS: &str = "...";

/// The lines of one file around the labels of one diagnostic.
#[derive(Debug)]
pub(crate) struct Excerpt {
    pub text: String,
    /// The lines shown, by line index from 0.
    lines: BTreeMap<usize, Line>,
}

#[derive(Debug)]
struct Line {
    /// The line's byte range in the excerpt.
    shown: Range<usize>,
    /// The byte range of the file that is shown.
    window: Range<usize>,
    /// The number of bytes in the excerpt before the window's: those of a leading ellipsis.
    ellipsis: usize,
}

impl Excerpt {
    /// Builds the excerpt of `file` for the `labels` that lie in it.
    pub fn new<'a>(
        map: &SourceMap,
        file: FileId,
        labels: impl Iterator<Item = &'a Label> + Clone,
    ) -> Self {
        let mut starts: BTreeMap<usize, Option<usize>> = BTreeMap::new();
        let spans = labels.filter(|label| label.span.file == file).map(|label| label.span);
        for span in spans {
            let span = clip(map, span);
            let (first, last) = lines_of(map, span);
            for line in first.saturating_sub(CONTEXT)..=last + CONTEXT {
                if line < map.line_count(file) {
                    starts.entry(line).or_default();
                }
            }
            // The first label of a line determines the part of it that is shown. The primary label
            // comes first.
            starts.entry(first).or_default().get_or_insert(span.start as usize);
        }
        let mut excerpt = Excerpt { text: String::new(), lines: BTreeMap::new() };
        for (line, start) in starts {
            excerpt.add_line(map, file, line, start);
        }
        excerpt
    }

    fn add_line(&mut self, map: &SourceMap, file: FileId, line: usize, label: Option<usize>) {
        let Some(range) = map.line_range(file, line) else { return };
        let text = &map.file(file).text;
        let content = text[range.clone()].trim_end_matches(['\n', '\r']).len();
        let mut window = range.start..range.start + content;
        if content > MAX_WIDTH {
            let from = label.unwrap_or(range.start).saturating_sub(MARGIN).max(range.start);
            window.start = text.floor_char_boundary(from);
            window.end = text.floor_char_boundary((from + MAX_WIDTH).min(window.end));
        }
        let begin = self.text.len();
        let ellipsis = if window.start > range.start { ELLIPSIS } else { "" };
        self.text.push_str(ellipsis);
        self.text.push_str(&text[window.clone()]);
        if window.end < range.start + content {
            self.text.push_str(ELLIPSIS);
        }
        self.text.push('\n');
        let shown = begin..self.text.len();
        self.lines.insert(line, Line { shown, window, ellipsis: ellipsis.len() });
    }

    /// Maps a span of the file to its byte range in the excerpt.
    pub fn place(&self, map: &SourceMap, span: Span) -> Range<usize> {
        let span = clip(map, span);
        let (first, last) = lines_of(map, span);
        let start = self.offset(first, span.start as usize);
        start..self.offset(last, span.end as usize).max(start)
    }

    fn offset(&self, line: usize, offset: usize) -> usize {
        let Some(line) = self.lines.get(&line) else { return 0 };
        let inside = offset.clamp(line.window.start, line.window.end) - line.window.start;
        (line.shown.start + line.ellipsis + inside).min(line.shown.end - 1)
    }

    /// Returns the line, counted from 0, of an offset in the excerpt.
    pub fn line_of(&self, offset: usize) -> usize {
        let after = self.lines.iter().rev().find(|(_, line)| line.shown.start <= offset);
        after.map_or(0, |(number, _)| *number)
    }

    /// Returns the byte range of a line in the excerpt.
    pub fn line_range(&self, line: usize) -> Option<Range<usize>> {
        self.lines.get(&line).map(|line| line.shown.clone())
    }

    /// Maps an offset in the excerpt to the offset in the file.
    pub fn original(&self, line: usize, offset: usize) -> Option<usize> {
        let line = self.lines.get(&line)?;
        let inside = offset.saturating_sub(line.shown.start + line.ellipsis);
        Some((line.window.start + inside).min(line.window.end))
    }
}

/// Clips `span` to its file and to at most [`MAX_LINES`] lines.
fn clip(map: &SourceMap, span: Span) -> Span {
    let length = map.file(span.file).text.len() as u32;
    let start = span.start.min(length);
    let span = Span { start, end: span.end.clamp(start, length), ..span };
    let (first, last) = lines_of(map, span);
    if last - first < MAX_LINES {
        return span;
    }
    let end = map.line_range(span.file, first).map_or(span.end, |range| range.end as u32 - 1);
    Span { end: end.max(span.start), ..span }
}

/// The first and last line of `span`, counted from 0.
fn lines_of(map: &SourceMap, span: Span) -> (usize, usize) {
    let line = |offset| map.line(span.file, offset) as usize - 1;
    (line(span.start), line(span.end))
}
