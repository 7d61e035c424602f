//! Static assertions.

use rtsl_ir::Constant;
use rtsl_source::{Diagnostic, diagnostic_codes as codes};
use rtsl_syntax::ast::{self, BinaryOperator};

use super::Checker;
use super::functions::Kind;
use super::types::BOOL;

impl Checker<'_> {
    /// Checks an assertion at file scope or in a class.
    pub(super) fn check_file_assertion(&mut self, assertion: &ast::Assertion) {
        self.check_outside(Kind::Constant, |checker| checker.check_assertion(assertion));
    }

    /// Checks an assertion: its condition must be constant, and true.
    pub(super) fn check_assertion(&mut self, assertion: &ast::Assertion) {
        let condition = self.check_expression(&assertion.condition);
        let condition = self.expect_type(condition, &BOOL, "the condition of an assertion");
        let value = self.evaluate_constant(&condition, "the condition of an assertion");
        if !matches!(value.as_deref(), Some([Constant::Bool(false)])) {
            return;
        }
        let diagnostic = Diagnostic::new(codes::STATIC_ASSERTION, assertion.text.clone())
            .at(assertion.condition.span, "is false");
        let diagnostic = match self.compared_values(&assertion.condition) {
            Some([left, right]) => diagnostic.note(format!("it compares {left} with {right}")),
            None => diagnostic,
        };
        self.report(diagnostic);
    }

    /// The values that a condition compares, if it is a comparison of scalars.
    fn compared_values(&mut self, condition: &ast::Expression) -> Option<[Constant; 2]> {
        let ast::ExpressionKind::Binary(operator, left, right) = &condition.kind else {
            return None;
        };
        let compares = matches!(
            operator,
            BinaryOperator::Equal
                | BinaryOperator::NotEqual
                | BinaryOperator::Less
                | BinaryOperator::LessEqual
                | BinaryOperator::Greater
                | BinaryOperator::GreaterEqual
        );
        if !compares {
            return None;
        }
        let [left, right] = [left, right].map(|side| {
            let side = self.check_expression(side);
            self.constant_scalar(&side)
        });
        Some([left?, right?])
    }
}
