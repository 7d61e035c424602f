//! The conditions of `#if` and `#elif`: GLSL's constant expressions over integers.

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};

use super::Preprocessor;
use super::expansion::Input;
use crate::message::shorten;
use crate::number::{Number, parse_number};
use crate::token::{Punctuator, Token, TokenKind};

/// The maximum nesting of parentheses and unary operators.
const MAX_DEPTH: usize = 128;

impl Preprocessor<'_> {
    /// Evaluates the condition after `directive`; `None` if it is malformed.
    pub(super) fn condition_holds(&mut self, directive: Token, line: &[Token]) -> Option<bool> {
        self.in_condition = true;
        let tokens = self.expand_list(line.to_vec(), 0);
        self.in_condition = false;
        // The error of a `defined` is reported.
        if std::mem::take(&mut self.malformed_defined) {
            return None;
        }
        let end = line.last().unwrap_or(&directive).span.after();
        let value = self.evaluate(&tokens, end).and_then(|(value, rest)| match rest {
            [] => Ok(value),
            [extra, ..] => Err((extra.span, "expected an operator".to_string())),
        });
        match value {
            Ok(value) => Some(value != 0),
            Err((place, reason)) => {
                if !self.exhausted {
                    let message = format!("malformed condition of `#{}`", self.text(directive));
                    self.report(
                        Diagnostic::new(codes::INVALID_CONDITION, message).at(place, reason),
                    );
                }
                None
            }
        }
    }

    /// Evaluates the expression at the beginning of `tokens`, whose macros are expanded, and returns
    /// its value and the tokens after it. `end` is the place after the last token.
    pub(super) fn evaluate<'t>(
        &self,
        tokens: &'t [Token],
        end: Span,
    ) -> Result<(i64, &'t [Token]), (Span, String)> {
        let mut evaluator = Evaluator { this: self, tokens, position: 0, depth: 0, end };
        let value = evaluator.parse_expression(0, true)?;
        Ok((value, &tokens[evaluator.position..]))
    }

    /// Returns 1 or 0 for `defined`, whose operand `NAME` or `(NAME)` is read from `input` without
    /// expanding macros. Both may come from macros.
    pub(super) fn resolve_defined(&mut self, defined: Token, input: &mut Input) -> Token {
        let mut name = self.next_raw(input);
        let in_parentheses = name.is_some_and(|token| token.is(Punctuator::LeftParenthesis));
        if in_parentheses {
            name = self.next_raw(input);
        }
        let is_name =
            |token: &Token| token.kind == TokenKind::Name && token.spelling != self.names.defined;
        let name = name.filter(is_name);
        let is_closed = !in_parentheses
            || self.next_raw(input).is_some_and(|token| token.is(Punctuator::RightParenthesis));
        let value = match name.filter(|_| is_closed) {
            Some(name) if self.is_defined(name.spelling) => "1",
            Some(_) => "0",
            None => {
                let message = "`defined` without a name";
                self.report(
                    Diagnostic::new(codes::INVALID_CONDITION, message)
                        .at(defined.span, "expected `defined NAME` or `defined(NAME)`"),
                );
                self.malformed_defined = true;
                "0"
            }
        };
        let spelling = self.symbols.intern(value);
        Token { kind: TokenKind::Number, spelling, ..name.unwrap_or(defined) }
    }
}

type Evaluated = Result<i64, (Span, String)>;

struct Evaluator<'a, 'p> {
    this: &'a Preprocessor<'p>,
    tokens: &'a [Token],
    position: usize,
    depth: usize,
    end: Span,
}

impl Evaluator<'_, '_> {
    /// Parses operators that bind at least as tightly as `binding`. Unless `live`, the operands are
    /// not evaluated, as after `0 &&`; they may contain unknown names and divide by zero.
    fn parse_expression(&mut self, binding: u8, live: bool) -> Evaluated {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            let place = self.tokens.get(self.position).map_or(self.end, |token| token.span);
            return Err((place, "nested too deeply".to_string()));
        }
        let mut left = self.parse_operand(live)?;
        while let Some((token, operator, operator_binding)) = self.peek_operator() {
            if operator_binding < binding {
                break;
            }
            self.position += 1;
            let right_live = match operator {
                Punctuator::AndAnd => live && left != 0,
                Punctuator::OrOr => live && left == 0,
                _ => live,
            };
            let right = self.parse_expression(operator_binding + 1, right_live)?;
            left = apply(operator, left, right)
                .or_else(|| (!live).then_some(0))
                .ok_or_else(|| (token.span, "divides by zero".to_string()))?;
        }
        self.depth -= 1;
        Ok(left)
    }

    fn parse_operand(&mut self, live: bool) -> Evaluated {
        let Some(token) = self.tokens.get(self.position).copied() else {
            return Err((self.end, "expected a condition".to_string()));
        };
        self.position += 1;
        const UNARY: u8 = 100;
        match token.kind {
            TokenKind::Number => self.integer(token),
            TokenKind::Name if !live => Ok(0),
            TokenKind::Name => {
                let name = shorten(self.this.text(token));
                Err((token.span, format!("`{name}` is not defined; test it with `defined` first")))
            }
            TokenKind::Punctuator(Punctuator::LeftParenthesis) => {
                let value = self.parse_expression(0, live)?;
                match self.tokens.get(self.position) {
                    Some(close) if close.is(Punctuator::RightParenthesis) => {
                        self.position += 1;
                        Ok(value)
                    }
                    _ => Err((token.span, "this `(` has no `)`".to_string())),
                }
            }
            TokenKind::Punctuator(Punctuator::Minus) => {
                Ok(self.parse_expression(UNARY, live)?.wrapping_neg())
            }
            TokenKind::Punctuator(Punctuator::Plus) => self.parse_expression(UNARY, live),
            TokenKind::Punctuator(Punctuator::Tilde) => Ok(!self.parse_expression(UNARY, live)?),
            TokenKind::Punctuator(Punctuator::Bang) => {
                Ok(i64::from(self.parse_expression(UNARY, live)? == 0))
            }
            TokenKind::Text | TokenKind::Punctuator(_) | TokenKind::Invalid(_) | TokenKind::End => {
                Err((token.span, "expected an integer".to_string()))
            }
        }
    }

    fn integer(&self, token: Token) -> Evaluated {
        match parse_number(self.this.text(token)) {
            Ok(Number::Int(value)) => Ok(i64::from(value as u32)),
            Ok(Number::Uint(value)) => Ok(i64::from(value)),
            Ok(Number::Float(_)) => Err((token.span, "conditions are integers".to_string())),
            Err(_) => Err((token.span, "not an integer".to_string())),
        }
    }

    fn peek_operator(&self) -> Option<(Token, Punctuator, u8)> {
        let token = self.tokens.get(self.position)?;
        let TokenKind::Punctuator(operator) = token.kind else { return None };
        Some((*token, operator, binding(operator)?))
    }
}

fn binding(operator: Punctuator) -> Option<u8> {
    Some(match operator {
        Punctuator::OrOr => 1,
        Punctuator::AndAnd => 2,
        Punctuator::Bar => 3,
        Punctuator::Caret => 4,
        Punctuator::Ampersand => 5,
        Punctuator::EqualEqual | Punctuator::NotEqual => 6,
        Punctuator::Less
        | Punctuator::Greater
        | Punctuator::LessEqual
        | Punctuator::GreaterEqual => 7,
        Punctuator::ShiftLeft | Punctuator::ShiftRight => 8,
        Punctuator::Plus | Punctuator::Minus => 9,
        Punctuator::Star | Punctuator::Slash | Punctuator::Percent => 10,
        _ => return None,
    })
}

/// The value of `left operator right`; `None` for a division by zero.
fn apply(operator: Punctuator, left: i64, right: i64) -> Option<i64> {
    let truth = i64::from;
    Some(match operator {
        Punctuator::OrOr => truth(left != 0 || right != 0),
        Punctuator::AndAnd => truth(left != 0 && right != 0),
        Punctuator::Bar => left | right,
        Punctuator::Caret => left ^ right,
        Punctuator::Ampersand => left & right,
        Punctuator::EqualEqual => truth(left == right),
        Punctuator::NotEqual => truth(left != right),
        Punctuator::Less => truth(left < right),
        Punctuator::Greater => truth(left > right),
        Punctuator::LessEqual => truth(left <= right),
        Punctuator::GreaterEqual => truth(left >= right),
        Punctuator::ShiftLeft => left.wrapping_shl(right as u32),
        Punctuator::ShiftRight => left.wrapping_shr(right as u32),
        Punctuator::Plus => left.wrapping_add(right),
        Punctuator::Minus => left.wrapping_sub(right),
        Punctuator::Star => left.wrapping_mul(right),
        Punctuator::Slash => (right != 0).then(|| left.wrapping_div(right))?,
        Punctuator::Percent => (right != 0).then(|| left.wrapping_rem(right))?,
        _ => return None,
    })
}
