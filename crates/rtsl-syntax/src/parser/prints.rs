//! Prints: `print("t = {}", t);`.
//!
//! The name is no keyword. What makes a print of a call is its text, which no other call can begin with.

use super::{Parse, Parser};
use crate::ast::{AnnotationValue, Print};
use crate::token::{Punctuator, TokenKind};

/// The name that begins a print.
const NAME: &str = "print";

impl Parser<'_> {
    /// True before a print.
    pub(super) fn at_print(&self) -> bool {
        let first = self.peek();
        first.kind == TokenKind::Name
            && self.text(first) == NAME
            && self.peek_at(1).is(Punctuator::LeftParenthesis)
            && self.peek_at(2).kind == TokenKind::Text
    }

    /// Parses `print("text", argument, ...);`.
    pub(super) fn parse_print(&mut self) -> Parse<Print> {
        self.bump();
        let open = self.expect(Punctuator::LeftParenthesis)?;
        let AnnotationValue::Text(text, text_span) = self.parse_text() else {
            unreachable!("a text")
        };
        let mut arguments = Vec::new();
        while self.maybe(Punctuator::Comma).is_some() {
            arguments.push(self.parse_argument()?);
        }
        self.expect_closing(open, Punctuator::RightParenthesis)?;
        self.expect_semicolon("the print")?;
        Ok(Print { text, text_span, arguments })
    }
}
