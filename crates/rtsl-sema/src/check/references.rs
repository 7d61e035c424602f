//! Method calls: `kd.lookup(uv)`, `base.BSDF(rt_ShadingNormal = n)` and the other methods of references, and
//! `.length()`.

use rtsl_ir::Constant;
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes, with_article};
use rtsl_spec::builtins::{
    REFERENCE_METHODS, ReferenceMethod, STATE_OF_WIDTHS, SpecType, state_of_parameter,
};
use rtsl_spec::{Direction, Role, StateVariable, lookup_state, state_variables};
use rtsl_syntax::ast;

use super::Checker;
use super::expressions::{constant_scalar, convert, error_expression};
use super::facts::UseKind;
use super::functions::Kind;
use super::lvalues::root;
use super::suggestions::suggest;
use super::super_calls::SUPER;
use super::types::{FLOAT, INT, converts, from_spec, from_state, spec_struct};
use crate::hir::{Expression, ExpressionKind, ReferenceCall, StateArgument, StateId, Type};
use crate::index::Symbol;

impl Checker<'_> {
    /// Checks `a.length()` or `kd.lookup(uv)`.
    pub(super) fn check_method_call(
        &mut self,
        receiver: &ast::Expression,
        method: &ast::Identifier,
        arguments: &[ast::Expression],
        span: Span,
    ) -> Expression {
        if matches!(&receiver.kind, ast::ExpressionKind::Name(name) if name == SUPER)
            && self.find(SUPER).is_none()
        {
            return self.check_super_call(method, arguments, span);
        }
        if let Some(name) = self.name_in_module(receiver, method) {
            return self.check_named_call(&name, receiver.span.to(method.span), arguments, span);
        }
        let receiver = self.check_place(receiver);
        self.note_part(&receiver.ty, &method.name);
        if let Type::Reference(role) = receiver.ty {
            return self.check_reference_call(receiver, role, method, arguments, span);
        }
        if let Type::Struct(id) = receiver.ty
            && let Some(of) = spec_struct(id)
        {
            return self.check_struct_method(receiver, of, method, arguments, span);
        }
        let arguments = self.check_values(arguments);
        match receiver.ty {
            Type::Error => error_expression(span),
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
            _ if matches!(
                receiver.kind,
                ExpressionKind::Textured(_) | ExpressionKind::Computed(..)
            ) =>
            {
                return self.report_method_of_textured(method, span);
            }
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

    fn report_method_of_textured(&mut self, method: &ast::Identifier, span: Span) -> Expression {
        self.report(
            Diagnostic::new(
                codes::UNKNOWN_FIELD,
                format!("a `texture` parameter has no method `{}`", method.name),
            )
            .at(method.span, "unknown method")
            .help("its name is its value: that of the texture at the hit, if it is one"),
        );
        error_expression(span)
    }

    pub(super) fn report_unknown_method(
        &mut self,
        ty: &Type,
        method: &ast::Identifier,
        known: &[&str],
        span: Span,
    ) -> Expression {
        let shown = self.show_one(ty);
        let mut diagnostic = Diagnostic::new(
            codes::UNKNOWN_FIELD,
            format!("{shown} has no method `{}`", method.name),
        )
        .at(method.span, "unknown method");
        if !known.is_empty() {
            diagnostic = diagnostic.note(format!("it has {}", quoted_list(known)));
        } else if matches!(ty, Type::Struct(_)) {
            let name = &method.name;
            diagnostic = diagnostic.help(format!(
                "structs have no methods: a function that takes one is called as `{name}(value, ...)`"
            ));
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
        written: &[ast::Expression],
        span: Span,
    ) -> Expression {
        let (named_arguments, positional): (Vec<_>, Vec<_>) =
            written.iter().partition(|argument| state_argument(argument).is_some());
        let arguments: Vec<Expression> =
            positional.into_iter().map(|argument| self.check_expression(argument)).collect();
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
            self.check_unused_arguments(&named_arguments);
            return self.report_unknown_method(&ty, method, &known, span);
        }
        if arguments.iter().any(|argument| argument.ty == Type::Error) {
            self.check_unused_arguments(&named_arguments);
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
            self.check_unused_arguments(&named_arguments);
            return self.report_reference_arguments(method, &named, &arguments, span);
        };
        self.note_symbol(method.span, Symbol::Method(chosen), None);
        self.note_reference_call(chosen, span);
        let mut states = self.positional_states(chosen, arguments, span);
        let mut failed = false;
        for argument in named_arguments {
            failed |= !self.check_state_argument(chosen, argument, &mut states);
        }
        if failed {
            let kind = ExpressionKind::Error;
            return Expression { kind, ty: from_spec(chosen.result), span };
        }
        let call = ReferenceCall { reference, method: chosen, arguments: states };
        Expression {
            kind: ExpressionKind::ReferenceCall(Box::new(call)),
            ty: from_spec(chosen.result),
            span,
        }
    }

    /// The state variables that the arguments of `lookup(uv)`, `lookup(uv, du, dv)` and `lookup(uvw)` set.
    fn positional_states(
        &self,
        method: &ReferenceMethod,
        arguments: Vec<Expression>,
        span: Span,
    ) -> Vec<StateArgument> {
        let pairs = arguments.into_iter().zip(method.parameters);
        let states = pairs.filter_map(|(argument, (name, ty))| {
            let state = StateId(state_of_parameter(name)?.index);
            Some(StateArgument { state, value: convert(argument, &from_spec(*ty)) })
        });
        let has_widths = method.parameters.iter().any(|(name, _)| *name == "du");
        let of_widths =
            STATE_OF_WIDTHS.iter().filter(|_| has_widths).filter_map(|(name, value)| {
                let state = StateId(lookup_state(name)?.index);
                Some(StateArgument {
                    state,
                    value: constant_scalar(Constant::F32(*value), FLOAT, span),
                })
            });
        states.chain(of_widths).collect()
    }

    /// Checks `rt_ShadingNormal = n` among the arguments of a call and adds it to the others. False after an error.
    fn check_state_argument(
        &mut self,
        method: &'static ReferenceMethod,
        argument: &ast::Expression,
        states: &mut Vec<StateArgument>,
    ) -> bool {
        let Some((variable, name_span, value)) = state_argument(argument) else { return false };
        let value = self.check_expression(value);
        let name = variable.name;
        self.note_symbol(name_span, Symbol::State(variable), None);
        if !is_input(method, name) {
            self.report_no_input(method, name, name_span);
            return false;
        }
        let state = StateId(variable.index);
        if states.iter().any(|other| other.state == state) {
            self.report(
                Diagnostic::new(codes::DECLARED_TWICE, format!("`{name}` is given twice"))
                    .at(name_span, "given again here"),
            );
            return false;
        }
        let value = self.expect_type(value, &from_state(variable.ty), &format!("`{name}`"));
        if value.ty == Type::Error {
            return false;
        }
        states.push(StateArgument { state, value });
        true
    }

    /// Checks the values of arguments of a call that is in error, for errors in them.
    fn check_unused_arguments(&mut self, arguments: &[&ast::Expression]) {
        for argument in arguments {
            if let Some((_, _, value)) = state_argument(argument) {
                self.check_expression(value);
            }
        }
    }

    fn report_no_input(&mut self, method: &ReferenceMethod, name: &str, span: Span) {
        let role = with_article(method.role.name());
        let inputs: Vec<&str> = state_variables()
            .iter()
            .filter(|variable| !variable.is_hidden())
            .map(|variable| variable.name)
            .filter(|name| is_input(method, name))
            .collect();
        let diagnostic = Diagnostic::new(
            codes::STATE_ARGUMENT,
            format!("`{}` of {role} does not receive `{name}`", method.runs.name()),
        )
        .at(span, "not an input of the method")
        .note(format!("it receives {}", quoted_list(&inputs)));
        let similar = self.similar_of(name, inputs.iter().copied());
        self.report(suggest(diagnostic, span, similar));
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
            Kind::ClassFunction | Kind::FileFunction => {
                self.note_use(UseKind::Reference(method), span);
                for name in method.also_sets {
                    let Some(variable) = lookup_state(name) else { continue };
                    self.note_use(UseKind::WriteState(StateId(variable.index)), span);
                }
            }
            Kind::Initializer | Kind::Constant => self.report(
                Diagnostic::new(codes::OUT_OF_PLACE, "other shaders are called by methods")
                    .at(span, "there is no ray here"),
            ),
        }
    }

    /// Notes that the class tests a reference, so that leaving it unset is intentional.
    pub(super) fn mark_tested(&mut self, reference: &Expression) {
        if let (
            ExpressionKind::Member(id)
            | ExpressionKind::Textured(id)
            | ExpressionKind::Computed(id, _),
            Some(class),
        ) = (&root(reference).kind, &mut self.class)
        {
            class.members[id.0 as usize].tested = true;
        }
    }
}

/// Returns the parts of an argument `rt_ShadingNormal = n`: the state variable, the span of its name, and the value.
fn state_argument(
    argument: &ast::Expression,
) -> Option<(&'static StateVariable, Span, &ast::Expression)> {
    let ast::ExpressionKind::Assign { target, operator: None, value } = &argument.kind else {
        return None;
    };
    let ast::ExpressionKind::Name(name) = &target.kind else { return None };
    Some((lookup_state(name)?, target.span, value))
}

/// True if the method of the callee receives the state variable.
fn is_input(method: &ReferenceMethod, name: &str) -> bool {
    let direction = method.role.row(name).and_then(|row| row.direction(method.runs));
    matches!(direction, Some(Direction::In | Direction::InOut))
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

/// Formats the names as a list: `a`, `b` and `c`.
pub(super) fn quoted_list(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match quoted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} and {last}", rest.join(", ")),
        Some((last, _)) => last.clone(),
        None => String::new(),
    }
}
