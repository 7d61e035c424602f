//! Method calls: `kd.lookup(uv)` and the other methods of references, and `.length()`.

use rtsl_ir::Constant;
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_spec::builtins::{REFERENCE_METHODS, ReferenceMethod, SpecType};
use rtsl_spec::{Role, lookup_state};
use rtsl_syntax::ast;

use super::Checker;
use super::expressions::{constant_scalar, convert, error_expression};
use super::facts::UseKind;
use super::functions::Kind;
use super::lvalues::root;
use super::suggestions::suggest;
use super::types::{INT, converts, from_spec};
use crate::hir::{Expression, ExpressionKind, ReferenceCall, ReferenceFunction, StateId, Type};

impl Checker<'_> {
    /// Checks `a.length()` or `kd.lookup(uv)`.
    pub(super) fn check_method_call(
        &mut self,
        receiver: &ast::Expression,
        method: &ast::Identifier,
        arguments: &[ast::Expression],
        span: Span,
    ) -> Expression {
        let receiver = self.check_place(receiver);
        let arguments = self.check_values(arguments);
        match receiver.ty {
            Type::Error => error_expression(span),
            Type::Reference(role) => {
                self.check_reference_call(receiver, role, method, arguments, span)
            }
            _ => self.check_length(receiver, method, &arguments, span),
        }
    }

    fn check_length(
        &mut self,
        receiver: Expression,
        method: &ast::Identifier,
        arguments: &[Expression],
        span: Span,
    ) -> Expression {
        let count = match &receiver.ty {
            Type::Array(_, size) => Some(*size),
            Type::Vector(_, size) => Some(u32::from(*size)),
            Type::Matrix(columns, _) => Some(u32::from(*columns)),
            Type::Buffer(_) => None,
            _ => return self.report_unknown_method(&receiver.ty, method, &[], span),
        };
        if method.name != "length" {
            return self.report_unknown_method(&receiver.ty, method, &["length"], span);
        }
        if let Some(argument) = arguments.first() {
            self.report(
                Diagnostic::new(codes::NO_MATCHING_FUNCTION, "`length` takes no arguments")
                    .at(argument.span, "one too many"),
            );
        }
        match count {
            Some(count) => constant_scalar(Constant::I32(count as i32), INT, span),
            None => Expression { kind: ExpressionKind::Length(Box::new(receiver)), ty: INT, span },
        }
    }

    fn report_unknown_method(
        &mut self,
        ty: &Type,
        method: &ast::Identifier,
        known: &[&str],
        span: Span,
    ) -> Expression {
        let shown = self.show(ty);
        let mut diagnostic = Diagnostic::new(
            codes::UNKNOWN_FIELD,
            format!("a `{shown}` has no method `{}`", method.name),
        )
        .at(method.span, "unknown method");
        if !known.is_empty() {
            diagnostic = diagnostic.note(format!("it has {}", quoted_list(known)));
        }
        let similar = self.similar_of(&method.name, known.iter().copied());
        self.report(suggest(diagnostic, method.span, similar));
        error_expression(span)
    }

    fn check_reference_call(
        &mut self,
        reference: Expression,
        role: Role,
        method: &ast::Identifier,
        arguments: Vec<Expression>,
        span: Span,
    ) -> Expression {
        let ty = reference.ty.clone();
        let named: Vec<&'static ReferenceMethod> = REFERENCE_METHODS
            .iter()
            .filter(|each| each.role == role && each.name == method.name)
            .collect();
        if named.is_empty() {
            let mut known: Vec<&str> = REFERENCE_METHODS
                .iter()
                .filter(|each| each.role == role)
                .map(|each| each.name)
                .collect();
            known.dedup();
            return self.report_unknown_method(&ty, method, &known, span);
        }
        if arguments.iter().any(|argument| argument.ty == Type::Error) {
            return Expression {
                kind: ExpressionKind::Error,
                ty: from_spec(named[0].result),
                span,
            };
        }
        let exact = |method: &&&ReferenceMethod| takes(method, &arguments, |from, to| from == to);
        let loose = |method: &&&ReferenceMethod| {
            takes(method, &arguments, |from, to| from == to || converts(from, to))
        };
        let chosen = named.iter().find(exact).or_else(|| named.iter().find(loose)).copied();
        let Some(chosen) = chosen else {
            return self.report_reference_arguments(method, &named, &arguments, span);
        };
        self.note_reference_call(chosen, span);
        let parameters = chosen.parameters.iter().map(|(_, ty)| from_spec(*ty));
        let arguments = arguments
            .into_iter()
            .zip(parameters)
            .map(|(argument, ty)| convert(argument, &ty))
            .collect();
        let function = reference_function(chosen);
        let call = ReferenceCall { reference, role, function, arguments };
        Expression {
            kind: ExpressionKind::ReferenceCall(Box::new(call)),
            ty: from_spec(chosen.result),
            span,
        }
    }

    fn report_reference_arguments(
        &mut self,
        method: &ast::Identifier,
        named: &[&'static ReferenceMethod],
        arguments: &[Expression],
        span: Span,
    ) -> Expression {
        let found: Vec<String> = arguments.iter().map(|each| self.show(&each.ty)).collect();
        let mut diagnostic = Diagnostic::new(
            codes::NO_MATCHING_FUNCTION,
            format!("no `{}` takes `({})`", method.name, found.join(", ")),
        )
        .at(span, "");
        for each in named {
            let parameters: Vec<String> =
                each.parameters.iter().map(|(name, ty)| format!("{ty} {name}")).collect();
            diagnostic = diagnostic.note(format!(
                "there is `{} {}({})`",
                each.result,
                each.name,
                parameters.join(", ")
            ));
        }
        self.report(diagnostic);
        error_expression(span)
    }

    fn note_reference_call(&mut self, method: &'static ReferenceMethod, span: Span) {
        match self.function.kind {
            Kind::ClassFunction => {
                self.note_use(UseKind::Reference(method), span);
                for name in method.also_sets {
                    self.note_state_set_by_call(method, name, span);
                }
            }
            Kind::FileFunction | Kind::Initializer | Kind::Constant => self.report(
                Diagnostic::new(codes::OUT_OF_PLACE, "other shaders are called by methods")
                    .at(span, "there is no ray here"),
            ),
        }
    }

    /// Notes that the call sets a state variable of the caller, whose role must have it.
    fn note_state_set_by_call(&mut self, method: &ReferenceMethod, name: &str, span: Span) {
        let Some(variable) = lookup_state(name) else { return };
        if self.class_has_state(name) {
            self.note_use(UseKind::WriteState(StateId(variable.index)), span);
            return;
        }
        let method = method.name;
        self.report(
            Diagnostic::new(
                codes::OUT_OF_PLACE,
                format!("`{method}` of another shader is only for materials"),
            )
            .at(span, format!("sets `{name}`, which this class does not have")),
        );
    }

    /// Notes that the class tests a reference, so that leaving it unset is intentional.
    pub(super) fn mark_tested(&mut self, reference: &Expression) {
        if let (ExpressionKind::Member(id), Some(class)) = (&root(reference).kind, &mut self.class)
        {
            class.members[id.0 as usize].tested = true;
        }
    }
}

fn takes(
    method: &ReferenceMethod,
    arguments: &[Expression],
    fits: impl Fn(&Type, &Type) -> bool,
) -> bool {
    let parameters: &[(&str, SpecType)] = method.parameters;
    parameters.len() == arguments.len()
        && parameters
            .iter()
            .zip(arguments)
            .all(|((_, ty), argument)| fits(&argument.ty, &from_spec(*ty)))
}

fn reference_function(method: &ReferenceMethod) -> ReferenceFunction {
    match method.runs {
        rtsl_spec::Method::Shade => ReferenceFunction::Shade,
        rtsl_spec::Method::Bsdf => ReferenceFunction::Bsdf,
        rtsl_spec::Method::SampleBsdf => ReferenceFunction::SampleBsdf,
        rtsl_spec::Method::EvaluatePdf => ReferenceFunction::EvaluatePdf,
        rtsl_spec::Method::Emission => ReferenceFunction::Emission,
        // Only textures are left, which have two names for one method.
        _ if method.name == "lookupFloat" => ReferenceFunction::LookupFloat,
        _ => ReferenceFunction::Lookup,
    }
}

/// Formats the names as a list: `a`, `b` and `c`.
pub(super) fn quoted_list(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        Some((last, _)) => last.clone(),
        None => String::new(),
    }
}
