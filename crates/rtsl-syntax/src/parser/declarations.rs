//! Variables and their initial values.

use super::{Parse, Parser};
use crate::ast::{
    Annotation, Expression, ExpressionKind, Identifier, Initializer, Qualifiers, Struct, TypeName,
    Variable,
};
use crate::token::Punctuator;
use crate::word::Word;

impl Parser<'_> {
    /// Parses declarators after the first one's name, up to a token other than `,`. `cost` is the cost
    /// of what each further declarator copies.
    pub(super) fn parse_declarators(
        &mut self,
        annotations: Vec<Annotation>,
        qualifiers: Qualifiers,
        ty: TypeName,
        first_name: Identifier,
        cost: usize,
        variables: &mut Vec<Variable>,
    ) -> Parse<()> {
        let mut name = first_name;
        loop {
            let mut own_type = ty.clone();
            let start = name.span;
            self.parse_declarator_sizes(&mut own_type)?;
            let (initializer, failed) = self.parse_optional_initializer();
            variables.push(Variable {
                annotations: annotations.clone(),
                qualifiers: qualifiers.clone(),
                ty: own_type,
                name,
                initializer,
                span: start.to(self.previous_span()),
            });
            if self.maybe(Punctuator::Comma).is_none() {
                return match failed {
                    // A missing `;` would be an error on top of the one reported.
                    Some(reported) if !self.at(Punctuator::Semicolon) => Err(reported),
                    _ => Ok(()),
                };
            }
            self.charge_copy(cost)?;
            name = self.expect_identifier("the declaration's name")?;
        }
    }

    /// Parses `= value` if it is present. A value that cannot be parsed becomes an error
    /// expression, so that the variable is declared nevertheless.
    pub(super) fn parse_optional_initializer(
        &mut self,
    ) -> (Option<Initializer>, Option<super::Reported>) {
        let Some(assign) = self.maybe(Punctuator::Assign) else { return (None, None) };
        match self.parse_initializer() {
            Ok(initializer) => (Some(initializer), None),
            Err(reported) => {
                self.recover_declarator();
                let kind = ExpressionKind::Error;
                let error = Expression { kind, span: assign.span.to(self.previous_span()) };
                self.skipped.push(error.span);
                (Some(Initializer::Expression(error)), Some(reported))
            }
        }
    }

    pub(super) fn parse_initializer(&mut self) -> Parse<Initializer> {
        if !self.at(Punctuator::LeftBrace) {
            return Ok(Initializer::Expression(self.parse_argument()?));
        }
        self.nested(|this| {
            let open = this.bump();
            let mut values = Vec::new();
            while !this.at(Punctuator::RightBrace) {
                values.push(this.parse_initializer()?);
                if this.maybe(Punctuator::Comma).is_none() {
                    break;
                }
            }
            let close = this.expect_closing(open, Punctuator::RightBrace)?;
            Ok(Initializer::List(values, open.span.to(close.span)))
        })
    }

    /// Parses a struct and the variables declared along with it, including the `;`.
    pub(super) fn parse_struct_declaration(
        &mut self,
        annotations: Vec<Annotation>,
        cost: usize,
        qualifiers: Qualifiers,
    ) -> Parse<(Struct, Vec<Variable>)> {
        let structure = self.parse_struct()?;
        let mut variables = Vec::new();
        if self.at_declarator_of_struct() {
            let ty = TypeName {
                name: Identifier { name: structure.name.name.clone(), span: structure.name.span },
                sizes: Vec::new(),
                span: structure.name.span,
            };
            let name = self.expect_identifier("the declaration's name")?;
            self.parse_declarators(annotations, qualifiers, ty, name, cost + 1, &mut variables)?;
        }
        self.expect_semicolon("the struct")?;
        Ok((structure, variables))
    }

    /// True if a declarator of the struct just parsed begins here. A name on the next line may
    /// instead be the type of the next declaration, if the struct's `;` is missing.
    fn at_declarator_of_struct(&self) -> bool {
        if !self.peek().starts_line {
            return self.at_type_name();
        }
        if self.word_of(self.peek()) != Some(Word::Plain) {
            return false;
        }
        let after = self.tokens[self.after_array_sizes(self.position + 1)];
        let separators = [Punctuator::Semicolon, Punctuator::Comma, Punctuator::Assign];
        separators.iter().any(|separator| after.is(*separator))
    }
}
