//! The lexer: splits text into tokens. It reports nothing, since the text may turn out to be
//! skipped by `#if`; invalid text becomes [`TokenKind::Invalid`].

use std::ops::Range;

use rtsl_source::{FileId, Span};

use crate::symbol::Interner;
use crate::token::{LexicalError, Punctuator, Token, TokenKind};

/// Splits `text`, the text of `file`, into tokens.
pub(crate) fn lex(file: FileId, text: &str, symbols: &mut Interner) -> Vec<Token> {
    lex_with_comments(file, text, symbols).0
}

/// Splits `text` into tokens and comments.
pub(crate) fn lex_with_comments(
    file: FileId,
    text: &str,
    symbols: &mut Interner,
) -> (Vec<Token>, Vec<Range<usize>>) {
    let comments = Vec::new();
    let mut lexer = Lexer { text, file, position: 0, starts_line: true, spaced: false, comments };
    if text.starts_with('\u{feff}') {
        lexer.position = '\u{feff}'.len_utf8();
    }
    lexer.skip_continuations();
    let mut tokens = Vec::new();
    while let Some(token) = lexer.next(symbols) {
        tokens.push(token);
    }
    (tokens, lexer.comments)
}

/// The lexer's position in `text`. Between calls, `position` is never at a line continuation.
struct Lexer<'a> {
    text: &'a str,
    file: FileId,
    position: usize,
    starts_line: bool,
    spaced: bool,
    /// The comments so far.
    comments: Vec<Range<usize>>,
}

impl Lexer<'_> {
    fn next(&mut self, symbols: &mut Interner) -> Option<Token> {
        let blank_error = self.skip_blanks();
        let start = blank_error.unwrap_or(self.position);
        let kind = match blank_error {
            Some(_) => TokenKind::Invalid(LexicalError::UnterminatedComment),
            None => self.read_kind()?,
        };
        let span = Span::new(self.file, start as u32, self.position as u32);
        let written = &self.text[start..self.position];
        let spelling = match kind {
            _ if keeps_spelling(kind) && written.contains('\\') => {
                symbols.intern(&without_continuations(written))
            }
            _ if keeps_spelling(kind) => symbols.intern(written),
            TokenKind::Punctuator(punctuator) => symbols.intern(punctuator.text()),
            _ => symbols.intern(""),
        };
        let token = Token {
            kind,
            spelling,
            span,
            starts_line: self.starts_line,
            spaced: self.spaced,
            after_invalid: false,
            painted: false,
        };
        self.starts_line = false;
        self.spaced = false;
        Some(token)
    }

    /// Skips white space and comments. Returns the start of an unterminated comment.
    fn skip_blanks(&mut self) -> Option<usize> {
        loop {
            match self.peek() {
                Some(b'\n' | b'\r') => {
                    self.starts_line = true;
                    self.bump();
                }
                Some(b' ' | b'\t' | 0x0b | 0x0c) => self.bump(),
                Some(b'/') => {
                    let start = self.position;
                    match self.peek_after() {
                        Some(b'/') => self.skip_line_comment(),
                        Some(b'*') if self.skip_block_comment() => {}
                        Some(b'*') => return Some(start),
                        _ => return None,
                    }
                    self.comments.push(start..self.position);
                }
                _ => return None,
            }
            self.spaced = true;
        }
    }

    fn skip_line_comment(&mut self) {
        while !matches!(self.peek(), None | Some(b'\n' | b'\r')) {
            self.bump();
        }
    }

    fn skip_block_comment(&mut self) -> bool {
        self.bump();
        self.bump();
        loop {
            match self.peek() {
                None => return false,
                Some(b'*') if self.peek_after() == Some(b'/') => {
                    self.bump();
                    self.bump();
                    return true;
                }
                Some(_) => self.bump(),
            }
        }
    }

    fn read_kind(&mut self) -> Option<TokenKind> {
        let first = self.peek()?;
        Some(match first {
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => self.read_word(),
            b'0'..=b'9' => self.read_number(),
            b'.' if self.peek_after().is_some_and(|byte| byte.is_ascii_digit()) => {
                self.read_number()
            }
            b'"' => self.read_text(),
            0x80.. if self.at_letter() => self.read_word(),
            0x80.. => {
                self.bump_character();
                TokenKind::Invalid(LexicalError::NonAsciiCharacter)
            }
            _ => match Punctuator::ALL
                .iter()
                .find(|each| each.text().as_bytes()[0] == first && self.at_punctuator(each.text()))
            {
                Some(punctuator) => {
                    for _ in punctuator.text().bytes() {
                        self.bump();
                    }
                    TokenKind::Punctuator(*punctuator)
                }
                None => {
                    self.bump();
                    TokenKind::Invalid(LexicalError::UnexpectedCharacter)
                }
            },
        })
    }

    fn read_word(&mut self) -> TokenKind {
        let mut kind = TokenKind::Name;
        while self.at_letter() {
            if !self.bump_character().is_ascii() {
                kind = TokenKind::Invalid(LexicalError::NonAsciiName);
            }
        }
        kind
    }

    fn at_letter(&self) -> bool {
        match self.peek() {
            Some(0x80..) => self.text[self.position..].starts_with(char::is_alphanumeric),
            Some(byte) => byte.is_ascii_alphanumeric() || byte == b'_',
            None => false,
        }
    }

    fn bump_character(&mut self) -> char {
        let character = self.text[self.position..].chars().next().unwrap_or_default();
        self.position += character.len_utf8() - 1;
        self.bump();
        character
    }

    /// Reads a preprocessing number, as C defines it; the parser checks its form.
    fn read_number(&mut self) -> TokenKind {
        let start = self.position;
        let hexadecimal = matches!(self.text.as_bytes()[start..], [b'0', b'x' | b'X', ..]);
        while let Some(byte) = self.peek() {
            if !(byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'.') {
                break;
            }
            self.bump();
            let exponent = !hexadecimal && matches!(byte, b'e' | b'E');
            if exponent && matches!(self.peek(), Some(b'+' | b'-')) {
                self.bump();
            }
        }
        TokenKind::Number
    }

    fn read_text(&mut self) -> TokenKind {
        self.bump();
        loop {
            match self.peek() {
                None | Some(b'\n' | b'\r') => {
                    return TokenKind::Invalid(LexicalError::UnterminatedText);
                }
                Some(b'"') => {
                    self.bump();
                    return TokenKind::Text;
                }
                Some(b'\\') => {
                    self.bump();
                    if !matches!(self.peek(), None | Some(b'\n' | b'\r')) {
                        self.bump();
                    }
                }
                Some(_) => self.bump(),
            }
        }
    }

    fn at_punctuator(&self, punctuator: &str) -> bool {
        let rest = &self.text.as_bytes()[self.position..];
        if rest.starts_with(punctuator.as_bytes()) {
            return true;
        }
        // A continuation may split an operator.
        let mut offset = self.position;
        punctuator.bytes().all(|byte| {
            if self.text.as_bytes().get(offset) != Some(&byte) {
                return false;
            }
            offset = self.after_continuations(offset + 1);
            true
        })
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.position).copied()
    }

    fn peek_after(&self) -> Option<u8> {
        self.text.as_bytes().get(self.after_continuations(self.position + 1)).copied()
    }

    fn bump(&mut self) {
        self.position += 1;
        self.skip_continuations();
    }

    fn skip_continuations(&mut self) {
        self.position = self.after_continuations(self.position);
    }

    fn after_continuations(&self, mut offset: usize) -> usize {
        let bytes = self.text.as_bytes();
        while bytes.get(offset) == Some(&b'\\') {
            offset += match bytes[offset + 1..] {
                [b'\n', ..] => 2,
                [b'\r', b'\n', ..] => 3,
                _ => break,
            };
        }
        offset
    }
}

fn keeps_spelling(kind: TokenKind) -> bool {
    match kind {
        TokenKind::Name | TokenKind::Number | TokenKind::Text => true,
        TokenKind::Invalid(error) => error != LexicalError::UnterminatedComment,
        TokenKind::Punctuator(_) | TokenKind::End => false,
    }
}

fn without_continuations(written: &str) -> String {
    written.replace("\\\r\n", "").replace("\\\n", "")
}

#[cfg(test)]
mod tests {
    use super::*;
    use rtsl_source::SourceMap;

    fn spellings(text: &str) -> Vec<String> {
        let mut symbols = Interner::default();
        let file = SourceMap::new().add("test", text);
        let tokens = lex(file, text, &mut symbols);
        tokens
            .iter()
            .map(|token| match token.kind {
                TokenKind::Invalid(error) => format!("{error:?}"),
                _ => symbols.text(token.spelling).to_string(),
            })
            .collect()
    }

    #[test]
    fn longest_punctuator_wins() {
        assert_eq!(spellings("a<<=b ^^c++ +d"), ["a", "<<=", "b", "^^", "c", "++", "+", "d"]);
    }

    #[test]
    fn continuations_join_anything() {
        assert_eq!(spellings("ab\\\ncd +\\\r\n= 1\\\n2"), ["abcd", "+=", "12"]);
    }

    #[test]
    fn numbers_include_their_suffix() {
        assert_eq!(
            spellings("12abc 1e+3 0xE+1 .5f 1..2"),
            ["12abc", "1e+3", "0xE", "+", "1", ".5f", "1..2"]
        );
    }

    #[test]
    fn invalid_tokens_are_kept_for_later() {
        assert_eq!(
            spellings("a @ b“ gré \"x"),
            [
                "a",
                "UnexpectedCharacter",
                "b",
                "NonAsciiCharacter",
                "NonAsciiName",
                "UnterminatedText"
            ]
        );
        assert_eq!(spellings("a /* b"), ["a", "UnterminatedComment"]);
    }
}
