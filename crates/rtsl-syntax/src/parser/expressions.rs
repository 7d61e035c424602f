//! Expressions, by operator precedence.

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};

use super::operators::{self, ASSIGNMENT, Binding, CONDITIONAL, SEQUENCE, UNARY};
use super::{Parse, Parser};
use crate::ast::{Expression, ExpressionKind};
use crate::message::shorten;
use crate::number::{Number, NumberError, parse_number};
use crate::token::{Punctuator, Token, TokenKind};
use crate::word::{Keyword, Reading, Word};

/// An expression that is being built.
struct Built {
    expression: Expression,
    /// The height of the tree; a chain of binary operators counts as one level.
    height: usize,
    /// The span, including enclosing parentheses.
    extent: Span,
}

impl Built {
    fn leaf(kind: ExpressionKind, span: Span) -> Self {
        Built { expression: Expression { kind, span }, height: 1, extent: span }
    }

    fn boxed(self) -> Box<Expression> {
        Box::new(self.expression)
    }
}

impl Parser<'_> {
    /// Parses an expression, including the comma operator.
    pub(super) fn parse_expression(&mut self) -> Parse<Expression> {
        Ok(self.parse_binding(SEQUENCE)?.expression)
    }

    /// Parses an expression that a comma ends.
    pub(super) fn parse_argument(&mut self) -> Parse<Expression> {
        Ok(self.parse_binding(ASSIGNMENT)?.expression)
    }

    /// Parses operators that bind at least as tightly as `binding`.
    fn parse_binding(&mut self, binding: Binding) -> Parse<Built> {
        self.nested(|this| this.parse_chain(binding))
    }

    /// Like `parse_binding`, without counting a level. Used for the right operand of a link: its
    /// operators bind more tightly, so the recursion is no deeper than the number of precedences.
    fn parse_chain(&mut self, binding: Binding) -> Parse<Built> {
        let mut left = self.parse_prefix()?;
        while let TokenKind::Punctuator(punctuator) = self.peek().kind {
            match self.parse_infix(left, punctuator, binding)? {
                Infix::Joined(joined) => left = joined,
                Infix::Done(done) => return Ok(done),
            }
        }
        Ok(left)
    }

    /// Joins `left` with the operand that follows, if `punctuator` is an operator that binds
    /// tightly enough.
    fn parse_infix(
        &mut self,
        left: Built,
        punctuator: Punctuator,
        binding: Binding,
    ) -> Parse<Infix> {
        if let Some((operator, own)) = operators::binary(punctuator) {
            if own < binding {
                return Ok(Infix::Done(left));
            }
            self.bump();
            let right = self.parse_chain(own + 1)?;
            return self
                .link(left, right, |left, right| ExpressionKind::Binary(operator, left, right));
        }
        if let Some(operator) = operators::assignment(punctuator) {
            if ASSIGNMENT < binding {
                return Ok(Infix::Done(left));
            }
            self.bump();
            let right = self.parse_binding(ASSIGNMENT)?;
            return self.join(left, right, |target, value| ExpressionKind::Assign {
                target,
                operator,
                value,
            });
        }
        match punctuator {
            Punctuator::Question if binding <= CONDITIONAL => self.parse_conditional(left),
            Punctuator::Comma if binding <= SEQUENCE => {
                self.bump();
                let right = self.parse_chain(ASSIGNMENT)?;
                self.link(left, right, ExpressionKind::Sequence)
            }
            _ => Ok(Infix::Done(left)),
        }
    }

    fn parse_conditional(&mut self, condition: Built) -> Parse<Infix> {
        self.bump();
        let then = self.parse_binding(SEQUENCE)?;
        self.expect(Punctuator::Colon)?;
        let otherwise = self.parse_binding(ASSIGNMENT)?;
        let height = then.height.max(condition.height);
        let then = then.boxed();
        let condition = Built { height, ..condition };
        self.join(condition, otherwise, |condition, otherwise| {
            ExpressionKind::Conditional(condition, then, otherwise)
        })
    }

    /// Adds a link to a chain, whose length does not count as depth.
    fn link(
        &mut self,
        left: Built,
        right: Built,
        kind: impl FnOnce(Box<Expression>, Box<Expression>) -> ExpressionKind,
    ) -> Parse<Infix> {
        let own = usize::from(left.expression.chain_begins());
        let height = (left.height + own).max(right.height + 1);
        self.join_to(height, left, right, kind)
    }

    fn join(
        &mut self,
        left: Built,
        right: Built,
        kind: impl FnOnce(Box<Expression>, Box<Expression>) -> ExpressionKind,
    ) -> Parse<Infix> {
        let height = 1 + left.height.max(right.height);
        self.join_to(height, left, right, kind)
    }

    fn join_to(
        &mut self,
        height: usize,
        left: Built,
        right: Built,
        kind: impl FnOnce(Box<Expression>, Box<Expression>) -> ExpressionKind,
    ) -> Parse<Infix> {
        let extent = left.extent.to(right.extent);
        self.check_depth(height)?;
        let expression = Expression { kind: kind(left.boxed(), right.boxed()), span: extent };
        Ok(Infix::Joined(Built { expression, height, extent }))
    }

    fn parse_prefix(&mut self) -> Parse<Built> {
        let token = self.peek();
        let TokenKind::Punctuator(punctuator) = token.kind else { return self.parse_postfix() };
        let step = operators::step(punctuator);
        let unary = operators::unary(punctuator);
        if step.is_none() && unary.is_none() {
            return self.parse_postfix();
        }
        self.bump();
        let operand = self.parse_binding(UNARY)?;
        let extent = token.span.to(operand.extent);
        let height = operand.height + 1;
        let operand = operand.boxed();
        let kind = match (unary, step) {
            (Some(operator), _) => ExpressionKind::Unary(operator, operand),
            (None, Some(by)) => ExpressionKind::Step { target: operand, by, prefix: true },
            (None, None) => ExpressionKind::Error,
        };
        Ok(Built { expression: Expression { kind, span: extent }, height, extent })
    }

    fn parse_postfix(&mut self) -> Parse<Built> {
        let mut built = self.parse_primary()?;
        while let TokenKind::Punctuator(punctuator) = self.peek().kind {
            built = match punctuator {
                Punctuator::LeftBracket => self.parse_index(built)?,
                Punctuator::LeftParenthesis => self.parse_call(built)?,
                Punctuator::Dot => self.parse_member(built)?,
                Punctuator::Increment | Punctuator::Decrement => self.parse_step(built, punctuator),
                _ => return Ok(built),
            };
            self.check_depth(built.height)?;
        }
        Ok(built)
    }

    fn parse_index(&mut self, base: Built) -> Parse<Built> {
        let open = self.bump();
        let mut height = base.height;
        let index = if self.at(Punctuator::RightBracket) {
            None
        } else {
            let index = self.parse_binding(SEQUENCE)?;
            height = height.max(index.height);
            Some(index.boxed())
        };
        let close = self.expect_closing(open, Punctuator::RightBracket)?;
        let extent = base.extent.to(close.span);
        let kind = ExpressionKind::Index(base.boxed(), index);
        Ok(Built { expression: Expression { kind, span: extent }, height: height + 1, extent })
    }

    fn parse_call(&mut self, callee: Built) -> Parse<Built> {
        let (arguments, arguments_height) = self.parse_arguments()?;
        let extent = callee.extent.to(self.previous_span());
        let height = callee.height.max(arguments_height) + 1;
        let kind = ExpressionKind::Call { callee: callee.boxed(), arguments };
        Ok(Built { expression: Expression { kind, span: extent }, height, extent })
    }

    fn parse_member(&mut self, base: Built) -> Parse<Built> {
        self.bump();
        if self.peek().kind != TokenKind::Name {
            return Err(self.unexpected("a field, components or a method"));
        }
        let name = self.bump();
        let name = self.identifier(name);
        if self.at(Punctuator::LeftParenthesis) {
            let (arguments, arguments_height) = self.parse_arguments()?;
            let extent = base.extent.to(self.previous_span());
            let height = base.height.max(arguments_height) + 1;
            let kind =
                ExpressionKind::MethodCall { receiver: base.boxed(), method: name, arguments };
            return Ok(Built { expression: Expression { kind, span: extent }, height, extent });
        }
        let extent = base.extent.to(name.span);
        let height = base.height + 1;
        let kind = ExpressionKind::Member(base.boxed(), name);
        Ok(Built { expression: Expression { kind, span: extent }, height, extent })
    }

    fn parse_step(&mut self, target: Built, punctuator: Punctuator) -> Built {
        let operator = self.bump();
        let extent = target.extent.to(operator.span);
        let height = target.height + 1;
        let kind = match operators::step(punctuator) {
            Some(by) => ExpressionKind::Step { target: target.boxed(), by, prefix: false },
            None => ExpressionKind::Error,
        };
        Built { expression: Expression { kind, span: extent }, height, extent }
    }

    /// Parses `( ... )`. Returns the arguments and the greatest of their heights.
    fn parse_arguments(&mut self) -> Parse<(Vec<Expression>, usize)> {
        let open = self.bump();
        let mut arguments = Vec::new();
        let mut height = 0;
        let only_void = self.peek().kind == TokenKind::Name
            && self.text(self.peek()) == "void"
            && self.peek_at(1).is(Punctuator::RightParenthesis);
        if only_void {
            self.bump();
        }
        if self.maybe(Punctuator::RightParenthesis).is_some() {
            return Ok((arguments, height));
        }
        loop {
            let argument = self.parse_binding(ASSIGNMENT)?;
            height = height.max(argument.height);
            arguments.push(argument.expression);
            if self.maybe(Punctuator::Comma).is_none() {
                break;
            }
        }
        self.expect_closing(open, Punctuator::RightParenthesis)?;
        Ok((arguments, height))
    }

    /// Parses arguments, or none if no parenthesis follows.
    pub(super) fn parse_optional_arguments(&mut self) -> Parse<Vec<Expression>> {
        if self.at(Punctuator::LeftParenthesis) {
            Ok(self.parse_arguments()?.0)
        } else {
            Ok(Vec::new())
        }
    }

    fn parse_primary(&mut self) -> Parse<Built> {
        let token = self.peek();
        match token.kind {
            TokenKind::Number => {
                self.bump();
                let kind = self.number(token);
                Ok(Built::leaf(kind, token.span))
            }
            TokenKind::Name => self.parse_name(token),
            TokenKind::Punctuator(Punctuator::LeftParenthesis) => {
                self.bump();
                let inner = self.parse_binding(SEQUENCE)?;
                let close = self.expect_closing(token, Punctuator::RightParenthesis)?;
                Ok(Built { extent: token.span.to(close.span), ..inner })
            }
            TokenKind::Text | TokenKind::Punctuator(_) | TokenKind::Invalid(_) | TokenKind::End => {
                Err(self.unexpected("an expression"))
            }
        }
    }

    fn parse_name(&mut self, token: Token) -> Parse<Built> {
        let name = match self.symbols.word(token.spelling) {
            Word::Keyword(Keyword::True) => {
                self.bump();
                return Ok(Built::leaf(ExpressionKind::Bool(true), token.span));
            }
            Word::Keyword(Keyword::False) => {
                self.bump();
                return Ok(Built::leaf(ExpressionKind::Bool(false), token.span));
            }
            Word::Keyword(_) => return Err(self.unexpected("an expression")),
            Word::Plain | Word::Type => self.text(token),
            Word::Reserved(reserved) => {
                self.complain_reserved(token, reserved);
                match reserved.reading {
                    Reading::Type(instead) => instead,
                    Reading::Qualifier | Reading::Layout | Reading::Statement | Reading::Name => {
                        self.bump();
                        return Ok(Built::leaf(ExpressionKind::Error, token.span));
                    }
                }
            }
        };
        self.bump();
        Ok(Built::leaf(ExpressionKind::Name(name.to_string()), token.span))
    }

    fn number(&mut self, token: Token) -> ExpressionKind {
        match parse_number(self.text(token)) {
            Ok(Number::Int(value)) => ExpressionKind::Int(value),
            Ok(Number::Uint(value)) => ExpressionKind::Uint(value),
            Ok(Number::Float(value)) => ExpressionKind::Float(value),
            Err(error) => {
                let diagnostic = self.number_diagnostic(token, error);
                self.diagnostics.push(diagnostic);
                ExpressionKind::Error
            }
        }
    }

    fn number_diagnostic(&self, token: Token, error: NumberError) -> Diagnostic {
        let text = self.text(token);
        let shown = shorten(text);
        let invalid = |message: String, label: &str| {
            Diagnostic::new(codes::INVALID_NUMBER, message).at(token.span, label)
        };
        let too_large = |label: &str| {
            Diagnostic::new(codes::NUMBER_RANGE, format!("number `{shown}` is too large"))
                .at(token.span, label)
        };
        match error {
            NumberError::Suffix(at) => {
                let suffix = shorten(&text[at..]);
                invalid(format!("number with the unknown suffix `{suffix}`"), "not a number").note(
                    "numbers have the suffix `u`, `f` or none; names do not begin with a digit",
                )
            }
            NumberError::Digit(digit) => {
                invalid(format!("digit `{digit}` in an octal number"), "not a number")
                    .note("as in C, whole numbers that begin with 0 are octal")
            }
            NumberError::Malformed => {
                invalid(format!("`{shown}` is not a number"), "missing digits or too many points")
            }
            NumberError::WholeFloat(at) => {
                let written = format!("{}.0{}", &text[..at], &text[at..]);
                invalid(
                    format!("`{shown}` is a whole number with the suffix of floats"),
                    "not a number",
                )
                .note("as in GLSL, a float has a point or an exponent")
                .suggest("add a point", token.span, &written)
            }
            NumberError::Double => {
                invalid(format!("`{shown}` has double precision"), "RTSL has 32-bit floats only")
                    .help("leave the suffix out")
            }
            NumberError::IntegerRange => {
                too_large("needs more than 32 bits").help("write it as a float, with a point")
            }
            NumberError::FloatRange => too_large("beyond the largest float, 3.4028235e38"),
        }
    }
}

/// The result of parsing the operator after an operand.
enum Infix {
    Joined(Built),
    /// The operator binds less tightly and is left to the caller.
    Done(Built),
}
