//! Constant expressions, in the contexts that require one.

use std::sync::Arc;

use rtsl_ir::{Constant, Scalar};
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast;

use super::Checker;
use super::evaluated::Stop;
use super::evaluator::Evaluator;
use crate::hir::{Expression, ExpressionKind, Type};

impl Checker<'_> {
    /// Evaluates an expression that must be constant, and reports why if it is not. `what` names
    /// the context: "an array size".
    pub(super) fn evaluate_constant(
        &mut self,
        expression: &Expression,
        what: &str,
    ) -> Option<Arc<[Constant]>> {
        if expression.ty == Type::Error {
            return None;
        }
        if let ExpressionKind::Constant(values) = &expression.kind {
            return Some(Arc::clone(values));
        }
        match self.evaluate(expression, true) {
            Ok(values) => Some(values.into()),
            Err(stop) => {
                self.report_not_constant(stop, what);
                None
            }
        }
    }

    /// Evaluates an expression if all its leaves are constant. It may call built-in functions, and
    /// through them the prelude's, but none of the unit's: those may still turn out to be
    /// recursive.
    pub(super) fn evaluate(
        &mut self,
        expression: &Expression,
        calls: bool,
    ) -> Result<Vec<Constant>, Stop> {
        let evaluator = self.evaluator(self.evaluation_fuel);
        let evaluator = if calls { evaluator } else { evaluator.without_calls() };
        let (value, spent) = evaluator.evaluate(expression);
        self.evaluation_fuel -= spent;
        value
    }

    /// Creates an evaluator for constant expressions with at most `fuel` operations.
    pub(super) fn evaluator(&self, fuel: u32) -> Evaluator<'_> {
        let callable = match self.prelude {
            Some(prelude) => prelude.module.functions.len(),
            None if self.in_prelude => self.module.functions.len(),
            None => 0,
        };
        Evaluator::new(&self.module, &self.struct_info, callable, fuel)
    }

    fn report_not_constant(&mut self, stop: Stop, what: &str) {
        let diagnostic = match stop {
            // Already reported where the expression was checked.
            Stop::Error => return,
            Stop::NotConstant(span) => Diagnostic::new(
                codes::NOT_CONSTANT,
                format!("{what} must be a constant expression"),
            )
            .at(span, "not known when the shader is compiled"),
            Stop::Sequence(span) => Diagnostic::new(
                codes::NOT_CONSTANT,
                format!("{what} must be a constant expression"),
            )
            .at(span, "the comma operator makes no constant, as in GLSL"),
            Stop::TooLong(span) => Diagnostic::new(
                codes::CONSTANT_TOO_LONG,
                format!("{what} takes too long to compute"),
            )
            .at(span, "the limit is reached in this call"),
        };
        self.report(diagnostic);
    }

    /// The value of a scalar if it is constant. Calls of functions are not evaluated.
    pub(super) fn constant_scalar(&mut self, expression: &Expression) -> Option<Constant> {
        if !matches!(expression.ty, Type::Scalar(_)) {
            return None;
        }
        if let ExpressionKind::Constant(values) = &expression.kind {
            return values.first().copied();
        }
        self.evaluate(expression, false).ok()?.first().copied()
    }

    /// Evaluates the sizes of an array; open ones are `None`. Returns `None` if one is in error.
    pub(super) fn check_sizes(
        &mut self,
        sizes: &[Option<ast::Expression>],
    ) -> Option<Vec<Option<u32>>> {
        let mut checked = Vec::new();
        for size in sizes {
            checked.push(match size {
                Some(size) => Some(self.check_size(size)?),
                None => None,
            });
        }
        Some(checked)
    }

    fn check_size(&mut self, size: &ast::Expression) -> Option<u32> {
        let checked = self.check_expression(size);
        match checked.ty {
            Type::Scalar(Scalar::I32 | Scalar::U32) => {}
            Type::Error => return None,
            _ => {
                self.report_mismatch("an array size", "`int` or `uint`", &checked);
                return None;
            }
        }
        match self.evaluate_constant(&checked, "an array size")?[0] {
            Constant::I32(value) if value < 1 => self.report_size(i64::from(value), size.span),
            Constant::U32(0) => self.report_size(0, size.span),
            value => Some(value.bits()),
        }
    }

    fn report_size(&mut self, size: i64, span: Span) -> Option<u32> {
        self.report(
            Diagnostic::new(codes::BAD_ARRAY_SIZE, format!("an array cannot have {size} elements"))
                .at(span, "expected a size of at least 1"),
        );
        None
    }
}
