//! Tokens with the comments and directives around them.

use rtsl_syntax::raw::{RawKind, RawToken, raw_tokens};

/// A token and what lies between it and its neighbours.
#[derive(Clone, Debug)]
pub(crate) struct Token<'a> {
    /// The token; empty for the end of the text.
    pub text: &'a str,
    /// Its kind; the end of the text counts as invalid.
    pub kind: RawKind,
    /// The offset of the token in the text.
    pub start: usize,
    /// The comments and directives before the token, in their order.
    pub before: Vec<Trivia<'a>>,
    /// The number of line breaks between the token and what precedes it.
    pub newlines: usize,
    /// The comments after the token on its line, if the line ends with them.
    pub after: Option<&'a str>,
}

/// A comment or a directive.
#[derive(Clone, Debug)]
pub(crate) struct Trivia<'a> {
    /// The text, without blanks at its end.
    pub text: &'a str,
    /// True for a directive.
    pub is_directive: bool,
    /// The number of line breaks between it and what precedes it.
    pub newlines: usize,
    /// True if the line goes on after it: a comment of one line between tokens of one line.
    pub is_inline: bool,
}

impl Token<'_> {
    /// True at this punctuator or word.
    pub fn is(&self, text: &str) -> bool {
        self.text == text && self.kind != RawKind::Text
    }

    /// True for the end of the text.
    pub fn is_end(&self) -> bool {
        self.text.is_empty()
    }

    /// The number of line breaks between what precedes the token and its first comment, or itself.
    pub fn newlines_before_all(&self) -> usize {
        self.before.first().map_or(self.newlines, |trivia| trivia.newlines)
    }

    /// True if comments or directives before the token, or a comment after it, end a line.
    pub fn ends_lines(&self) -> bool {
        self.after.is_some() || self.before.iter().any(|trivia| !trivia.is_inline)
    }
}

/// Splits a text into tokens. The last is its end.
pub(crate) fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut reader = Reader { text, end: 0, tokens: Vec::new(), before: Vec::new(), after: 0 };
    let raw = raw_tokens(text);
    for (index, piece) in raw.iter().enumerate() {
        match piece.kind {
            RawKind::LineComment | RawKind::BlockComment | RawKind::Directive => {
                reader.trivia(piece, ends_line(text, &raw[index..]));
            }
            _ => reader.token(piece.kind, piece.range.start, piece.range.end),
        }
    }
    reader.token(RawKind::Invalid, text.len(), text.len());
    reader.tokens
}

/// The state of reading a text.
struct Reader<'a> {
    text: &'a str,
    /// The end of what has been read.
    end: usize,
    tokens: Vec<Token<'a>>,
    /// The comments and directives since the last token.
    before: Vec<Trivia<'a>>,
    /// The offset of the comments after the last token on its line, if it has any.
    after: usize,
}

impl<'a> Reader<'a> {
    fn token(&mut self, kind: RawKind, start: usize, end: usize) {
        let before = std::mem::take(&mut self.before);
        let follows_line = before.last().is_some_and(|trivia| !trivia.is_inline);
        let newlines = self.newlines_up_to(start).max(usize::from(follows_line));
        let text = &self.text[start..end];
        self.tokens.push(Token { text, kind, start, before, newlines, after: None });
        self.end = end;
    }

    fn trivia(&mut self, piece: &RawToken, ends_line: bool) {
        let (start, end) = (piece.range.start, piece.range.end);
        let newlines = self.newlines_up_to(start);
        let is_directive = piece.kind == RawKind::Directive;
        let may_trail = ends_line && newlines == 0 && self.before.is_empty() && !is_directive;
        self.end = end;
        if may_trail && let Some(last) = self.tokens.last_mut() {
            let start = if last.after.is_some() { self.after } else { start };
            last.after = Some(self.text[start..end].trim_end());
            self.after = start;
            return;
        }
        let text = self.text[start..end].trim_end();
        let is_inline = piece.kind == RawKind::BlockComment && !ends_line && !text.contains('\n');
        // Others get lines of their own, wherever they stand.
        let newlines = if is_inline { newlines } else { newlines.max(1) };
        self.before.push(Trivia { text, is_directive, newlines, is_inline });
    }

    fn newlines_up_to(&self, start: usize) -> usize {
        self.text[self.end..start].matches('\n').count()
    }
}

/// True if only comments stand between the first of these pieces and the end of its line.
fn ends_line(text: &str, pieces: &[RawToken]) -> bool {
    for pair in pieces.windows(2) {
        let between = &text[pair[0].range.end..pair[1].range.start];
        // A comment of several lines gets lines of its own.
        let has_lines =
            pair[1].kind == RawKind::BlockComment && text[pair[1].range.clone()].contains('\n');
        if between.contains('\n') || has_lines {
            return true;
        }
        if !matches!(pair[1].kind, RawKind::LineComment | RawKind::BlockComment) {
            return false;
        }
    }
    true
}
