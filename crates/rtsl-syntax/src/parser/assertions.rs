//! Static assertions: `static_assert(condition, "text");`.
//!
//! The name is no keyword. What makes an assertion of a call is its text, which no other call can have.

use super::{Parse, Parser};
use crate::ast::{AnnotationValue, Assertion};
use crate::token::{Punctuator, TokenKind};

/// The name that begins an assertion.
const NAME: &str = "static_assert";

impl Parser<'_> {
    /// True before a static assertion.
    pub(super) fn at_assertion(&self) -> bool {
        let first = self.peek();
        if first.kind != TokenKind::Name
            || self.text(first) != NAME
            || !self.peek_at(1).is(Punctuator::LeftParenthesis)
        {
            return false;
        }
        let tokens = (2..).map(|ahead| self.peek_at(ahead));
        let mut ends = tokens.filter(|token| {
            matches!(token.kind, TokenKind::Text | TokenKind::End)
                || token.is(Punctuator::Semicolon)
                || token.is(Punctuator::RightBrace)
        });
        ends.next().is_some_and(|token| token.kind == TokenKind::Text)
    }

    /// Parses `static_assert(condition, "text");`.
    pub(super) fn parse_assertion(&mut self) -> Parse<Assertion> {
        let name = self.bump();
        let open = self.expect(Punctuator::LeftParenthesis)?;
        let condition = self.parse_argument()?;
        self.expect(Punctuator::Comma)?;
        if self.peek().kind != TokenKind::Text {
            return Err(self.unexpected("the text that is shown if the condition is false"));
        }
        let AnnotationValue::Text(text, _) = self.parse_text() else { unreachable!("a text") };
        let close = self.expect_closing(open, Punctuator::RightParenthesis)?;
        self.expect_semicolon("the assertion")?;
        Ok(Assertion { condition, text, span: name.span.to(close.span) })
    }
}
