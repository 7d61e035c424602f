//! The tokens around a place at which someone types.

use rtsl_syntax::Comments;
use rtsl_syntax::raw::{RawKind, RawToken, raw_tokens};

/// The place at which someone types.
#[derive(Debug)]
pub(crate) struct Cursor<'t> {
    text: &'t str,
    /// The tokens before the word at the cursor.
    tokens: Vec<RawToken>,
    /// The offset of the word at the cursor; that of the cursor if there is none.
    pub start: usize,
    /// The end of the word.
    pub end: usize,
    /// True inside of comments, numbers and double-quoted text.
    pub is_inert: bool,
}

impl<'t> Cursor<'t> {
    /// The cursor at an offset.
    pub fn at(text: &'t str, offset: usize) -> Cursor<'t> {
        let offset = text.floor_char_boundary(offset.min(text.len()));
        let is_letter = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
        let start = text[..offset]
            .rfind(|letter| !is_letter(letter))
            .map_or(0, |at| at + text[at..].chars().next().map_or(1, char::len_utf8));
        let end =
            text[offset..].find(|letter| !is_letter(letter)).map_or(text.len(), |at| offset + at);
        let mut tokens = raw_tokens(text);
        let around =
            tokens.iter().find(|token| token.range.start < offset && offset <= token.range.end);
        let is_inert = around.is_some_and(|token| match token.kind {
            RawKind::LineComment | RawKind::Number => true,
            RawKind::BlockComment | RawKind::Text => offset < token.range.end,
            RawKind::Invalid => true,
            RawKind::Directive => {
                let directive = &text[token.range.clone()];
                Comments::of(directive).contain(directive, offset - token.range.start)
            }
            _ => false,
        });
        tokens.retain(|token| {
            let is_comment = matches!(token.kind, RawKind::LineComment | RawKind::BlockComment);
            token.range.end <= start && !is_comment
                || token.kind == RawKind::Directive && token.range.start < offset
        });
        Cursor { text, tokens, start, end, is_inert }
    }

    /// The directive that contains the cursor.
    pub fn directive(&self) -> Option<&'t str> {
        let last = self.tokens.last().filter(|token| token.kind == RawKind::Directive)?;
        (last.range.end >= self.start).then(|| &self.text[last.range.clone()])
    }

    /// The text of the token before the word; the next before with a greater index.
    pub fn before(&self, index: usize) -> &'t str {
        let token = self.tokens.iter().rev().nth(index);
        token.map_or("", |token| &self.text[token.range.clone()])
    }

    /// True at the key of an annotation.
    pub fn is_annotation_key(&self) -> bool {
        let mut nesting = 0;
        for (index, token) in self.tokens.iter().enumerate().rev() {
            match &self.text[token.range.clone()] {
                ")" | "]" | "}" => nesting += 1,
                "(" | "[" | "{" if nesting > 0 => nesting -= 1,
                "[" => {
                    let is_double =
                        index > 0 && &self.text[self.tokens[index - 1].range.clone()] == "[";
                    return is_double && matches!(self.before(0), "[" | ",");
                }
                "(" | "{" | ";" => return false,
                _ => {}
            }
        }
        false
    }

    /// The innermost call whose parentheses contain the cursor: the offset after its `(`, the end of the name before
    /// it, and the number of commas before the cursor.
    pub fn call(&self) -> Option<(usize, usize, usize)> {
        let (mut nesting, mut commas) = (0, 0);
        for (index, token) in self.tokens.iter().enumerate().rev() {
            match &self.text[token.range.clone()] {
                ")" | "]" | "}" => nesting += 1,
                "(" | "[" | "{" if nesting > 0 => nesting -= 1,
                "(" => {
                    let name = self.tokens.get(index.checked_sub(1)?)?;
                    let is_name = matches!(name.kind, RawKind::Name | RawKind::Type);
                    return is_name.then_some((token.range.end, name.range.end, commas));
                }
                "[" | "{" | ";" => return None,
                "," if nesting == 0 => commas += 1,
                _ => {}
            }
        }
        None
    }
}
