//! Lines and columns of a text, found in time that depends on neither the length of the text nor that of the line.

/// The lines of a text, and its characters outside ASCII.
#[derive(Clone, Debug)]
pub(crate) struct Lines {
    /// The offset of each line's first byte.
    starts: Vec<u32>,
    wide: Vec<Wide>,
}

/// A character outside ASCII.
#[derive(Clone, Copy, Debug, Default)]
struct Wide {
    /// The offset just past it.
    end: u32,
    /// The bytes of this and of all wide characters before it, less one for each character.
    beyond_characters: u32,
    /// Those bytes, less one for each unit of UTF-16.
    beyond_units: u32,
}

impl Lines {
    pub fn new(text: &str) -> Lines {
        let newlines = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let starts = std::iter::once(0).chain(newlines.map(|(offset, _)| offset as u32 + 1));
        let mut sum = Wide::default();
        let wide = text.char_indices().filter(|(_, letter)| !letter.is_ascii());
        let wide = wide.map(|(offset, letter)| {
            let bytes = letter.len_utf8();
            sum.end = (offset + bytes) as u32;
            sum.beyond_characters += bytes as u32 - 1;
            sum.beyond_units += (bytes - letter.len_utf16()) as u32;
            sum
        });
        Lines { starts: starts.collect(), wide: wide.collect() }
    }

    pub fn count(&self) -> usize {
        self.starts.len()
    }

    /// The offset of the first byte of a line, which is counted from 0.
    pub fn start(&self, line: usize) -> Option<u32> {
        self.starts.get(line).copied()
    }

    /// The line of an offset, from 0.
    pub fn line(&self, offset: u32) -> usize {
        self.starts.partition_point(|start| *start <= offset) - 1
    }

    /// The number of characters before an offset in its line.
    pub fn characters_before(&self, offset: u32) -> u32 {
        self.before(offset, |sum| sum.beyond_characters)
    }

    /// The number of units of UTF-16 before an offset in its line.
    pub fn units_before(&self, offset: u32) -> u32 {
        self.before(offset, |sum| sum.beyond_units)
    }

    fn before(&self, offset: u32, beyond: impl Fn(Wide) -> u32) -> u32 {
        let start = self.starts[self.line(offset)];
        let beyond_at = |offset: u32| {
            let count = self.wide.partition_point(|wide| wide.end <= offset);
            count.checked_sub(1).map_or(0, |last| beyond(self.wide[last]))
        };
        offset - start - (beyond_at(offset) - beyond_at(start))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_counts_of_what_is_before() {
        for text in ["", "a", "ä", "a\nä😀b\r\nc\n", "\n\n", "ääää\nß", "😀\u{feff}x"] {
            let lines = Lines::new(text);
            assert_eq!(lines.count(), text.split('\n').count());
            let ends = text.char_indices().map(|(offset, _)| offset).chain([text.len()]);
            for offset in ends {
                let start = text[..offset].rfind('\n').map_or(0, |at| at + 1);
                let before = &text[start..offset];
                let at = offset as u32;
                assert_eq!(lines.start(lines.line(at)), Some(start as u32), "{text:?} {offset}");
                assert_eq!(lines.characters_before(at), before.chars().count() as u32);
                assert_eq!(lines.units_before(at), before.encode_utf16().count() as u32);
            }
        }
    }
}
