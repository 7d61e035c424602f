//! Tokens of the scene format: words, numbers, quoted strings and brackets.

use rtsl::{FileId, Span};

/// A token and its position.
#[derive(Clone, Debug, PartialEq)]
pub struct Token {
    /// The kind of the token.
    pub kind: TokenKind,
    /// The position.
    pub span: Span,
}

/// The kinds of token.
#[derive(Clone, Debug, PartialEq)]
pub enum TokenKind {
    /// A directive, `true` or `false`; its text is the span's.
    Word,
    /// A finite number.
    Number(f64),
    /// A quoted string with its escapes resolved.
    Text(String),
    /// `[`
    Open,
    /// `]`
    Close,
    /// A word that starts like a number but is not one.
    BadNumber,
    /// A quoted string without its closing quote on the same line.
    UnclosedText,
    /// The end of the file.
    End,
}

/// Splits a text into tokens, on demand.
pub struct Lexer<'a> {
    text: &'a str,
    file: FileId,
    offset: usize,
}

impl<'a> Lexer<'a> {
    /// Creates a lexer at the beginning of `text`, which is the text of `file`.
    pub fn new(file: FileId, text: &'a str) -> Self {
        // A byte order mark, which editors of some systems write.
        let offset = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
        Lexer { text, file, offset }
    }

    /// Returns the text of the whole file.
    pub fn text(&self) -> &'a str {
        self.text
    }

    /// Returns the next token; at the end always [`TokenKind::End`].
    pub fn next_token(&mut self) -> Token {
        self.skip_blanks_and_comments();
        let start = self.offset;
        let kind = match self.peek_byte() {
            None => TokenKind::End,
            Some(b'[') => self.single(TokenKind::Open),
            Some(b']') => self.single(TokenKind::Close),
            Some(b'"') => self.lex_text(),
            Some(_) => self.lex_word_or_number(),
        };
        Token { kind, span: Span::new(self.file, start as u32, self.offset as u32) }
    }

    fn peek_byte(&self) -> Option<u8> {
        self.text.as_bytes().get(self.offset).copied()
    }

    fn single(&mut self, kind: TokenKind) -> TokenKind {
        self.offset += 1;
        kind
    }

    fn skip_blanks_and_comments(&mut self) {
        while let Some(byte) = self.peek_byte() {
            // Earlier versions of the format have commas between numbers.
            if byte.is_ascii_whitespace() || byte == b',' {
                self.offset += 1;
            } else if byte == b'#' {
                let rest = &self.text.as_bytes()[self.offset..];
                let length = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
                self.offset += length;
            } else {
                break;
            }
        }
    }

    fn lex_text(&mut self) -> TokenKind {
        let mut value = String::new();
        let mut escaped = false;
        let body = &self.text[self.offset + 1..];
        for (index, character) in body.char_indices() {
            if character == '\n' {
                self.offset += 1 + index;
                return TokenKind::UnclosedText;
            }
            if escaped {
                match unescape(character) {
                    Some(character) => value.push(character),
                    None => value.extend(['\\', character]),
                }
                escaped = false;
            } else if character == '\\' {
                escaped = true;
            } else if character == '"' {
                self.offset += 1 + index + 1;
                return TokenKind::Text(value);
            } else {
                value.push(character);
            }
        }
        self.offset = self.text.len();
        TokenKind::UnclosedText
    }

    fn lex_word_or_number(&mut self) -> TokenKind {
        let rest = &self.text[self.offset..];
        let ends = |byte: &u8| {
            byte.is_ascii_whitespace() || matches!(byte, b'[' | b']' | b'"' | b'#' | b',')
        };
        let length = rest.as_bytes().iter().position(ends).unwrap_or(rest.len());
        self.offset += length;
        classify(&rest[..length])
    }
}

/// The character of an escape; `None` if there is none of this letter, as in the names of files of Windows.
fn unescape(character: char) -> Option<char> {
    match character {
        'n' => Some('\n'),
        't' => Some('\t'),
        'r' => Some('\r'),
        '\\' | '"' | '\'' => Some(character),
        _ => None,
    }
}

/// A word that starts like a number must be one. Rust's parser would also accept `inf` and `nan`, which the format does
/// not have, and returns infinity for numbers that are too large.
fn classify(word: &str) -> TokenKind {
    let starts_number =
        word.starts_with(|first: char| first.is_ascii_digit() || "+-.".contains(first));
    if !starts_number {
        return TokenKind::Word;
    }
    let spelled_as_number = word
        .bytes()
        .all(|byte| byte.is_ascii_digit() || matches!(byte, b'+' | b'-' | b'.' | b'e' | b'E'));
    match word.parse::<f64>() {
        Ok(value) if spelled_as_number && value.is_finite() => TokenKind::Number(value),
        _ => TokenKind::BadNumber,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds(text: &str) -> Vec<TokenKind> {
        let mut lexer = Lexer::new(FileId(0), text);
        let mut kinds = Vec::new();
        loop {
            let token = lexer.next_token();
            if token.kind == TokenKind::End {
                return kinds;
            }
            kinds.push(token.kind);
        }
    }

    #[test]
    fn words_numbers_texts_and_brackets() {
        use TokenKind::*;
        assert_eq!(
            kinds("Shape \"a\\\"b\"[1 -.5e1]# rest\nx"),
            [Word, Text("a\"b".into()), Open, Number(1.0), Number(-5.0), Close, Word]
        );
    }

    #[test]
    fn commas_separate_and_backslashes_stay() {
        use TokenKind::*;
        assert_eq!(
            kinds("[1, 2,.5] 3,"),
            [Open, Number(1.0), Number(2.0), Number(0.5), Close, Number(3.0)]
        );
        assert_eq!(
            kinds(r#""a\\b" "c\d\\" "e\'""#),
            [Text(r"a\b".into()), Text(r"c\d\".into()), Text("e'".into()),]
        );
    }

    #[test]
    fn what_is_no_number_is_said_to_be_none() {
        use TokenKind::*;
        assert_eq!(
            kinds("1e999 1.2.3 0x10 -inf nan + 1f"),
            [BadNumber, BadNumber, BadNumber, BadNumber, Word, BadNumber, BadNumber]
        );
    }

    #[test]
    fn an_unclosed_text_ends_with_its_line() {
        use TokenKind::*;
        assert_eq!(kinds("\"ab\nc \"é"), [UnclosedText, Word, UnclosedText]);
    }
}
