//! Initial values in declarations: expressions, and GLSL's lists in braces.

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast::{self, Initializer};

use super::Checker;
use super::constructors::{fills, is_open};
use super::expressions::error_expression;
use super::types::{FLOAT, MAX_LEAVES};
use crate::hir::{Expression, ExpressionKind, Type};

impl Checker<'_> {
    /// Checks the initial value for type `ty`, whose open dimensions it determines.
    pub(super) fn check_initializer(&mut self, ty: &Type, initializer: &Initializer) -> Expression {
        match initializer {
            Initializer::Expression(expression) => self.check_initial_value(ty, expression),
            Initializer::List(items, span) => self.check_list(ty, items, *span),
        }
    }

    fn check_initial_value(&mut self, ty: &Type, expression: &ast::Expression) -> Expression {
        let value = self.check_expression(expression);
        if !is_open(ty) {
            return self.expect_type(value, ty, "the initial value");
        }
        if value.ty == Type::Error || fills(ty, &value.ty) {
            return value;
        }
        let expected = format!("`{}`", self.show(ty));
        self.report_mismatch("the initial value", &expected, &value);
        error_expression(value.span)
    }

    fn check_list(&mut self, ty: &Type, items: &[Initializer], span: Span) -> Expression {
        match ty {
            Type::Array(element, size) => {
                self.check_list_length(ty, *size as usize, items, span);
                self.check_array_list(element, items, span)
            }
            Type::Buffer(element) => self.check_array_list(element, items, span),
            Type::Struct(id) => {
                let declared = std::sync::Arc::clone(&self.module.structs[id.0 as usize]);
                let types = declared.fields.iter().map(|(_, ty)| ty.clone()).collect();
                self.check_fixed_list(ty, types, items, span)
            }
            Type::Vector(scalar, size) => {
                let types = vec![Type::Scalar(*scalar); usize::from(*size)];
                self.check_fixed_list(ty, types, items, span)
            }
            Type::Matrix(columns, rows) => {
                let column = Type::Vector(rtsl_ir::Scalar::F32, *rows);
                self.check_fixed_list(ty, vec![column; usize::from(*columns)], items, span)
            }
            Type::Color => self.check_fixed_list(ty, vec![FLOAT; 3], items, span),
            Type::Scalar(_) | Type::Reference(_) | Type::Void => {
                let shown = self.show_one(ty);
                self.report(
                    Diagnostic::new(
                        codes::BAD_INITIALIZER,
                        format!("{shown} cannot be initialized with a list"),
                    )
                    .at(span, format!("expected {shown}")),
                );
                error_expression(span)
            }
            Type::Error => error_expression(span),
        }
    }

    fn check_list_length(
        &mut self,
        ty: &Type,
        expected: usize,
        items: &[Initializer],
        span: Span,
    ) -> bool {
        if items.len() == expected {
            return true;
        }
        let (shown, found) = (self.show_one(ty), items.len());
        self.report(
            Diagnostic::new(
                codes::BAD_INITIALIZER,
                format!("{shown} needs {expected} values, not {found}"),
            )
            .at(span, format!("{found} values")),
        );
        false
    }

    fn check_fixed_list(
        &mut self,
        ty: &Type,
        types: Vec<Type>,
        items: &[Initializer],
        span: Span,
    ) -> Expression {
        if !self.check_list_length(ty, types.len(), items, span) {
            return error_expression(span);
        }
        let arguments =
            items.iter().zip(&types).map(|(item, ty)| self.check_initializer(ty, item)).collect();
        Expression { kind: ExpressionKind::Construct(arguments), ty: ty.clone(), span }
    }

    fn check_array_list(
        &mut self,
        element: &Type,
        items: &[Initializer],
        span: Span,
    ) -> Expression {
        let mut element = element.clone();
        let mut arguments = Vec::new();
        for item in items {
            let argument = self.check_initializer(&element, item);
            if is_open(&element) && argument.ty != Type::Error {
                element = argument.ty.clone();
            }
            arguments.push(argument);
        }
        if arguments.is_empty() || is_open(&element) {
            if items.is_empty() {
                self.report(
                    Diagnostic::new(codes::BAD_INITIALIZER, "an array needs at least one element")
                        .at(span, "an empty list"),
                );
            }
            return error_expression(span);
        }
        let count = arguments.len() as u32;
        if self.leaf_count(&element).saturating_mul(count) > MAX_LEAVES {
            self.array_of(element, &[Some(count)], span);
            return error_expression(span);
        }
        let ty = Type::Array(Box::new(element), count);
        Expression { kind: ExpressionKind::Construct(arguments), ty, span }
    }
}
