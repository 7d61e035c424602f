//! The lines of the result: their indentation, and the comments at their ends, which are aligned.

use crate::MAX_WIDTH;
use crate::node::columns;

/// The lines so far. The last is being written.
#[derive(Default)]
pub(crate) struct Lines {
    lines: Vec<Line>,
    current: Line,
    /// True if the current line cannot be continued, because a comment ends it.
    is_ended: bool,
}

/// A line.
#[derive(Default)]
struct Line {
    /// The columns of its indentation.
    indent: usize,
    text: String,
    /// The number of columns of indentation and text.
    width: usize,
    /// The number of bytes of the text before a column that is aligned with that of other lines.
    column: Option<usize>,
    /// The comment at its end.
    comment: Option<String>,
}

impl Lines {
    /// Ends the current line, if anything is on it, and indents the next by so many columns.
    pub fn begin(&mut self, indent: usize) {
        if self.has_text() || self.current.comment.is_some() {
            let mut line = std::mem::take(&mut self.current);
            if line.comment.is_none() {
                line.text.truncate(line.text.trim_end_matches(' ').len());
            }
            self.lines.push(line);
        }
        self.is_ended = false;
        self.current.indent = indent;
        self.current.width = indent;
    }

    /// Adds an empty line before the next.
    pub fn blank(&mut self) {
        self.begin(0);
        if self.lines.last().is_some_and(|line| !line.text.is_empty()) {
            self.lines.push(Line::default());
        }
    }

    /// Appends a text to the current line.
    pub fn push(&mut self, text: &str) {
        self.current.text.push_str(text);
        // A comment or a token with a line continuation may have lines of its own.
        self.current.width = match text.rsplit_once('\n') {
            Some((_, last)) => columns(last),
            None => self.current.width + columns(text),
        };
    }

    /// Sets the comment at the end of the current line.
    pub fn end_with(&mut self, comment: &str) {
        self.current.comment = Some(comment.to_owned());
        self.is_ended = true;
    }

    /// Notes that what follows on the current line, after a blank, is aligned with what follows on lines beside it.
    pub fn mark_column(&mut self) {
        self.current.column = Some(self.current.text.len());
    }

    /// True if something is on the current line.
    pub fn has_text(&self) -> bool {
        !self.current.text.is_empty()
    }

    /// True if a comment ends the current line.
    pub fn is_ended(&self) -> bool {
        self.is_ended
    }

    /// The number of columns of the current line.
    pub fn width(&self) -> usize {
        self.current.width
    }

    /// The indentation of the current line.
    pub fn indent(&self) -> usize {
        self.current.indent
    }

    /// Returns the text of all lines.
    pub fn finish(mut self) -> String {
        self.begin(0);
        align_columns(&mut self.lines);
        let mut text = String::new();
        let mut rest = self.lines.as_slice();
        while !rest.is_empty() {
            let aligned = rest.iter().take_while(|line| line.comment.is_some()).count();
            let group = &rest[..aligned.max(1)];
            let column = comment_column(group);
            for line in group {
                line.write(column, &mut text);
            }
            rest = &rest[group.len()..];
        }
        text
    }
}

impl Line {
    /// The number of columns before the aligned column.
    fn columns_before(&self) -> Option<usize> {
        self.column.map(|column| columns(&self.text[..column]))
    }

    fn write(&self, comment_column: Option<usize>, out: &mut String) {
        if !self.text.is_empty() {
            out.extend(std::iter::repeat_n(' ', self.indent));
        }
        out.push_str(&self.text);
        if let Some(comment) = &self.comment {
            let column = comment_column.unwrap_or(0).max(self.width + 1);
            out.extend(std::iter::repeat_n(' ', column - self.width));
            out.push_str(comment);
        }
        out.push('\n');
    }
}

/// The column at which the comments of these lines begin; `None` if one of them would be too long there.
fn comment_column(lines: &[Line]) -> Option<usize> {
    let column = lines.iter().map(|line| line.width + 1).max()?;
    let widths = lines.iter().filter_map(|line| line.comment.as_deref()).map(columns);
    let fits = lines.iter().all(|line| line.indent == lines[0].indent)
        && widths.max().unwrap_or(0) + column <= MAX_WIDTH;
    fits.then_some(column)
}

/// Aligns the columns of lines beside each other, except those beyond which others would be too long.
fn align_columns(lines: &mut [Line]) {
    for group in lines.chunk_by_mut(|left, right| left.column.is_some() && right.column.is_some()) {
        let Some(column) = aligned_column(group) else { continue };
        for line in group {
            let missing = line.columns_before().map_or(0, |place| column.saturating_sub(place));
            line.width += missing;
            line.text.insert_str(line.column.unwrap_or(0), &" ".repeat(missing));
        }
    }
}

/// The greatest column to which all lines with smaller ones can move.
fn aligned_column(lines: &[Line]) -> Option<usize> {
    let mut places: Vec<(usize, usize)> =
        lines.iter().filter_map(|line| Some((line.columns_before()?, line.width))).collect();
    places.sort_unstable();
    // The number of columns after the aligned one, of the longest line so far.
    let mut rest = 0;
    let mut column = None;
    for (place, width) in places {
        rest = rest.max(width - place);
        if place + rest <= MAX_WIDTH {
            column = Some(place);
        }
    }
    column
}
