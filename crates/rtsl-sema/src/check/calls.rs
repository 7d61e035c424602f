//! Calls of functions, built-in functions, and constructors of types.

use rtsl_ir::Scalar;
use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_spec::builtins::{self, Builtin, Lowering, Overload, Special, Usable};
use rtsl_syntax::ast::{self, ExpressionKind as Ast};

use super::Checker;
use super::access::Access;
use super::candidates::{Candidate, Choice, choose};
use super::expressions::{convert, error_expression};
use super::facts::UseKind;
use super::foreign::{advise, counterpart, type_counterpart};
use super::functions::Kind;
use super::lvalues::root;
use super::scope::Entity;
use super::suggestions::suggest;
use super::types::{FLOAT, INT, TypePlace, builtin_type, from_spec};
use crate::hir::{BuiltinCall, Expression, ExpressionKind, FunctionId, Passing, Type};
use crate::index::{Call, Callee, Symbol};

/// The number of arguments of a call that diagnostics show.
const SHOWN_ARGUMENTS: usize = 8;

/// The resolved callee of a call, free of borrows.
enum Target {
    Function(FunctionId),
    Builtin(&'static Overload),
}

impl Checker<'_> {
    /// `f(x)`, `vec3(x)`, `float[2](x, y)`.
    pub(super) fn check_call(
        &mut self,
        callee: &ast::Expression,
        arguments: &[ast::Expression],
        span: Span,
    ) -> Expression {
        match &callee.kind {
            Ast::Name(name) => self.check_named_call(name, callee.span, arguments, span),
            Ast::Index(..) => self.check_array_constructor(callee, arguments, span),
            _ => {
                let callee = self.check_expression(callee);
                self.check_arguments(arguments);
                if callee.ty != Type::Error {
                    self.report(
                        Diagnostic::new(codes::NOT_A_FUNCTION, "this is not a function")
                            .at(callee.span, "cannot be called"),
                    );
                }
                error_expression(span)
            }
        }
    }

    fn check_array_constructor(
        &mut self,
        callee: &ast::Expression,
        arguments: &[ast::Expression],
        span: Span,
    ) -> Expression {
        let Some((name, sizes)) = self.array_head(callee) else {
            self.check_arguments(arguments);
            self.report(
                Diagnostic::new(codes::NOT_A_FUNCTION, "this is not a function")
                    .at(callee.span, "cannot be called"),
            );
            return error_expression(span);
        };
        let written = ast::TypeName {
            name,
            sizes: sizes.into_iter().map(|size| size.cloned()).collect(),
            span: callee.span,
        };
        let ty = self.resolve_type(&written, TypePlace::Constructor);
        let arguments = self.check_values(arguments);
        self.check_construct(ty, arguments, span)
    }

    pub(super) fn check_named_call(
        &mut self,
        name: &str,
        name_span: Span,
        arguments: &[ast::Expression],
        span: Span,
    ) -> Expression {
        self.note_cursor(name);
        match self.callee(name) {
            Some(Entity::Struct(id)) => {
                self.note_name(name, name_span, None);
                let arguments = self.check_values(arguments);
                return self.check_construct(Type::Struct(id), arguments, span);
            }
            Some(Entity::Enumeration(_)) => {
                self.note_name(name, name_span, None);
                let arguments = self.check_values(arguments);
                return self.check_construct(INT, arguments, span);
            }
            Some(Entity::Error) => {
                self.check_arguments(arguments);
                return error_expression(span);
            }
            Some(Entity::Functions(_)) => {}
            Some(
                entity @ (Entity::Local(_)
                | Entity::Member(_)
                | Entity::Constant(..)
                | Entity::Class(_)
                | Entity::Module),
            ) => {
                self.check_arguments(arguments);
                return self.report_not_a_function(name, &entity, name_span, span);
            }
            None => match builtin_type(name).or_else(|| self.generic_type(name)) {
                Some(Type::Void | Type::Reference(_)) | None => {}
                Some(ty) => {
                    self.note_symbol(name_span, Symbol::Type(name.to_owned()), None);
                    let arguments = self.check_values(arguments);
                    return self.check_construct(ty, arguments, span);
                }
            },
        }
        let arguments = self.check_arguments(arguments);
        self.check_function_call(name, name_span, arguments, span)
    }

    /// Resolves the name of a call, built-in functions and types aside. In the prelude, names of built-in functions and
    /// types always mean those, so that implied methods capture no name of a user's class.
    fn callee(&self, name: &str) -> Option<Entity> {
        if self.in_prelude && (builtins::find(name).is_some() || builtin_type(name).is_some()) {
            return None;
        }
        self.find(name).map(|named| named.entity.clone())
    }

    fn report_not_a_function(
        &mut self,
        name: &str,
        entity: &Entity,
        name_span: Span,
        span: Span,
    ) -> Expression {
        let mut diagnostic = Diagnostic::new(
            codes::NOT_A_FUNCTION,
            format!("`{name}` is {}, not a function", entity.kind()),
        )
        .at(name_span, "cannot be called");
        if let Some(declared) = self.find(name).map(|named| named.span) {
            diagnostic = diagnostic.label(declared, "declared here");
        }
        if builtins::find(name).is_some() {
            diagnostic = diagnostic
                .note("it hides the built-in function of that name")
                .help("give it another name");
        }
        self.report(diagnostic);
        error_expression(span)
    }

    /// Checks arguments as place expressions, since some may turn out to be assigned.
    pub(super) fn check_arguments(&mut self, arguments: &[ast::Expression]) -> Vec<Expression> {
        arguments.iter().map(|argument| self.check_place(argument)).collect()
    }

    /// Checks arguments that are only read.
    pub(super) fn check_values(&mut self, arguments: &[ast::Expression]) -> Vec<Expression> {
        arguments.iter().map(|argument| self.check_expression(argument)).collect()
    }

    fn check_function_call(
        &mut self,
        name: &str,
        name_span: Span,
        arguments: Vec<Expression>,
        span: Span,
    ) -> Expression {
        self.note_callee(name, name_span, &arguments);
        if arguments.iter().any(|argument| argument.ty == Type::Error) {
            self.note_unknown_uses(&arguments);
            if !self.is_function(name) {
                self.report_unknown_function(name, name_span);
            }
            return error_expression(span);
        }
        if let Some(builtin) = builtins::find(name)
            && !matches!(self.find(name), Some(named) if matches!(named.entity, Entity::Functions(_)))
        {
            match builtin.lowering {
                Lowering::Special(Special::IsSet) => return self.check_is_set(arguments, span),
                Lowering::Special(Special::IsTextured) => {
                    return self.check_is_textured(arguments, span);
                }
                _ => {}
            }
        }
        match self.choose_target(name, &arguments) {
            Ok(Target::Function(id)) => self.call_function(id, arguments, span),
            Ok(Target::Builtin(overload)) => self.call_builtin(overload, arguments, span),
            Err(diagnostic) => {
                self.note_unknown_uses(&arguments);
                match diagnostic {
                    Some(diagnostic) => self.report(diagnostic.at(span, "")),
                    None => self.report_unknown_function(name, name_span),
                }
                error_expression(span)
            }
        }
    }

    /// Notes the uses of the arguments of an erroneous call: the intended function may read them or
    /// set them.
    fn note_unknown_uses(&mut self, arguments: &[Expression]) {
        for argument in arguments {
            match root(argument).kind {
                ExpressionKind::Local(id) => self.note_local_write(id),
                _ => self.note_access(argument, Access::Read),
            }
        }
    }

    fn is_function(&self, name: &str) -> bool {
        matches!(self.find(name), Some(named) if matches!(named.entity, Entity::Functions(_)))
            || builtins::find(name).is_some_and(|builtin| self.is_callable(builtin))
    }

    /// True if the text being checked may name the function at all.
    pub(super) fn is_callable(&self, builtin: &Builtin) -> bool {
        match builtin.usable {
            Usable::Anywhere | Usable::Methods(_) => true,
            Usable::Prelude => self.in_prelude,
        }
    }

    /// The functions called `name`, level by level from the innermost: the class, the file, the
    /// language. The nearest level with a function that accepts the arguments wins: a user's
    /// function hides a built-in one, which still applies to arguments that the user's function
    /// does not accept. Within the prelude, the name of a built-in function always denotes the
    /// built-in one.
    fn function_levels(&self, name: &str) -> Vec<Vec<Candidate<'_>>> {
        let mut levels = Vec::new();
        let is_builtin = builtins::find(name).is_some_and(|builtin| self.is_callable(builtin));
        if !(self.in_prelude && is_builtin) {
            let class = self.class.as_ref().map(|class| &class.names);
            for level in class.into_iter().chain(std::iter::once(&self.file)) {
                if let Some(Entity::Functions(ids)) = level.get(name).map(|named| &named.entity) {
                    let candidates =
                        ids.iter().map(|id| Candidate::Function(*id, self.function(*id)));
                    levels.push(candidates.collect());
                }
            }
        }
        if is_builtin {
            levels.push(builtins::overloads(name).iter().map(Candidate::Builtin).collect());
        }
        levels
    }

    /// Notes for editors what a call could mean, and what it does.
    fn note_callee(&mut self, name: &str, name_span: Span, arguments: &[Expression]) {
        if self.index.is_none() {
            return;
        }
        let target = self.choose_target(name, arguments).ok();
        let candidates = self.function_levels(name).into_iter().flatten().map(|it| match it {
            Candidate::Function(id, _) => Callee::Function(id),
            Candidate::Builtin(overload) => Callee::Builtin(overload),
        });
        let candidates: Vec<Callee> = candidates.collect();
        let first = candidates.first().copied();
        let call = Call { name: name_span, candidates };
        let meant = match target {
            Some(Target::Function(id)) => Some(Ok(id)),
            Some(Target::Builtin(overload)) => Some(Err(overload.builtin.name)),
            None => first.map(|candidate| match candidate {
                Callee::Function(id) => Ok(id),
                Callee::Builtin(overload) => Err(overload.builtin.name),
            }),
        };
        let last = name.rsplit('.').next().unwrap_or(name).len() as u32;
        let part = Span { start: name_span.end.saturating_sub(last), ..name_span };
        match meant {
            Some(Ok(id)) => self.note_function(id, part),
            Some(Err(builtin)) => self.note_builtin(builtin, part),
            None => {}
        }
        self.note_module(name, name_span);
        if let Some(index) = &mut self.index {
            index.calls.push(call);
        }
    }

    /// Resolves the callee. An error holds a diagnostic, or `None` if nothing has that name.
    fn choose_target(
        &self,
        name: &str,
        arguments: &[Expression],
    ) -> Result<Target, Option<Box<Diagnostic>>> {
        let levels = self.function_levels(name);
        if levels.is_empty() {
            return Err(None);
        }
        for level in &levels {
            match choose(level.iter().copied(), arguments) {
                Choice::One(Candidate::Function(id, _)) => return Ok(Target::Function(id)),
                Choice::One(Candidate::Builtin(overload)) => return Ok(Target::Builtin(overload)),
                Choice::None => {}
                Choice::Ambiguous(first, second) => {
                    return Err(Some(Box::new(self.ambiguous(name, arguments, first, second))));
                }
            }
        }
        let all: Vec<Candidate<'_>> = levels.into_iter().flatten().collect();
        Err(Some(Box::new(self.no_match(name, arguments, &all))))
    }

    /// Chooses one of these functions.
    pub(super) fn choose_among(
        &self,
        name: &str,
        functions: &[FunctionId],
        arguments: &[Expression],
    ) -> Result<FunctionId, Box<Diagnostic>> {
        let candidates = functions.iter().map(|id| Candidate::Function(*id, self.function(*id)));
        let candidates: Vec<Candidate<'_>> = candidates.collect();
        match choose(candidates.iter().copied(), arguments) {
            Choice::One(Candidate::Function(id, _)) => Ok(id),
            Choice::Ambiguous(first, second) => {
                Err(Box::new(self.ambiguous(name, arguments, first, second)))
            }
            Choice::One(Candidate::Builtin(_)) | Choice::None => {
                Err(Box::new(self.no_match(name, arguments, &candidates)))
            }
        }
    }

    fn show_arguments(&self, arguments: &[Expression]) -> String {
        let shown = arguments.iter().take(SHOWN_ARGUMENTS);
        let mut types: Vec<String> = shown.map(|each| self.show(&each.ty)).collect();
        if arguments.len() > SHOWN_ARGUMENTS {
            types.push(format!("and {} more", arguments.len() - SHOWN_ARGUMENTS));
        }
        types.join(", ")
    }

    fn show_candidate(&self, candidate: Candidate<'_>) -> String {
        match candidate {
            Candidate::Builtin(overload) => format!("`{overload}`"),
            Candidate::Function(id, _) => match self.written_generic(id) {
                Some(written) => written.to_owned(),
                None => self.show_function(id),
            },
        }
    }

    /// Formats the header of a function, in quotes.
    pub(super) fn show_function(&self, id: FunctionId) -> String {
        let overload = self.function(id);
        let parameters: Vec<String> = overload
            .parameters
            .iter()
            .zip(&overload.locals)
            .enumerate()
            .map(|(index, (passing, local))| {
                let has_default = index + overload.defaults.len() >= overload.parameters.len();
                let default = if has_default { " = …" } else { "" };
                let passing = match passing {
                    Passing::In => "",
                    Passing::Out => "out ",
                    Passing::InOut => "inout ",
                };
                let space = if local.name.is_empty() { "" } else { " " };
                format!("{passing}{}{space}{}{default}", self.show(&local.ty), local.name)
            })
            .collect();
        let (result, name) = (self.show(&overload.result), &overload.name);
        format!("`{result} {name}({})`", parameters.join(", "))
    }

    fn ambiguous(
        &self,
        name: &str,
        arguments: &[Expression],
        first: Candidate<'_>,
        second: Candidate<'_>,
    ) -> Diagnostic {
        Diagnostic::new(
            codes::AMBIGUOUS_CALL,
            format!("`{name}({})` could mean several functions", self.show_arguments(arguments)),
        )
        .note(format!("it could be {}", self.show_candidate(first)))
        .note(format!("or {}", self.show_candidate(second)))
        .help("convert the arguments, so that one of them fits exactly")
    }

    fn no_match(
        &self,
        name: &str,
        arguments: &[Expression],
        candidates: &[Candidate<'_>],
    ) -> Diagnostic {
        const SHOWN: usize = 4;
        let mut diagnostic = Diagnostic::new(
            codes::NO_MATCHING_FUNCTION,
            format!("no `{name}` takes `({})`", self.show_arguments(arguments)),
        );
        for argument in arguments.iter().take(SHOWN_ARGUMENTS) {
            diagnostic =
                diagnostic.label(argument.span, format!("this is `{}`", self.show(&argument.ty)));
        }
        // Candidates with the right number of arguments are likelier to be meant.
        let (likely, other): (Vec<Candidate<'_>>, Vec<Candidate<'_>>) =
            candidates.iter().partition(|candidate| candidate.parameter_count() == arguments.len());
        let shown = if likely.is_empty() { &other } else { &likely };
        let mut shown: Vec<String> = shown.iter().map(|it| self.show_candidate(*it)).collect();
        // The instances of a generic function are shown as one.
        shown.dedup();
        for candidate in shown.iter().take(SHOWN) {
            diagnostic = diagnostic.note(format!("there is {candidate}"));
        }
        if shown.len() > SHOWN {
            diagnostic = diagnostic.note(format!("and {} more", shown.len() - SHOWN));
        }
        if arguments.iter().any(|argument| argument.ty == Type::Color)
            && is_vector_function(candidates)
        {
            diagnostic = diagnostic.help("`rgb(c)` gives a color as a `vec3`");
        }
        diagnostic
    }

    fn report_unknown_function(&mut self, name: &str, span: Span) {
        let diagnostic =
            Diagnostic::new(codes::UNKNOWN_NAME, format!("there is no function `{name}`"))
                .at(span, "unknown function");
        let diagnostic = match counterpart(name).or_else(|| type_counterpart(name)) {
            Some(counterpart) => advise(diagnostic, span, counterpart),
            None => {
                let similar = self.similar_function(name);
                suggest(diagnostic, span, similar)
            }
        };
        self.report(diagnostic);
    }

    pub(super) fn call_function(
        &mut self,
        id: FunctionId,
        arguments: Vec<Expression>,
        span: Span,
    ) -> Expression {
        self.note_call(id, span);
        if matches!(self.function.kind, Kind::Initializer | Kind::Constant)
            && self.function(id).class.is_some()
        {
            self.report(
                Diagnostic::new(
                    codes::INITIALIZER_READS,
                    "initial values cannot call functions of the class",
                )
                .at(span, "a function of the class")
                .help("call it in the constructor"),
            );
            return error_expression(span);
        }
        let function = std::sync::Arc::clone(self.function(id));
        let left_out = function.parameters.len() - arguments.len();
        let defaults = &function.defaults[function.defaults.len() - left_out..];
        let arguments = arguments.into_iter().chain(defaults.iter().cloned()).collect();
        let parameters: Vec<(Type, Passing)> = function
            .parameters
            .iter()
            .zip(&function.locals)
            .map(|(passing, local)| (local.ty.clone(), *passing))
            .collect();
        self.finish_call(arguments, &parameters, function.result.clone(), span, |arguments| {
            ExpressionKind::Call(id, arguments)
        })
    }

    pub(super) fn call_builtin(
        &mut self,
        overload: &'static Overload,
        arguments: Vec<Expression>,
        span: Span,
    ) -> Expression {
        let builtin = overload.builtin;
        if builtin.lowering == Lowering::Special(Special::Gradient)
            && !matches!(arguments[1].kind, ExpressionKind::Local(_) | ExpressionKind::State(_))
        {
            let diagnostic = Diagnostic::new(
                codes::GRADIENT_VARIABLE,
                "`gradient` takes the derivative with respect to a variable",
            )
            .at(arguments[1].span, "expected a local variable, a parameter or a state variable")
            .help("give the value a name, and compute the first argument from it");
            self.report(diagnostic);
            return error_expression(span);
        }
        let restricted = builtin.usable != Usable::Anywhere
            || builtin.lowering == Lowering::Special(Special::Rand);
        if restricted && !self.note_restricted_builtin(overload, span) {
            return error_expression(span);
        }
        let candidate = Candidate::Builtin(overload);
        let parameters: Vec<(Type, Passing)> =
            (0..overload.parameters.len()).map(|index| candidate.parameter(index)).collect();
        let (prelude, componentwise) = self.prelude_function(builtin, &parameters);
        if let Some(id) = prelude {
            self.note_call(id, span);
        }
        let result = from_spec(overload.result);
        let call = self.finish_call(arguments, &parameters, result, span, |arguments| {
            ExpressionKind::Builtin(BuiltinCall { builtin, prelude, componentwise, arguments })
        });
        self.check_not_nan(&call);
        call
    }

    /// Notes a call that only some methods may make. Reports it if it is outside any method.
    fn note_restricted_builtin(&mut self, overload: &'static Overload, span: Span) -> bool {
        let builtin = overload.builtin;
        match self.function.kind {
            Kind::ClassFunction | Kind::FileFunction => {
                self.note_use(UseKind::Builtin(overload), span);
                true
            }
            Kind::Initializer | Kind::Constant => {
                if self.in_prelude && builtin.usable == Usable::Prelude {
                    return true;
                }
                self.report(
                    Diagnostic::new(
                        codes::OUT_OF_PLACE,
                        format!("`{}` is only for methods", builtin.name),
                    )
                    .at(span, "there is no ray here"),
                );
                false
            }
        }
    }

    /// The prelude's function that implements a built-in one: the one with these parameters, or the
    /// scalar one, to be applied component by component.
    fn prelude_function(
        &self,
        builtin: &Builtin,
        parameters: &[(Type, Passing)],
    ) -> (Option<FunctionId>, bool) {
        if builtin.lowering != Lowering::Prelude {
            return (None, false);
        }
        let names = self.prelude.map_or(&self.file, |prelude| &prelude.names);
        let Some(Entity::Functions(ids)) = names.get(builtin.name).map(|named| &named.entity)
        else {
            return (None, false);
        };
        let find = |types: &[Type]| {
            ids.iter().copied().find(|id| {
                let function = self.function(*id);
                let own = function.locals[..function.parameters.len()].iter();
                own.map(|local| &local.ty).eq(types)
            })
        };
        let whole: Vec<Type> = parameters.iter().map(|(ty, _)| ty.clone()).collect();
        if let Some(id) = find(&whole) {
            return (Some(id), false);
        }
        let scalars: Vec<Type> = whole
            .into_iter()
            .map(|ty| match ty {
                Type::Vector(scalar, _) => Type::Scalar(scalar),
                Type::Color => FLOAT,
                other => other,
            })
            .collect();
        (find(&scalars), true)
    }

    /// Converts the arguments, notes how they are accessed, and builds the call.
    fn finish_call(
        &mut self,
        arguments: Vec<Expression>,
        parameters: &[(Type, Passing)],
        result: Type,
        span: Span,
        call: impl FnOnce(Vec<Expression>) -> ExpressionKind,
    ) -> Expression {
        let mut converted = Vec::new();
        let mut failed = false;
        for (argument, (ty, passing)) in arguments.into_iter().zip(parameters) {
            match passing {
                Passing::In => {
                    self.note_access(&argument, Access::Read);
                    let argument = match ty {
                        Type::Reference(_) | Type::Buffer(_) => argument,
                        _ => self.require_value(argument),
                    };
                    failed |= argument.ty == Type::Error;
                    converted.push(convert(argument, ty));
                }
                Passing::Out | Passing::InOut => {
                    let access =
                        if *passing == Passing::Out { Access::Write } else { Access::ReadWrite };
                    if !self.require_assignable(&argument) {
                        failed = true;
                        continue;
                    }
                    self.note_access(&argument, access);
                    converted.push(argument);
                }
            }
        }
        if failed {
            return error_expression(span);
        }
        Expression { kind: call(converted), ty: result, span }
    }

    /// `isSet(reference)`.
    fn check_is_set(&mut self, mut arguments: Vec<Expression>, span: Span) -> Expression {
        let single = arguments.len() == 1;
        match arguments.pop() {
            Some(reference) if single && matches!(reference.ty, Type::Reference(_)) => {
                self.set_test(reference, span)
            }
            argument => {
                let mut diagnostic = Diagnostic::new(
                    codes::NO_MATCHING_FUNCTION,
                    "`isSet` takes one argument, a reference to a shader",
                )
                .at(span, "expected a member such as `public rt_Texture kd;`");
                if let Some(Expression {
                    kind: ExpressionKind::Textured(_) | ExpressionKind::Computed(..),
                    ..
                }) = argument
                {
                    diagnostic = diagnostic
                        .help("`isTextured` tells a parameter that is a texture from a value");
                }
                self.report(diagnostic);
                error_expression(span)
            }
        }
    }

    /// `isTextured(parameter)`.
    fn check_is_textured(&mut self, mut arguments: Vec<Expression>, span: Span) -> Expression {
        let single = arguments.len() == 1;
        match arguments.pop() {
            Some(parameter)
                if single
                    && matches!(
                        parameter.kind,
                        ExpressionKind::Textured(_) | ExpressionKind::Computed(..)
                    ) =>
            {
                self.set_test(parameter, span)
            }
            argument => {
                let mut diagnostic = Diagnostic::new(
                    codes::NO_MATCHING_FUNCTION,
                    "`isTextured` takes one argument, a parameter that may be a texture",
                )
                .at(span, "expected a member such as `public texture float roughness;`");
                if argument.is_some_and(|argument| matches!(argument.ty, Type::Reference(_))) {
                    diagnostic = diagnostic.help("`isSet` tests references");
                }
                self.report(diagnostic);
                error_expression(span)
            }
        }
    }

    /// The test of a reference or a textured member.
    fn set_test(&mut self, tested: Expression, span: Span) -> Expression {
        self.mark_tested(&tested);
        let kind = ExpressionKind::IsSet(Box::new(tested));
        Expression { kind, ty: Type::Scalar(Scalar::Bool), span }
    }
}

/// True if a candidate accepts a vec3.
fn is_vector_function(candidates: &[Candidate<'_>]) -> bool {
    candidates.iter().any(|candidate| {
        (0..candidate.parameter_count())
            .any(|index| candidate.parameter(index).0 == Type::Vector(Scalar::F32, 3))
    })
}
