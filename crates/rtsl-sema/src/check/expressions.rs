//! Expressions other than places, operators and calls, which have files for themselves.

use rtsl_ir::{Constant, Scalar, evaluate};
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast::{self, ExpressionKind as Ast};

use super::Checker;
use super::access::Access;
use super::types::{BOOL, FLOAT, INT, UINT, component_scalar, converts, holds_reference};
use crate::hir::{Expression, ExpressionKind, Type};

impl Checker<'_> {
    /// Checks an expression whose value is used.
    pub(super) fn check_expression(&mut self, expression: &ast::Expression) -> Expression {
        let span = expression.span;
        match &expression.kind {
            Ast::Error => error_expression(span),
            Ast::Int(value) => constant_scalar(Constant::I32(*value), INT, span),
            Ast::Uint(value) => constant_scalar(Constant::U32(*value), UINT, span),
            Ast::Float(value) => constant_scalar(Constant::F32(*value), FLOAT, span),
            Ast::Bool(value) => constant_scalar(Constant::Bool(*value), BOOL, span),
            Ast::Name(_) | Ast::Index(..) | Ast::Member(..) => {
                self.check_value_of_place(expression)
            }
            Ast::Sequence(..) | Ast::Binary(..) => self.check_chain(expression),
            Ast::Unary(operator, operand) => self.check_unary(*operator, operand, span),
            Ast::Step { target, by, prefix } => self.check_step(target, *by, *prefix, span),
            Ast::Assign { target, operator, value } => {
                self.check_assign(target, *operator, value, span)
            }
            Ast::Conditional(condition, then, otherwise) => {
                self.check_conditional(condition, then, otherwise, span)
            }
            Ast::Call { callee, arguments } => self.check_call(callee, arguments, span),
            Ast::MethodCall { receiver, method, arguments } => {
                self.check_method_call(receiver, method, arguments, span)
            }
        }
    }

    fn check_value_of_place(&mut self, expression: &ast::Expression) -> Expression {
        let place = self.check_place(expression);
        self.note_access(&place, Access::Read);
        self.require_value(place)
    }

    /// Reports references and buffers, which are not values.
    pub(super) fn require_value(&mut self, expression: Expression) -> Expression {
        let (code, message, help) = match &expression.ty {
            Type::Array(element, _) | Type::Buffer(element) if holds_reference(element) => (
                codes::REFERENCE_AS_VALUE,
                "an array of references is not a value",
                "call methods of its elements",
            ),
            Type::Buffer(_) => (
                codes::BUFFER_AS_VALUE,
                "a buffer as a whole is not a value",
                "use its elements, `[i]`, and its `.length()`",
            ),
            Type::Reference(_) => (
                codes::REFERENCE_AS_VALUE,
                "a reference is not a value",
                "call its methods, or test it with `isSet()`",
            ),
            _ => return expression,
        };
        let span = expression.span;
        self.report(Diagnostic::new(code, message).at(span, "").help(help));
        error_expression(span)
    }

    /// Checks a chain such as `a + b * c, d`, which may be as long as the text.
    fn check_chain(&mut self, expression: &ast::Expression) -> Expression {
        let (first, links) = expression.chain();
        let mut left = self.check_expression(first);
        for link in links {
            left = match &link.kind {
                Ast::Binary(operator, _, right) => {
                    self.check_binary(*operator, left, right, link.span)
                }
                Ast::Sequence(_, right) => {
                    self.check_effect(last_of_sequence(&left));
                    let right = self.check_expression(right);
                    let ty = right.ty.clone();
                    let kind = ExpressionKind::Sequence(Box::new(left), Box::new(right));
                    Expression { kind, ty, span: link.span }
                }
                _ => left,
            };
        }
        left
    }

    fn check_conditional(
        &mut self,
        condition: &ast::Expression,
        then: &ast::Expression,
        otherwise: &ast::Expression,
        span: Span,
    ) -> Expression {
        let condition = Box::new(self.check_condition(condition));
        let then = Box::new(self.conditionally(|checker| checker.check_expression(then)));
        let otherwise = Box::new(self.conditionally(|checker| checker.check_expression(otherwise)));
        let (then, otherwise) = if converts(&then.ty, &otherwise.ty) {
            let ty = otherwise.ty.clone();
            (Box::new(convert(*then, &ty)), otherwise)
        } else if converts(&otherwise.ty, &then.ty) {
            let ty = then.ty.clone();
            (then, Box::new(convert(*otherwise, &ty)))
        } else {
            (then, otherwise)
        };
        if then.ty == Type::Error || otherwise.ty == Type::Error {
            return error_expression(span);
        }
        // Two calls without a result are a choice between their effects.
        if then.ty != otherwise.ty {
            self.report_branches(&then, &otherwise, span);
            return error_expression(span);
        }
        let ty = then.ty.clone();
        Expression { kind: ExpressionKind::Conditional(condition, then, otherwise), ty, span }
    }

    fn report_branches(&mut self, then: &Expression, otherwise: &Expression, span: Span) {
        let (first, second) = (self.show(&then.ty), self.show(&otherwise.ty));
        self.report(
            Diagnostic::new(codes::MISMATCHED_TYPES, "the two sides of `?:` have no common type")
                .at(span, "")
                .label(then.span, format!("this is `{first}`"))
                .label(otherwise.span, format!("this is `{second}`")),
        );
    }

    /// Checks an expression and converts it to type `ty` if GLSL converts it implicitly; reports a
    /// mismatch otherwise.
    pub(super) fn expect_type(
        &mut self,
        expression: Expression,
        ty: &Type,
        what: &str,
    ) -> Expression {
        if expression.ty == *ty || expression.ty == Type::Error || *ty == Type::Error {
            return expression;
        }
        if converts(&expression.ty, ty) {
            return convert(expression, ty);
        }
        let expected = format!("`{}`", self.show(ty));
        self.report_mismatch_to(what, &expected, &expression, Some(ty));
        error_expression(expression.span)
    }

    /// Reports that `what` must be `expected` (quotes included).
    pub(super) fn report_mismatch(&mut self, what: &str, expected: &str, found: &Expression) {
        self.report_mismatch_to(what, expected, found, None);
    }

    fn report_mismatch_to(
        &mut self,
        what: &str,
        expected: &str,
        found: &Expression,
        to: Option<&Type>,
    ) {
        let shown = self.show(&found.ty);
        let mut diagnostic = Diagnostic::new(
            codes::MISMATCHED_TYPES,
            format!("{what} must be {expected}, but this is `{shown}`"),
        )
        .at(found.span, format!("expected {expected}, found `{shown}`"));
        if let Some(help) = to.and_then(|to| self.conversion_help(&found.ty, to)) {
            diagnostic = diagnostic.help(help);
        }
        if to.is_some() && expected == format!("`{shown}`") {
            diagnostic = diagnostic.note("two structs have this name, one in an inner scope");
        }
        self.report(diagnostic);
    }

    /// The explicit conversion from one type to the other that the author could write.
    fn conversion_help(&self, from: &Type, to: &Type) -> Option<String> {
        let vec3 = Type::Vector(Scalar::F32, 3);
        let shown = self.show(to);
        match (from, to) {
            (Type::Color, Type::Scalar(_)) => {
                Some("`luminance()` gives the brightness of a color".to_owned())
            }
            (Type::Color, to) if *to == vec3 => {
                Some("`rgb()` gives the components of a color as a `vec3`".to_owned())
            }
            (Type::Scalar(_), Type::Scalar(_) | Type::Vector(..) | Type::Color) => {
                Some(format!("convert it with `{shown}(...)`"))
            }
            (from, Type::Color) if *from == vec3 => Some("convert it with `color(...)`".to_owned()),
            (Type::Vector(_, size), Type::Vector(_, other)) if other <= size => {
                Some(format!("convert it with `{shown}(...)`"))
            }
            _ => None,
        }
    }
}

/// Returns the expression with another span.
pub(super) fn at(mut expression: Expression, span: Span) -> Expression {
    expression.span = span;
    expression
}

/// The placeholder for an erroneous expression that was reported.
pub(super) fn error_expression(span: Span) -> Expression {
    Expression { kind: ExpressionKind::Error, ty: Type::Error, span }
}

/// The placeholder for an erroneous expression whose type is known nevertheless.
pub(super) fn error_of_type(ty: Type, span: Span) -> Expression {
    Expression { kind: ExpressionKind::Error, ty, span }
}

/// A constant of one component.
pub(super) fn constant_scalar(value: Constant, ty: Type, span: Span) -> Expression {
    Expression { kind: ExpressionKind::Constant([value].into()), ty, span }
}

/// Converts `expression` to `ty`; constants are folded.
pub(super) fn convert(expression: Expression, ty: &Type) -> Expression {
    if expression.ty == *ty {
        return expression;
    }
    let span = expression.span;
    if let (ExpressionKind::Constant(values), Some(from), Some(to)) =
        (&expression.kind, component_scalar(&expression.ty), component_scalar(ty))
    {
        let convert = evaluate::convert(from, to);
        let values = values.iter().map(|value| Constant::from_bits(to, convert(value.bits())));
        return Expression {
            kind: ExpressionKind::Constant(values.collect()),
            ty: ty.clone(),
            span,
        };
    }
    Expression { kind: ExpressionKind::Convert(Box::new(expression)), ty: ty.clone(), span }
}

/// The expression whose value a sequence has. Those before it were judged when the sequence was
/// checked.
fn last_of_sequence(expression: &Expression) -> &Expression {
    match &expression.kind {
        ExpressionKind::Sequence(_, last) => last,
        _ => expression,
    }
}
