//! Types and qualifiers.

use rtsl_source::{Diagnostic, diagnostic_codes as codes};

use super::{Parse, Parser};
use crate::ast::{Expression, Identifier, Qualifier, Qualifiers, TypeName};
use crate::token::{Punctuator, Token, TokenKind};
use crate::word::{Keyword, Reading, Word};

impl Parser<'_> {
    /// Parses qualifiers in any order. Precision qualifiers are dropped; qualifiers that only GLSL
    /// has are reported and dropped.
    pub(super) fn parse_qualifiers(&mut self) -> Qualifiers {
        let mut qualifiers = Qualifiers::default();
        loop {
            let token = self.peek();
            match self.word_of(token) {
                Some(Word::Keyword(Keyword::Lowp | Keyword::Mediump | Keyword::Highp)) => {
                    self.bump();
                }
                Some(Word::Keyword(keyword)) => {
                    let Some(qualifier) = qualifier(keyword) else { return qualifiers };
                    self.bump();
                    self.add_qualifier(&mut qualifiers, qualifier, token);
                }
                Some(Word::Reserved(reserved))
                    if matches!(reserved.reading, Reading::Qualifier | Reading::Layout) =>
                {
                    self.complain_reserved(token, reserved);
                    self.bump();
                    if reserved.reading == Reading::Layout && self.at(Punctuator::LeftParenthesis) {
                        self.position = self.after_closing(self.position);
                    }
                }
                _ if self.at_texture_qualifier() => {
                    self.bump();
                    self.add_qualifier(&mut qualifiers, Qualifier::Texture, token);
                }
                _ => match self.foreign_qualifier() {
                    Some(help) => self.refuse_qualifier(help),
                    None => return qualifiers,
                },
            }
        }
    }

    /// True at the qualifier `texture`, which is no keyword: a type or another qualifier, and a name, follow.
    fn at_texture_qualifier(&self) -> bool {
        let token = self.peek();
        if token.kind != TokenKind::Name || self.text(token) != "texture" {
            return false;
        }
        match self.word_of(self.peek_at(1)) {
            Some(Word::Keyword(keyword)) => qualifier(keyword).is_some(),
            Some(Word::Type) => true,
            Some(Word::Reserved(reserved)) => matches!(reserved.reading, Reading::Type(_)),
            Some(Word::Plain) => self.peek_at(2).kind == TokenKind::Name,
            None => false,
        }
    }

    fn add_qualifier(&mut self, qualifiers: &mut Qualifiers, qualifier: Qualifier, token: Token) {
        match qualifiers.find(qualifier) {
            None => qualifiers.list.push((qualifier, token.span)),
            Some(first) => {
                let message = format!("qualifier `{}` twice", self.text(token));
                self.diagnostics.push(
                    Diagnostic::new(codes::DUPLICATE_QUALIFIER, message)
                        .at(token.span, "again")
                        .label(first, "first here")
                        .suggest("leave it out", token.span, ""),
                );
            }
        }
    }

    /// Parses `precision highp float;`, which has no effect.
    pub(super) fn parse_precision(&mut self) -> Parse<()> {
        self.bump();
        if !matches!(self.peek_keyword(), Some(Keyword::Lowp | Keyword::Mediump | Keyword::Highp)) {
            return Err(self.unexpected("`lowp`, `mediump` or `highp`"));
        }
        self.bump();
        let has_precision = match self.word_of(self.peek()) {
            Some(Word::Type) => matches!(self.text(self.peek()), "float" | "int"),
            // The types of samplers.
            Some(Word::Reserved(reserved)) => matches!(reserved.reading, Reading::Type(_)),
            _ => false,
        };
        if !has_precision {
            return Err(self.unexpected("`float` or `int`"));
        }
        self.bump();
        self.expect_semicolon("the precision statement")
    }

    /// Skips the `;` of a declaration that declares nothing after its type, which GLSL allows: `float;`.
    pub(super) fn declares_nothing(&mut self, ty: &TypeName) -> bool {
        let has_sizes = ty.sizes.iter().all(Option::is_some);
        has_sizes && self.maybe(Punctuator::Semicolon).is_some()
    }

    /// Skips the `,` before the first name of a declaration, which GLSL's grammar allows: `float, a;`.
    pub(super) fn skip_empty_declarator(&mut self, ty: &TypeName) {
        if ty.sizes.iter().all(Option::is_some) {
            let _comma = self.maybe(Punctuator::Comma);
        }
    }

    /// True if the next token can name a type.
    pub(super) fn at_type_name(&self) -> bool {
        match self.word_of(self.peek()) {
            Some(Word::Plain | Word::Type) => true,
            Some(Word::Reserved(reserved)) => matches!(reserved.reading, Reading::Type(_)),
            Some(Word::Keyword(_)) | None => false,
        }
    }

    /// Parses a type with its array sizes. `what` names the declaration that the type belongs to,
    /// for messages.
    pub(super) fn parse_type(&mut self, what: &str) -> Parse<TypeName> {
        if !self.at_type_name() {
            return Err(self.unexpected(&format!("the type of {what}")));
        }
        let token = self.bump();
        let token = self.without_scopes(token);
        let name = self.type_identifier(token);
        let name = self.parse_qualified(name)?;
        self.refuse_type_arguments(&name);
        let sizes = self.parse_sizes()?;
        let span = token.span.to(self.previous_span());
        self.refuse_indirection();
        Ok(TypeName { name, sizes, span })
    }

    fn type_identifier(&mut self, token: Token) -> Identifier {
        if let Some(Word::Reserved(reserved)) = self.word_of(token)
            && let Reading::Type(instead) = reserved.reading
        {
            self.complain_reserved(token, reserved);
            // `long int` and `unsigned int` are one type.
            if self.peek().kind == TokenKind::Name && self.text(self.peek()) == "int" {
                self.bump();
            }
            return Identifier { name: instead.to_string(), span: token.span };
        }
        self.identifier(token)
    }

    /// Parses the sizes after a declarator's name; they are the outer dimensions.
    pub(super) fn parse_declarator_sizes(&mut self, ty: &mut TypeName) -> Parse<()> {
        let mut sizes = self.parse_sizes()?;
        if !sizes.is_empty() {
            ty.span = ty.span.to(self.previous_span());
            sizes.append(&mut ty.sizes);
            ty.sizes = sizes;
        }
        Ok(())
    }

    fn parse_sizes(&mut self) -> Parse<Vec<Option<Expression>>> {
        let mut sizes = Vec::new();
        while self.at(Punctuator::LeftBracket) {
            self.check_depth(sizes.len() + 1)?;
            let open = self.bump();
            if self.maybe(Punctuator::RightBracket).is_some() {
                sizes.push(None);
                continue;
            }
            sizes.push(Some(self.parse_expression()?));
            self.expect_closing(open, Punctuator::RightBracket)?;
        }
        Ok(sizes)
    }
}

/// The keywords that are qualifiers, for tools such as editors. `texture` is a qualifier, too, but no keyword, and
/// those of precision have no effect.
pub fn qualifiers() -> impl Iterator<Item = &'static str> {
    Keyword::ALL.iter().filter(|(keyword, _)| qualifier(*keyword).is_some()).map(|(_, text)| *text)
}

fn qualifier(keyword: Keyword) -> Option<Qualifier> {
    Some(match keyword {
        Keyword::Attribute => Qualifier::Attribute,
        Keyword::Public => Qualifier::Public,
        Keyword::Private => Qualifier::Private,
        Keyword::Scratch => Qualifier::Scratch,
        Keyword::Const => Qualifier::Const,
        Keyword::Uniform => Qualifier::Uniform,
        Keyword::Precise => Qualifier::Precise,
        Keyword::Invariant => Qualifier::Invariant,
        Keyword::In => Qualifier::In,
        Keyword::Out => Qualifier::Out,
        Keyword::Output => Qualifier::Output,
        Keyword::InOut => Qualifier::InOut,
        Keyword::Break
        | Keyword::Case
        | Keyword::Class
        | Keyword::Continue
        | Keyword::Default
        | Keyword::Do
        | Keyword::Else
        | Keyword::Enum
        | Keyword::False
        | Keyword::For
        | Keyword::Highp
        | Keyword::If
        | Keyword::Illuminance
        | Keyword::Lowp
        | Keyword::Mediump
        | Keyword::Precision
        | Keyword::Return
        | Keyword::Struct
        | Keyword::Switch
        | Keyword::True
        | Keyword::While => return None,
    })
}
