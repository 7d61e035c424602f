//! Source files, spans and positions.

use std::fmt;

use crate::lines::Lines;

/// The index of a file in a [`SourceMap`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FileId(pub u32);

/// A range of bytes in one file, `start..end`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Span {
    /// The file.
    pub file: FileId,
    /// Offset of the first byte.
    pub start: u32,
    /// Offset just past the last byte.
    pub end: u32,
}

impl Span {
    /// The range `start..end` of `file`.
    pub fn new(file: FileId, start: u32, end: u32) -> Self {
        Span { file, start, end }
    }

    /// The smallest span that contains both if they lie in one file; else `self`.
    pub fn to(self, other: Span) -> Span {
        if self.file != other.file {
            return self;
        }
        Span { file: self.file, start: self.start.min(other.start), end: self.end.max(other.end) }
    }

    /// The empty span at the start of this one.
    pub fn before(self) -> Span {
        Span { end: self.start, ..self }
    }

    /// The empty span at the end of this one, for diagnostics about missing text.
    pub fn after(self) -> Span {
        Span { start: self.end, ..self }
    }
}

impl fmt::Debug for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}..{}", self.file.0, self.start, self.end)
    }
}

/// A file's name, as diagnostics show it, and its text.
#[derive(Clone, Debug)]
pub struct SourceFile {
    /// The name that diagnostics show.
    pub name: String,
    /// The text, UTF-8.
    pub text: String,
    lines: Lines,
}

/// A line and a column, both counted from 1; the column counts characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// Line, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
}

/// All files of a compilation. Spans refer to it.
#[derive(Clone, Debug, Default)]
pub struct SourceMap {
    files: Vec<SourceFile>,
}

impl SourceMap {
    /// A map without files.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file. Texts of 4 GiB or more are truncated to that length.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> FileId {
        let mut text = text.into();
        if text.len() >= u32::MAX as usize {
            text.truncate(text.floor_char_boundary(u32::MAX as usize - 1));
        }
        let lines = Lines::new(&text);
        self.files.push(SourceFile { name: name.into(), text, lines });
        FileId(self.files.len() as u32 - 1)
    }

    /// The file `id`.
    ///
    /// # Panics
    /// If `id` comes from another map.
    pub fn file(&self, id: FileId) -> &SourceFile {
        &self.files[id.0 as usize]
    }

    /// All files, in the order they were added.
    pub fn files(&self) -> impl Iterator<Item = (FileId, &SourceFile)> {
        self.files.iter().enumerate().map(|(index, file)| (FileId(index as u32), file))
    }

    /// The text that `span` covers.
    pub fn text(&self, span: Span) -> &str {
        self.file(span.file).text.get(span.start as usize..span.end as usize).unwrap_or("")
    }

    /// The line of `offset` in `file`, from 1; an offset past the end has the last line.
    pub fn line(&self, file: FileId, offset: u32) -> u32 {
        self.file(file).lines.line(offset) as u32 + 1
    }

    /// The position of `offset` in `file`; an offset past the end has the position of the end.
    pub fn position(&self, file: FileId, offset: u32) -> Position {
        let file = self.file(file);
        let offset = file.text.floor_char_boundary(offset as usize) as u32;
        Position {
            line: file.lines.line(offset) as u32 + 1,
            column: file.lines.characters_before(offset) + 1,
        }
    }

    /// The number of units of UTF-16 in `file` between the beginning of the line of `offset` and `offset`.
    pub fn utf16_column(&self, file: FileId, offset: u32) -> u32 {
        let file = self.file(file);
        file.lines.units_before(file.text.floor_char_boundary(offset as usize) as u32)
    }

    /// The number of lines in `file`.
    pub fn line_count(&self, file: FileId) -> usize {
        self.file(file).lines.count()
    }

    /// The byte range of a line, line break included. `line` counts from 0.
    pub fn line_range(&self, file: FileId, line: usize) -> Option<std::ops::Range<usize>> {
        let file = self.file(file);
        let start = file.lines.start(line)? as usize;
        let end = file.lines.start(line + 1).map_or(file.text.len(), |next| next as usize);
        Some(start..end)
    }
}
