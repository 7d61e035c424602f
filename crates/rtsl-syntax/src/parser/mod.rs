//! The parser: tokens to tree, with error recovery.
//!
//! A `parse_x` function parses an `x` or fails with [`Reported`]. The error has been reported by
//! then, and the caller either passes it on or recovers at a token where parsing can most likely
//! continue: the next `;`, the closing brace, the next class. Depth is counted on the way down and,
//! for operators that follow an operand, on the way up, so that no tree is deeper than
//! [`deep_stack::depth`] allows and the parser's recursion is bounded too. Chains of binary
//! operators are parsed by a loop; their length does not count as depth.

mod assertions;
mod declarations;
mod enumerations;
mod expressions;
mod items;
mod operators;
mod prints;
mod statements;
mod types;

pub use types::qualifiers;

use std::collections::HashMap;

use rtsl_source::{
    Code, Diagnostic, Diagnostics, FileId, SourceMap, Span, deep_stack, diagnostic_codes as codes,
};

use crate::ast::{Identifier, Import, TranslationUnit};
use crate::comments::Comments;
use crate::message::shorten;
use crate::symbol::Interner;
use crate::token::{Punctuator, Token, TokenKind};
use crate::word::{Keyword, Reading, Reserved, Word};

/// The limit on tokens copied because one type or annotation serves several declarators.
const MAX_COPIED_TOKENS: usize = 1 << 20;

/// Parses `tokens`, the last of which is the end token.
pub(crate) fn parse_tokens(
    tokens: Vec<Token>,
    comments: &HashMap<FileId, Comments>,
    map: &SourceMap,
    symbols: &Interner,
    diagnostics: &mut Diagnostics,
) -> TranslationUnit {
    let mut parser = Parser {
        tokens,
        position: 0,
        comments,
        map,
        symbols,
        diagnostics,
        depth: 0,
        max_depth: deep_stack::depth(),
        reported_at: None,
        copied: 0,
        unnamed_structs: 0,
        class: None,
        imports: Vec::new(),
        skipped: Vec::new(),
    };
    parser.parse_translation_unit()
}

/// An error that has been reported: the caller recovers or passes it on.
#[derive(Clone, Copy, Debug)]
struct Reported;

type Parse<T> = Result<T, Reported>;

struct Parser<'a> {
    tokens: Vec<Token>,
    position: usize,
    comments: &'a HashMap<FileId, Comments>,
    map: &'a SourceMap,
    symbols: &'a Interner,
    diagnostics: &'a mut Diagnostics,
    /// The current depth in the tree.
    depth: usize,
    /// The limit for `depth`.
    max_depth: usize,
    /// The span of the last error. A second error with the same span is dropped, since it would
    /// only repeat the first. All tokens of a macro's expansion share one span.
    reported_at: Option<Span>,
    /// The number of tokens copied so far, see [`MAX_COPIED_TOKENS`].
    copied: usize,
    unnamed_structs: u32,
    /// The name of the class that is being parsed.
    class: Option<String>,
    /// The imports so far.
    imports: Vec<Import>,
    /// The parts of the text that are not in the tree, so far.
    skipped: Vec<Span>,
}

// The cursor.
impl<'a> Parser<'a> {
    fn peek(&self) -> Token {
        self.peek_at(0)
    }

    fn peek_at(&self, distance: usize) -> Token {
        let last = self.tokens.len() - 1;
        self.tokens[(self.position + distance).min(last)]
    }

    fn bump(&mut self) -> Token {
        let token = self.peek();
        self.position = (self.position + 1).min(self.tokens.len() - 1);
        token
    }

    fn at_end(&self) -> bool {
        self.peek().kind == TokenKind::End
    }

    fn at(&self, punctuator: Punctuator) -> bool {
        self.peek().is(punctuator)
    }

    fn maybe(&mut self, punctuator: Punctuator) -> Option<Token> {
        self.at(punctuator).then(|| self.bump())
    }

    fn word_of(&self, token: Token) -> Option<Word> {
        (token.kind == TokenKind::Name).then(|| self.symbols.word(token.spelling))
    }

    fn peek_keyword(&self) -> Option<Keyword> {
        match self.word_of(self.peek()) {
            Some(Word::Keyword(keyword)) => Some(keyword),
            _ => None,
        }
    }

    fn at_keyword(&self, keyword: Keyword) -> bool {
        self.peek_keyword() == Some(keyword)
    }

    fn maybe_keyword(&mut self, keyword: Keyword) -> Option<Token> {
        self.at_keyword(keyword).then(|| self.bump())
    }

    fn text(&self, token: Token) -> &'a str {
        self.symbols.text(token.spelling)
    }

    /// The span of the last token that was consumed.
    fn previous_span(&self) -> Span {
        self.tokens[self.position.saturating_sub(1)].span
    }

    /// The index just past the bracket that closes the one at `open`, or of the end.
    fn after_closing(&self, open: usize) -> usize {
        let mut nesting = 0_usize;
        for (offset, token) in self.tokens[open..].iter().enumerate() {
            match token.kind {
                TokenKind::Punctuator(
                    Punctuator::LeftParenthesis | Punctuator::LeftBracket | Punctuator::LeftBrace,
                ) => nesting += 1,
                TokenKind::Punctuator(
                    Punctuator::RightParenthesis
                    | Punctuator::RightBracket
                    | Punctuator::RightBrace,
                ) => {
                    nesting = nesting.saturating_sub(1);
                    if nesting == 0 {
                        return open + offset + 1;
                    }
                }
                _ => {}
            }
        }
        self.tokens.len() - 1
    }

    /// Asserts that a loop that began an item at `before` has consumed a token.
    fn ensure_progress(&mut self, before: usize) {
        debug_assert!(self.position > before || self.at_end(), "no progress at {before}");
        if self.position == before {
            self.bump();
        }
    }
}

// Errors.
impl Parser<'_> {
    fn report(&mut self, diagnostic: Diagnostic) -> Reported {
        let token = self.peek();
        if !token.after_invalid && self.reported_at != Some(token.span) {
            self.diagnostics.push(diagnostic);
        }
        self.reported_at = Some(token.span);
        Reported
    }

    /// Reports an error regardless of earlier ones, for text that is then parsed as if it were
    /// valid.
    fn complain(&mut self, code: Code, message: impl Into<String>, place: Span, label: &str) {
        self.diagnostics.push(Diagnostic::new(code, message).at(place, label));
    }

    /// Reports that the next token is not `expected`.
    fn unexpected(&mut self, expected: &str) -> Reported {
        let token = self.peek();
        if let Some(Word::Reserved(reserved)) = self.word_of(token) {
            self.complain_reserved(token, reserved);
            self.reported_at = Some(token.span);
            return Reported;
        }
        let found = self.describe(token);
        let code = match token.kind {
            TokenKind::Text => codes::MISPLACED_TEXT,
            _ => codes::UNEXPECTED_TOKEN,
        };
        let mut diagnostic = Diagnostic::new(code, format!("expected {expected}, found {found}"))
            .at(token.span, format!("expected {expected}"));
        if token.kind == TokenKind::Text {
            diagnostic = diagnostic.note(
                "RTSL has no type for text; text is allowed in annotations, directives and `print` only",
            );
            if self.begins_arguments_of(&["printf", "fprintf"]) {
                diagnostic =
                    diagnostic.help("write `print(\"x = {}\", x);`, with `{}` for each value");
            }
            if self.begins_arguments_of(&["print"]) {
                diagnostic = diagnostic.help("`print` is a statement, and has no value");
            }
        }
        self.report(diagnostic)
    }

    /// True if the next token is the first argument of a call of one of these functions.
    fn begins_arguments_of(&self, functions: &[&str]) -> bool {
        let [.., name, parenthesis] = &self.tokens[..self.position] else { return false };
        parenthesis.is(Punctuator::LeftParenthesis)
            && name.kind == TokenKind::Name
            && functions.contains(&self.text(*name))
    }

    fn complain_reserved(&mut self, token: Token, reserved: Reserved) {
        let text = self.text(token);
        let diagnostic = Diagnostic::new(
            codes::RESERVED_WORD,
            format!("`{text}` is a reserved word of GLSL that RTSL does not use"),
        )
        .at(token.span, "not available here");
        let diagnostic = match reserved.reading {
            Reading::Type(instead) => {
                diagnostic.note(reserved.help).suggest("write instead", token.span, instead)
            }
            Reading::Qualifier | Reading::Layout | Reading::Statement | Reading::Name => {
                diagnostic.help(reserved.help)
            }
        };
        self.diagnostics.push(diagnostic);
    }

    fn describe(&self, token: Token) -> String {
        let text = shorten(self.text(token));
        match token.kind {
            TokenKind::End => "the end of the text".to_string(),
            TokenKind::Number => format!("number `{text}`"),
            TokenKind::Text => "double-quoted text".to_string(),
            TokenKind::Punctuator(_) | TokenKind::Invalid(_) => format!("`{text}`"),
            TokenKind::Name => match self.symbols.word(token.spelling) {
                Word::Keyword(_) => format!("keyword `{text}`"),
                Word::Type => format!("type `{text}`"),
                Word::Reserved(_) | Word::Plain => format!("name `{text}`"),
            },
        }
    }

    fn expect(&mut self, punctuator: Punctuator) -> Parse<Token> {
        match self.maybe(punctuator) {
            Some(token) => Ok(token),
            None => Err(self.unexpected(&format!("`{}`", punctuator.text()))),
        }
    }

    /// Parses the bracket that closes `open`.
    fn expect_closing(&mut self, open: Token, closing: Punctuator) -> Parse<Token> {
        if let Some(token) = self.maybe(closing) {
            return Ok(token);
        }
        let found = self.describe(self.peek());
        let diagnostic = Diagnostic::new(
            codes::UNCLOSED_DELIMITER,
            format!("expected `{}`, found {found}", closing.text()),
        )
        .at(self.peek().span, format!("expected `{}`", closing.text()))
        .label(open.span, format!("to close this `{}`", self.text(open)));
        Err(self.report(diagnostic))
    }

    /// Parses a `;`. If it is missing at the end of a line, the error is reported and parsing
    /// continues as if it were there.
    fn expect_semicolon(&mut self, after: &str) -> Parse<()> {
        if self.maybe(Punctuator::Semicolon).is_some() {
            return Ok(());
        }
        let next = self.peek();
        if let Some(Word::Reserved(_)) = self.word_of(next) {
            return Err(self.unexpected("`;`"));
        }
        let found = self.describe(next);
        let place = self.previous_span().after();
        let diagnostic = Diagnostic::new(
            codes::UNEXPECTED_TOKEN,
            format!("expected `;` after {after}, found {found}"),
        )
        .at(place, "expected `;`")
        .suggest("add it", place, ";");
        let reported = self.report(diagnostic);
        if next.starts_line || next.is(Punctuator::RightBrace) { Ok(()) } else { Err(reported) }
    }

    /// Parses a name that a declaration may introduce.
    fn expect_identifier(&mut self, what: &str) -> Parse<Identifier> {
        let token = self.peek();
        match self.word_of(token) {
            Some(Word::Plain) => {}
            Some(Word::Reserved(reserved)) => self.complain_reserved(token, reserved),
            Some(Word::Keyword(_) | Word::Type) => {
                let diagnostic = Diagnostic::new(
                    codes::KEYWORD_AS_NAME,
                    format!("expected {what}, found {}", self.describe(token)),
                )
                .at(token.span, "this is a keyword")
                .help("choose another name");
                return Err(self.report(diagnostic));
            }
            None => return Err(self.unexpected(what)),
        }
        self.bump();
        Ok(self.identifier(token))
    }

    fn identifier(&self, token: Token) -> Identifier {
        Identifier { name: self.text(token).to_string(), span: token.span }
    }
}

// Limits.
impl Parser<'_> {
    /// Runs `parse` one level deeper.
    fn nested<T>(&mut self, parse: impl FnOnce(&mut Self) -> Parse<T>) -> Parse<T> {
        self.check_depth(1)?;
        self.depth += 1;
        let result = parse(self);
        self.depth -= 1;
        result
    }

    /// Fails if a tree of this height would be too deep here. The rest of the text is skipped,
    /// since every way out of the nesting would be another error.
    fn check_depth(&mut self, height: usize) -> Parse<()> {
        if self.depth + height <= self.max_depth {
            return Ok(());
        }
        let place = self.peek().span;
        let message = format!("nested more than {} deep", self.max_depth);
        let diagnostic = Diagnostic::new(codes::NESTED_TOO_DEEPLY, message)
            .at(place, "too deep here; the rest is not read")
            .note("parentheses, prefix operators, `?:`, blocks and `else if` count together")
            .help("move parts into variables or functions, or loop over an array");
        let reported = self.report(diagnostic);
        self.position = self.tokens.len() - 1;
        self.reported_at = Some(self.peek().span);
        Err(reported)
    }

    /// The cost of a copy of the tokens since the one at `start`: one for each, more for long ones.
    fn cost_since(&self, start: usize) -> usize {
        let tokens = self.tokens[start..self.position].iter();
        tokens.map(|token| 1 + self.text(*token).len() / 16).sum()
    }

    /// Counts a copy of tokens; fails past the limit.
    fn charge_copy(&mut self, cost: usize) -> Parse<()> {
        self.copied += cost;
        if self.copied <= MAX_COPIED_TOKENS {
            return Ok(());
        }
        let place = self.peek().span;
        let diagnostic = Diagnostic::new(
            codes::NESTED_TOO_DEEPLY,
            "too many declarators share one long type or annotation".to_string(),
        )
        .at(place, "the limit is reached here")
        .help("declare them one by one, or name the array's size in a constant");
        Err(self.report(diagnostic))
    }
}

// Recovery.
impl Parser<'_> {
    /// Notes that the tokens from the one at `before` up to the next are not in the tree.
    fn note_skipped(&mut self, before: usize) {
        self.skipped.push(self.tokens[before].span.to(self.previous_span()));
    }

    /// Skips to the beginning of the next statement or member: past a `;` or a block, or before a
    /// `}`, a class or the end.
    fn recover_statement(&mut self) {
        while !self.at_end() {
            match self.peek().kind {
                TokenKind::Punctuator(Punctuator::Semicolon) => {
                    self.bump();
                    return;
                }
                TokenKind::Punctuator(Punctuator::LeftBrace) => {
                    self.position = self.after_closing(self.position);
                    self.maybe(Punctuator::Semicolon);
                    return;
                }
                TokenKind::Punctuator(Punctuator::RightBrace) => return,
                _ if self.at_class() => return,
                _ => {
                    self.bump();
                }
            }
        }
    }

    /// Skips past the parenthesis that closes a header; stops before braces.
    fn recover_parenthesis(&mut self) {
        let mut nesting = 0_usize;
        while !self.at_end() && !self.at_class() {
            match self.peek().kind {
                TokenKind::Punctuator(Punctuator::LeftParenthesis) => nesting += 1,
                TokenKind::Punctuator(Punctuator::RightParenthesis) if nesting == 0 => {
                    self.bump();
                    return;
                }
                TokenKind::Punctuator(Punctuator::RightParenthesis) => nesting -= 1,
                TokenKind::Punctuator(Punctuator::LeftBrace | Punctuator::RightBrace) => return,
                _ => {}
            }
            self.bump();
        }
    }

    /// Skips to the `,` or `;` that ends a declarator; stops before `}`.
    fn recover_declarator(&mut self) {
        while !self.at_end() && !self.at_class() {
            match self.peek().kind {
                TokenKind::Punctuator(
                    Punctuator::Comma | Punctuator::Semicolon | Punctuator::RightBrace,
                ) => return,
                TokenKind::Punctuator(
                    Punctuator::LeftParenthesis | Punctuator::LeftBracket | Punctuator::LeftBrace,
                ) => self.position = self.after_closing(self.position),
                _ => {
                    self.bump();
                }
            }
        }
    }

    fn at_class(&self) -> bool {
        self.at_keyword(Keyword::Class)
    }
}
