//! Constructors of types: `vec3(...)`, `mat2(...)`, `color(...)`, `S(...)`, `float[](...)`.

use rtsl_ir::Scalar;
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};

use super::Checker;
use super::expressions::{at, convert, error_expression};
use super::types::{FLOAT, MAX_LEAVES, VEC3, component_count, converts};
use crate::hir::{Expression, ExpressionKind, Type};

impl Checker<'_> {
    /// Builds a value of type `ty` from `arguments`.
    pub(super) fn check_construct(
        &mut self,
        ty: Type,
        arguments: Vec<Expression>,
        span: Span,
    ) -> Expression {
        if ty == Type::Error || arguments.iter().any(|argument| argument.ty == Type::Error) {
            return Expression { kind: ExpressionKind::Error, ty: error_if_open(ty), span };
        }
        match &ty {
            Type::Scalar(_) => self.construct_scalar(ty, arguments, span),
            Type::Vector(_, size) => {
                let needed = u32::from(*size);
                self.construct_components(ty, needed, arguments, span)
            }
            Type::Matrix(..) => self.construct_matrix(ty, arguments, span),
            Type::Color => self.construct_color(arguments, span),
            Type::Struct(_) => self.construct_struct(ty, arguments, span),
            Type::Array(..) | Type::Buffer(_) => self.construct_array(ty, arguments, span),
            Type::Void | Type::Reference(_) | Type::Error => error_expression(span),
        }
    }

    fn report_arguments(&mut self, message: String, span: Span, label: &str) -> Expression {
        self.report(Diagnostic::new(codes::BAD_CONSTRUCTOR_ARGUMENTS, message).at(span, label));
        error_expression(span)
    }

    fn construct_scalar(
        &mut self,
        ty: Type,
        mut arguments: Vec<Expression>,
        span: Span,
    ) -> Expression {
        let shown = self.show(&ty);
        let (1, Some(argument)) = (arguments.len(), arguments.pop()) else {
            return self.report_arguments(
                format!("`{shown}(...)` takes one argument"),
                span,
                "expected one argument",
            );
        };
        match argument.ty {
            Type::Scalar(_) => at(convert(argument, &ty), span),
            Type::Vector(..) | Type::Matrix(..) => {
                Expression { kind: ExpressionKind::Construct(vec![argument]), ty, span }
            }
            _ => self.report_component_argument(&shown, &argument, span),
        }
    }

    /// Reports an argument that has no components.
    fn report_component_argument(
        &mut self,
        shown: &str,
        argument: &Expression,
        span: Span,
    ) -> Expression {
        let found = self.show(&argument.ty);
        let mut diagnostic = Diagnostic::new(
            codes::BAD_CONSTRUCTOR_ARGUMENTS,
            format!("`{shown}(...)` cannot be made from `{found}`"),
        )
        .at(argument.span, format!("this is `{found}`"));
        if argument.ty == Type::Color {
            diagnostic = diagnostic
                .help("`rgb(c)` gives the components of a color, `luminance(c)` its brightness");
        }
        self.report(diagnostic);
        error_expression(span)
    }

    /// Constructs vectors, and matrices from single numbers: from one scalar for all components, or
    /// from as many components as needed. Only the last argument may have more than are used.
    fn construct_components(
        &mut self,
        ty: Type,
        needed: u32,
        arguments: Vec<Expression>,
        span: Span,
    ) -> Expression {
        let shown = self.show(&ty);
        let mut given = 0;
        for argument in &arguments {
            if given >= needed {
                return self.report_arguments(
                    format!("`{shown}(...)` has too many arguments"),
                    argument.span,
                    &format!("the arguments before this give all {needed} components"),
                );
            }
            given += match argument.ty {
                Type::Scalar(_) | Type::Vector(..) | Type::Matrix(..) => {
                    component_count(&argument.ty).unwrap_or(0)
                }
                _ => return self.report_component_argument(&shown, argument, span),
            };
        }
        let splat = arguments.len() == 1 && matches!(arguments[0].ty, Type::Scalar(_));
        if given < needed && !splat {
            return self.report_arguments(
                format!("`{shown}(...)` has too few arguments"),
                span,
                &format!("{given} of {needed} components"),
            );
        }
        Expression { kind: ExpressionKind::Construct(arguments), ty, span }
    }

    fn construct_matrix(&mut self, ty: Type, arguments: Vec<Expression>, span: Span) -> Expression {
        let matrix = arguments.iter().find(|each| matches!(each.ty, Type::Matrix(..)));
        match matrix {
            Some(_) if arguments.len() == 1 => {
                Expression { kind: ExpressionKind::Construct(arguments), ty, span }
            }
            Some(matrix) => {
                let shown = self.show(&ty);
                self.report_arguments(
                    format!("`{shown}(...)` takes one matrix or none"),
                    matrix.span,
                    "a matrix among other arguments",
                )
            }
            None => {
                let needed = component_count(&ty).unwrap_or(0);
                self.construct_components(ty, needed, arguments, span)
            }
        }
    }

    /// Constructs a color: grey from a number, or red, green and blue from three numbers or a vec3.
    fn construct_color(&mut self, mut arguments: Vec<Expression>, span: Span) -> Expression {
        let number = |ty: &Type| matches!(ty, Type::Scalar(scalar) if *scalar != Scalar::Bool);
        let fits = match arguments.as_slice() {
            [one] if one.ty == Type::Color => {
                return arguments.pop().unwrap_or_else(|| error_expression(span));
            }
            [one] => number(&one.ty) || one.ty == VEC3 || converts(&one.ty, &VEC3),
            [_, _, _] => arguments.iter().all(|each| number(&each.ty)),
            _ => false,
        };
        if !fits {
            let types: Vec<String> = arguments.iter().map(|each| self.show(&each.ty)).collect();
            self.report(
                Diagnostic::new(
                    codes::BAD_CONSTRUCTOR_ARGUMENTS,
                    format!("`color(...)` cannot be made from `({})`", types.join(", ")),
                )
                .at(span, "")
                .note("it is `color(float)`, `color(float, float, float)` or `color(vec3)`"),
            );
            return error_expression(span);
        }
        let arguments = arguments
            .into_iter()
            .map(|each| match each.ty {
                Type::Vector(..) => convert(each, &VEC3),
                _ => convert(each, &FLOAT),
            })
            .collect();
        Expression { kind: ExpressionKind::Construct(arguments), ty: Type::Color, span }
    }

    fn construct_struct(&mut self, ty: Type, arguments: Vec<Expression>, span: Span) -> Expression {
        let Type::Struct(id) = ty else { return error_expression(span) };
        let declared = std::sync::Arc::clone(&self.module.structs[id.0 as usize]);
        if declared.fields.len() != arguments.len() {
            let (expected, found) = (declared.fields.len(), arguments.len());
            return self.report_arguments(
                format!("`{}` has {expected} fields, not {found}", declared.name),
                span,
                &format!("expected {expected} arguments"),
            );
        }
        let mut converted = Vec::new();
        for (argument, (name, field)) in arguments.into_iter().zip(&declared.fields) {
            converted.push(self.expect_type(argument, field, &format!("the field `{name}`")));
        }
        Expression { kind: ExpressionKind::Construct(converted), ty, span }
    }

    /// Constructs an array. An open size is the number of arguments; an open element type is that
    /// of the first argument.
    fn construct_array(&mut self, ty: Type, arguments: Vec<Expression>, span: Span) -> Expression {
        let (element, size) = match ty {
            Type::Array(element, size) => (*element, Some(size)),
            Type::Buffer(element) => (*element, None),
            _ => return error_expression(span),
        };
        let Some(element) = self.complete_element(element, arguments.first(), span) else {
            return error_expression(span);
        };
        let count = arguments.len() as u32;
        if count == 0 || size.is_some_and(|size| size != count) {
            let message = match size {
                Some(size) => {
                    format!("an array of {size} elements needs {size} arguments, not {count}")
                }
                None => "an array needs at least one element".to_owned(),
            };
            return self.report_arguments(message, span, "");
        }
        if self.leaf_count(&element).saturating_mul(count) > MAX_LEAVES {
            self.array_of(element, &[Some(count)], span);
            return error_expression(span);
        }
        let converted = arguments
            .into_iter()
            .map(|argument| self.expect_type(argument, &element, "an element"))
            .collect();
        let ty = Type::Array(Box::new(element), count);
        Expression { kind: ExpressionKind::Construct(converted), ty, span }
    }

    /// Completes the element type: open dimensions are taken from the first element.
    pub(super) fn complete_element(
        &mut self,
        element: Type,
        first: Option<&Expression>,
        span: Span,
    ) -> Option<Type> {
        if !is_open(&element) {
            return Some(element);
        }
        let first = first?;
        if fills(&element, &first.ty) {
            return Some(first.ty.clone());
        }
        let (expected, found) = (self.show(&element), self.show(&first.ty));
        self.report(
            Diagnostic::new(
                codes::MISMATCHED_TYPES,
                format!("an element must be `{expected}`, but this is `{found}`"),
            )
            .at(first.span, format!("expected `{expected}`, found `{found}`"))
            .label(span, ""),
        );
        None
    }
}

/// True if a dimension of the type is open.
pub(super) fn is_open(ty: &Type) -> bool {
    match ty {
        Type::Buffer(_) => true,
        Type::Array(element, _) => is_open(element),
        _ => false,
    }
}

/// True if `closed` is `open` with its open dimensions filled in.
pub(super) fn fills(open: &Type, closed: &Type) -> bool {
    match (open, closed) {
        (Type::Buffer(open), Type::Array(closed, _)) => fills(open, closed),
        (Type::Array(open, size), Type::Array(closed, other)) => {
            size == other && fills(open, closed)
        }
        _ => open == closed,
    }
}

fn error_if_open(ty: Type) -> Type {
    if is_open(&ty) { Type::Error } else { ty }
}
