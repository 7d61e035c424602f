//! Offsets of bytes as positions of the protocol, and paths as URIs.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use lsp_types::{Position, PositionEncodingKind, Range, Uri};
use percent_encoding::{AsciiSet, CONTROLS, percent_decode_str, utf8_percent_encode};
use rtsl::{FileId, SourceMap};

/// The unit in which an editor counts columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Bytes.
    Utf8,
    /// Units of UTF-16, which every editor knows.
    Utf16,
}

impl Encoding {
    /// The better of the encodings that an editor offers.
    pub fn chosen(offered: Option<&[PositionEncodingKind]>) -> Encoding {
        let has_bytes = offered.is_some_and(|it| it.contains(&PositionEncodingKind::UTF8));
        if has_bytes { Encoding::Utf8 } else { Encoding::Utf16 }
    }

    /// The encoding's name in the protocol.
    pub fn kind(self) -> PositionEncodingKind {
        match self {
            Encoding::Utf8 => PositionEncodingKind::UTF8,
            Encoding::Utf16 => PositionEncodingKind::UTF16,
        }
    }

    fn length(self, letter: char) -> u32 {
        match self {
            Encoding::Utf8 => letter.len_utf8() as u32,
            Encoding::Utf16 => letter.len_utf16() as u32,
        }
    }
}

/// The lines of a text, for many conversions.
#[derive(Clone, Debug)]
pub struct Lines<'t> {
    sources: Cow<'t, SourceMap>,
    file: FileId,
    encoding: Encoding,
}

impl<'t> Lines<'t> {
    /// The lines of a text.
    pub fn new(text: &str, encoding: Encoding) -> Lines<'t> {
        let mut sources = SourceMap::new();
        let file = sources.add("", text);
        Lines { sources: Cow::Owned(sources), file, encoding }
    }

    /// The lines of a file of an analysis.
    pub fn of(sources: &'t SourceMap, file: FileId, encoding: Encoding) -> Lines<'t> {
        Lines { sources: Cow::Borrowed(sources), file, encoding }
    }

    fn text(&self) -> &str {
        &self.sources.file(self.file).text
    }

    /// The range of a line from 0, with its break; empty at the end of the text if there is no such line.
    fn line(&self, line: u32) -> std::ops::Range<usize> {
        let end = self.text().len();
        self.sources.line_range(self.file, line as usize).unwrap_or(end..end)
    }

    /// The position of an offset; the end of the text if it lies beyond.
    pub fn position(&self, offset: usize) -> Position {
        let offset = self.text().floor_char_boundary(offset.min(self.text().len()));
        let line = self.sources.line(self.file, offset as u32) - 1;
        let character = match self.encoding {
            Encoding::Utf8 => (offset - self.line(line).start) as u32,
            Encoding::Utf16 => self.sources.utf16_column(self.file, offset as u32),
        };
        Position { line, character }
    }

    /// The range of two offsets.
    pub fn range(&self, start: usize, end: usize) -> Range {
        Range { start: self.position(start), end: self.position(end) }
    }

    /// The offset of a position; the end of its line or of the text if it lies beyond.
    pub fn offset(&self, position: Position) -> usize {
        let start = self.line(position.line).start;
        let line = self.text()[self.line(position.line)].trim_end_matches('\n');
        let mut left = position.character;
        for (at, letter) in line.char_indices() {
            let length = self.encoding.length(letter);
            if left < length {
                return start + at;
            }
            left -= length;
        }
        start + line.len()
    }
}

/// The characters that are encoded in the path of a URI.
const ENCODED: &AsciiSet = &CONTROLS
    .add(b' ')
    .add(b'"')
    .add(b'#')
    .add(b'%')
    .add(b'<')
    .add(b'>')
    .add(b'?')
    .add(b'[')
    .add(b'\\')
    .add(b']')
    .add(b'^')
    .add(b'`')
    .add(b'{')
    .add(b'|')
    .add(b'}');

/// The path of a `file:` URI.
pub fn path_of(uri: &Uri) -> Option<PathBuf> {
    let rest = uri.as_str().strip_prefix("file://")?;
    // The name of a machine before the path is only used by systems of Microsoft.
    let path = &rest[rest.find('/')?..];
    let decoded = percent_decode_str(path).decode_utf8().ok()?;
    let has_drive = decoded.as_bytes().get(2) == Some(&b':');
    Some(PathBuf::from(if has_drive { &decoded[1..] } else { &decoded }))
}

/// The `file:` URI of an absolute path.
pub fn uri_of(path: &Path) -> Option<Uri> {
    let path = path.display().to_string().replace('\\', "/");
    let encoded = utf8_percent_encode(&path, ENCODED).to_string();
    let slash = if encoded.starts_with('/') { "" } else { "/" };
    Uri::from_str(&format!("file://{slash}{encoded}")).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_units_of_the_encoding() {
        let text = "a\nä😀b\r\nc";
        let b = text.find('b').expect("it is there");
        for (encoding, column) in [(Encoding::Utf8, 6), (Encoding::Utf16, 3)] {
            let lines = Lines::new(text, encoding);
            assert_eq!(lines.position(b), Position { line: 1, character: column });
            for (offset, _) in text.char_indices() {
                assert_eq!(lines.offset(lines.position(offset)), offset);
            }
        }
        let lines = Lines::new(text, Encoding::Utf16);
        assert_eq!(lines.offset(Position { line: 9, character: 0 }), text.len());
        assert_eq!(lines.offset(Position { line: 0, character: 9 }), 1);
        // Inside of a pair of units.
        assert_eq!(lines.offset(Position { line: 1, character: 2 }), 4);
    }

    #[test]
    fn paths_and_uris_are_converted_into_each_other() {
        for path in ["/a/b c.rtsl", "/ä/#1%.rtsl", "/a[0]/x?.rtsl"] {
            let uri = uri_of(Path::new(path)).expect("a URI");
            assert_eq!(path_of(&uri).as_deref(), Some(Path::new(path)), "{}", uri.as_str());
        }
        let encoded = Uri::from_str("file:///c%3A/x.rtsl").expect("a URI");
        assert_eq!(path_of(&encoded).as_deref(), Some(Path::new("c:/x.rtsl")));
        let untitled = Uri::from_str("untitled:Untitled-1").expect("a URI");
        assert_eq!(path_of(&untitled), None);
    }
}
