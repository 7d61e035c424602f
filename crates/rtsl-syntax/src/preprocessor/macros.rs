//! `#define`, `#undef` and the built-in macros.

use std::rc::Rc;

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};

use super::Preprocessor;
use crate::message::shorten;
use crate::symbol::Symbol;
use crate::token::{LexicalError, Punctuator, Token, TokenKind};

/// A macro's definition.
#[derive(Clone)]
pub(super) struct Macro {
    /// The parameters; `None` for an object-like macro.
    pub parameters: Option<Rc<[Symbol]>>,
    pub body: Rc<[Token]>,
    /// The span of the name in the `#define`.
    pub span: Span,
}

impl Macro {
    fn equals(&self, other: &Macro) -> bool {
        let same = |(left, right): (&Token, &Token)| {
            left.kind == right.kind && left.spelling == right.spelling
        };
        let spaced = |body: &[Token]| {
            let inner = body.iter().skip(1).map(|token| token.spaced || token.starts_line);
            inner.collect::<Vec<_>>()
        };
        self.parameters == other.parameters
            && self.body.len() == other.body.len()
            && self.body.iter().zip(other.body.iter()).all(same)
            && spaced(&self.body) == spaced(&other.body)
    }
}

impl Preprocessor<'_> {
    /// Executes `#define`, given the tokens after it.
    pub(super) fn define(&mut self, directive: Token, line: &[Token]) {
        let Some(name) = self.macro_name(directive, line) else { return };
        let mut rest = &line[1..];
        let mut parameters = None;
        if let Some(first) = rest.first()
            && first.is(Punctuator::LeftParenthesis)
            && !first.spaced
        {
            let Some((list, after)) = self.macro_parameters(name, &rest[1..]) else { return };
            parameters = Some(list.into());
            rest = after;
        }
        // Any other invalid token is reported where the macro is expanded.
        let unterminated = TokenKind::Invalid(LexicalError::UnterminatedComment);
        if let Some(token) = rest.iter().find(|token| token.kind == unterminated) {
            self.report_invalid(*token, LexicalError::UnterminatedComment);
            return;
        }
        if let Some(hash) = rest.iter().find(|token| token.is(Punctuator::Hash)) {
            let message = "`#` in the text of a macro".to_string();
            self.report(
                Diagnostic::new(codes::UNEXPECTED_CHARACTER, message)
                    .at(hash.span, "no operator of GLSL")
                    .note("GLSL has no text, so macros cannot make any; `##` joins tokens"),
            );
            return;
        }
        let mut edges = rest.first().into_iter().chain(rest.last());
        if let Some(paste) = edges.find(|token| token.is(Punctuator::HashHash)) {
            let message = "`##` needs a token on either side".to_string();
            self.report(
                Diagnostic::new(codes::INVALID_PASTE, message)
                    .at(paste.span, "at the macro's edge"),
            );
            return;
        }
        let definition = Macro { parameters, body: rest.into(), span: name.span };
        if let Some(previous) = self.macros.get(&name.spelling)
            && !previous.equals(&definition)
        {
            let message =
                format!("macro `{}` is defined again, differently", shorten(self.text(name)));
            let previous = previous.span;
            self.report(
                Diagnostic::new(codes::MACRO_REDEFINED, message)
                    .at(name.span, "defined again")
                    .label(previous, "first defined here")
                    .help("`#undef` it first"),
            );
        }
        self.macros.insert(name.spelling, definition);
    }

    /// Executes `#undef`.
    pub(super) fn undefine(&mut self, directive: Token, line: &[Token]) {
        if let Some(name) = self.macro_name(directive, line) {
            self.macros.remove(&name.spelling);
            self.expect_line_end(&line[1..], directive);
        }
    }

    /// The name after `#define` or `#undef`, if it is one that programs may define.
    fn macro_name(&mut self, directive: Token, line: &[Token]) -> Option<Token> {
        let name = self.expect_name(directive, line)?;
        let text = self.text(name);
        let reserved = self.is_built_in(name.spelling)
            || name.spelling == self.names.defined
            || text.starts_with("GL_")
            || text.starts_with("rt_");
        if reserved {
            let message = format!("`{}` belongs to the language", shorten(text));
            self.report(
                Diagnostic::new(codes::RESERVED_MACRO_NAME, message)
                    .at(name.span, "can't be defined or undefined")
                    .note("names starting with `rt_` or `GL_`, and `defined`, are reserved"),
            );
            return None;
        }
        Some(name)
    }

    /// The parameters of a function-like macro, and the tokens after them.
    fn macro_parameters<'t>(
        &mut self,
        name: Token,
        line: &'t [Token],
    ) -> Option<(Vec<Symbol>, &'t [Token])> {
        let mut parameters: Vec<Symbol> = Vec::new();
        let mut seen = std::collections::HashSet::new();
        if let [first, rest @ ..] = line
            && first.is(Punctuator::RightParenthesis)
        {
            return Some((parameters, rest));
        }
        let mut rest = line;
        while let [parameter, separator, after @ ..] = rest {
            if parameter.kind != TokenKind::Name {
                return self.malformed_parameters(parameter.span, "expected a parameter's name");
            }
            if !seen.insert(parameter.spelling) {
                return self.malformed_parameters(parameter.span, "named twice");
            }
            parameters.push(parameter.spelling);
            rest = after;
            if separator.is(Punctuator::RightParenthesis) {
                return Some((parameters, rest));
            }
            if !separator.is(Punctuator::Comma) {
                return self.malformed_parameters(separator.span, "expected `,` or `)`");
            }
        }
        let place = rest.first().map_or(name.span, |token| token.span);
        self.malformed_parameters(place.after(), "expected `)`")
    }

    fn malformed_parameters<T>(&mut self, place: Span, expected: &str) -> Option<T> {
        let message = "malformed list of a macro's parameters";
        self.report(Diagnostic::new(codes::MALFORMED_DIRECTIVE, message).at(place, expected));
        None
    }

    /// True if `name` is a built-in macro such as `__LINE__`.
    pub(super) fn is_built_in(&self, name: Symbol) -> bool {
        let names = &self.names;
        [names.line, names.file, names.version, names.rtsl].contains(&name)
    }

    /// True if `#ifdef name` holds.
    pub(super) fn is_defined(&self, name: Symbol) -> bool {
        self.is_built_in(name) || self.macros.contains_key(&name)
    }

    /// The value of the built-in macro `token`, as a number token.
    pub(super) fn built_in_value(&mut self, token: Token) -> Token {
        let open = self.open.last();
        let value = if token.spelling == self.names.line {
            // In the text of a macro it is the line on which the macro's call ends.
            let line = self.map.line(token.span.file, token.span.end);
            i64::from(line) + open.map_or(0, |file| file.line_offset)
        } else if token.spelling == self.names.file {
            open.map_or(0, |file| file.number)
        } else if token.spelling == self.names.version {
            460
        } else {
            1
        };
        // GLSL has no literal for a negative number; `#line` cannot make one.
        let spelling = self.symbols.intern(&value.max(0).to_string());
        Token { kind: TokenKind::Number, spelling, ..token }
    }
}
