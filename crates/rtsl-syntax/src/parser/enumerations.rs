//! Enumerations: `enum Name { First, Second = 4 };`.

use rtsl_source::diagnostic_codes as codes;

use super::{Parse, Parser};
use crate::ast::{Annotation, Enumeration, Qualifiers};
use crate::token::Punctuator;

impl Parser<'_> {
    /// Reports annotations and qualifiers of an enumeration.
    pub(super) fn refuse_before_enumeration(
        &mut self,
        annotations: &[Annotation],
        qualifiers: &Qualifiers,
    ) {
        let annotation = annotations.first().map(|annotation| annotation.key.span);
        let qualifier = qualifiers.list.first().map(|(_, place)| *place);
        if let Some(place) = annotation.or(qualifier) {
            self.complain(
                codes::UNEXPECTED_TOKEN,
                "an enumeration has no annotations and no qualifiers",
                place,
                "leave this out, or write it at a member whose type is the enumeration",
            );
        }
    }

    /// Parses `enum Name { First, Second = 4 }` and the `;` after it, which may be absent.
    pub(super) fn parse_enumeration(&mut self) -> Parse<Enumeration> {
        let keyword = self.bump();
        let name = self.expect_identifier("the enumeration's name")?;
        let open = self.expect(Punctuator::LeftBrace)?;
        let mut choices = Vec::new();
        while !self.at(Punctuator::RightBrace) {
            let choice = self.expect_identifier("a choice's name")?;
            let value = match self.maybe(Punctuator::Assign) {
                Some(_) => Some(self.parse_argument()?),
                None => None,
            };
            choices.push((choice, value));
            if self.maybe(Punctuator::Comma).is_none() {
                break;
            }
        }
        let close = self.expect_closing(open, Punctuator::RightBrace)?;
        self.maybe(Punctuator::Semicolon);
        Ok(Enumeration { name, choices, span: keyword.span.to(close.span) })
    }
}
