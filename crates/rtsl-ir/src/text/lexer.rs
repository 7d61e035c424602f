//! Splits the text form into words and punctuation.

/// A token of the text form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Token<'a> {
    /// A name, keyword, number or value: letters, digits and `_.[]%+-#`.
    Word(&'a str),
    /// One of `{}(),=:@`, or a character that the text form does not use.
    Punctuation(char),
    /// The end of the text.
    End,
}

/// An iterator-like reader of the tokens of a text.
#[derive(Clone, Debug)]
pub(super) struct Lexer<'a> {
    text: &'a str,
    offset: usize,
}

impl<'a> Lexer<'a> {
    pub fn new(text: &'a str) -> Self {
        Lexer { text, offset: 0 }
    }

    /// Returns the next token and the offset of its first byte.
    pub fn next(&mut self) -> (Token<'a>, usize) {
        self.skip_blanks();
        let start = self.offset;
        let rest = &self.text[start..];
        let Some(first) = rest.chars().next() else { return (Token::End, start) };
        if !is_word_character(first) {
            self.offset += first.len_utf8();
            return (Token::Punctuation(first), start);
        }
        let end = rest.find(|character| !is_word_character(character)).unwrap_or(rest.len());
        self.offset += end;
        (Token::Word(&rest[..end]), start)
    }

    fn skip_blanks(&mut self) {
        loop {
            let rest = &self.text[self.offset..];
            let trimmed = rest.trim_start();
            self.offset += rest.len() - trimmed.len();
            if !trimmed.starts_with("//") {
                return;
            }
            self.offset += trimmed.find('\n').unwrap_or(trimmed.len());
        }
    }
}

/// True if names of variables and functions may contain `character`.
pub(crate) fn is_word_character(character: char) -> bool {
    character.is_ascii_alphanumeric() || "_.[]%+-#".contains(character)
}
