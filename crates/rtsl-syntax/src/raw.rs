//! The text before preprocessing: its words, comments and directives, for formatters and editors.

use std::ops::Range;

use rtsl_source::{Diagnostic, FileId};

use crate::lexer::lex_with_comments;
use crate::symbol::Interner;
use crate::token::{Punctuator, Token, TokenKind};
use crate::word::Word;

/// A piece of the text. Only white space and line continuations lie between pieces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawToken {
    /// The kind of piece.
    pub kind: RawKind,
    /// The bytes of the text.
    pub range: Range<usize>,
}

/// The kinds of pieces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RawKind {
    /// A word of the grammar, such as `if` or `public`.
    Keyword,
    /// A type of GLSL, such as `vec3`.
    Type,
    /// Another word.
    Name,
    /// A number.
    Number,
    /// Double-quoted text.
    Text,
    /// An operator or a delimiter.
    Punctuator,
    /// A comment from `//` to the end of its line.
    LineComment,
    /// A comment between `/*` and `*/`.
    BlockComment,
    /// A directive of the preprocessor: the rest of a line from `#`, with continuations and comments.
    Directive,
    /// A piece that is not a token.
    Invalid,
}

/// Splits `text` into its pieces, in their order.
pub fn raw_tokens(text: &str) -> Vec<RawToken> {
    let mut symbols = Interner::default();
    let (tokens, comments) = lex_with_comments(FileId(0), text, &mut symbols);
    let mut pieces: Vec<(RawToken, bool)> = Vec::with_capacity(tokens.len() + comments.len());
    let mut comments = comments.into_iter().map(|range| comment(text, range)).peekable();
    for token in tokens {
        let start = token.span.start as usize;
        while let Some(piece) = comments.next_if(|comment| comment.range.start < start) {
            pieces.push((piece, false));
        }
        let range = start..token.span.end as usize;
        let piece = RawToken { kind: kind_of(token, &symbols), range };
        let begins_directive = token.starts_line && &text[piece.range.clone()] == "#";
        pieces.push((piece, begins_directive));
    }
    pieces.extend(comments.map(|piece| (piece, false)));
    join_directives(text, pieces)
}

/// Returns the words of a text that is not preprocessed, in their order: names and keywords outside of comments, quoted
/// text and the messages of `#error`.
pub fn words(text: &str) -> Vec<&str> {
    let mut symbols = Interner::default();
    let (tokens, _) = lex_with_comments(FileId(0), text, &mut symbols);
    let mut words = Vec::new();
    let mut line_start = 0;
    for (index, token) in tokens.iter().enumerate() {
        if token.starts_line {
            line_start = index;
        }
        let is_message = matches!(tokens[line_start..=index], [hash, name, ..]
            if hash.is(Punctuator::Hash) && symbols.text(name.spelling) == "error");
        if token.kind == TokenKind::Name && !is_message {
            words.push(&text[token.span.start as usize..token.span.end as usize]);
        }
    }
    words
}

/// Returns the error of the first invalid token of `file`, if it has one outside directives.
pub fn first_lexical_error(file: FileId, text: &str) -> Option<Diagnostic> {
    let invalid = raw_tokens(text).into_iter().find(|token| token.kind == RawKind::Invalid)?;
    let (tokens, _) = lex_with_comments(file, text, &mut Interner::default());
    let token = tokens.into_iter().find(|it| it.span.start as usize == invalid.range.start)?;
    let TokenKind::Invalid(error) = token.kind else { return None };
    Some(error.diagnostic(token.span, &text[invalid.range]))
}

fn comment(text: &str, range: Range<usize>) -> RawToken {
    let is_block = without_continuations(text, &range).starts_with("/*");
    let kind = if is_block { RawKind::BlockComment } else { RawKind::LineComment };
    RawToken { kind, range }
}

/// The first two characters of a comment, which a continuation may part.
fn without_continuations(text: &str, range: &Range<usize>) -> String {
    let characters = text[range.clone()].chars();
    characters.filter(|it| !matches!(it, '\\' | '\n' | '\r')).take(2).collect()
}

fn kind_of(token: Token, symbols: &Interner) -> RawKind {
    match token.kind {
        TokenKind::Name => match symbols.word(token.spelling) {
            Word::Keyword(_) => RawKind::Keyword,
            Word::Type => RawKind::Type,
            Word::Reserved(_) | Word::Plain => RawKind::Name,
        },
        TokenKind::Number => RawKind::Number,
        TokenKind::Text => RawKind::Text,
        TokenKind::Punctuator(_) => RawKind::Punctuator,
        TokenKind::Invalid(_) | TokenKind::End => RawKind::Invalid,
    }
}

/// Makes one piece of each directive, from its `#` to the end of its line.
fn join_directives(text: &str, pieces: Vec<(RawToken, bool)>) -> Vec<RawToken> {
    let mut joined: Vec<RawToken> = Vec::with_capacity(pieces.len());
    let mut end = 0;
    for (piece, begins_directive) in pieces {
        if begins_directive {
            end = end_of_directive(text, piece.range.start);
            joined.push(RawToken { kind: RawKind::Directive, range: piece.range.start..end });
        } else if piece.range.start >= end {
            joined.push(piece);
        } else if piece.range.end > end
            && let Some(directive) = joined.last_mut()
        {
            // A comment that ends on a later line, after which the directive goes on.
            end = end_of_directive(text, piece.range.end);
            directive.range.end = end;
        }
    }
    joined
}

/// The end of the line of `start`, or of the last line that continuations join to it, without blanks.
fn end_of_directive(text: &str, start: usize) -> usize {
    let mut end = start;
    for line in text[start..].split_inclusive('\n') {
        end += line.len();
        let written = line.trim_end_matches(['\n', '\r']);
        if !written.ends_with('\\') {
            break;
        }
    }
    start + text[start..end].trim_end().len()
}
