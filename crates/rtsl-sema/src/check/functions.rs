//! Functions: signatures, parameters, bodies.

use std::sync::Arc;

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_spec::Method;
use rtsl_syntax::ast::{self, Qualifier};

use super::Checker;
use super::control::Flow;
use super::facts::Facts;
use super::generics::Instance;
use super::scope::{Entity, Named};
use super::types::TypePlace;
use crate::hir::{Expression, ExpressionKind, Function, FunctionId, Local, LocalId, Passing, Type};

/// The checker's data about a function, beside its tree.
#[derive(Clone, Debug, Default)]
pub(super) struct FunctionInfo {
    /// The facts collected from the body.
    pub(super) facts: Arc<Facts>,
    /// True if a body has been declared, though it may not be checked yet.
    pub(super) has_body: bool,
    /// True for the constructor of a class.
    pub(super) is_constructor: bool,
    /// True for an implied method, which the class did not write.
    pub(super) is_implied: bool,
    /// True if another function of its class has replaced it.
    pub(super) replaced: bool,
    /// True if `super` calls it.
    pub(super) called_by_super: bool,
    /// For each parameter, true if it is `const`.
    pub(super) constant_parameters: Vec<bool>,
    /// The span of the first call.
    pub(super) called: Option<Span>,
    /// The data of an instance of a generic function.
    pub(super) instance: Option<Instance>,
    /// The number of generations from its class up to the class that declares it; 0 for the class's
    /// own functions.
    pub(super) generation: usize,
}

/// The kind of text being checked, which determines the names that may be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A constant, an array size, an annotation.
    Constant,
    /// The initializer of a member or the default of a parameter.
    Initializer,
    /// A function at file scope.
    FileFunction,
    /// A function of a class: helper, method or constructor.
    ClassFunction,
}

/// The function, initializer or constant being checked.
#[derive(Debug)]
pub(super) struct FunctionContext {
    pub(super) kind: Kind,
    /// True for the constructor.
    pub(super) is_constructor: bool,
    /// The [generation](FunctionInfo::generation) of the function.
    pub(super) generation: usize,
    /// The result type.
    pub(super) result: Type,
    /// Parameters and variables.
    pub(super) locals: Vec<Local>,
    /// The checker's data about each local, beside its tree.
    pub(super) local_info: Vec<LocalInfo>,
    /// The number of loops around the statement being checked, including `illuminance`.
    pub(super) loop_depth: u32,
    /// The number of switches inside the innermost loop.
    pub(super) switch_depth: u32,
    /// The number of `illuminance` statements around the statement being checked.
    pub(super) illuminance_depth: u32,
    /// True if a `return` with a value was seen.
    pub(super) returns_value: bool,
    /// The unused variables of closed scopes.
    pub(super) unused: Vec<(String, Span)>,
    /// Reads that may turn out to be of uninitialized variables.
    pub(super) flow: Flow,
    /// The facts collected so far.
    pub(super) facts: Facts,
}

/// The checker's data about a local, beside its tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalInfo {
    /// The span of the declaration.
    pub(super) span: Span,
    /// True for `const` variables.
    pub(super) read_only: bool,
    /// True if the text before this point assigns it.
    pub(super) assigned: bool,
    /// True if the text names it.
    pub(super) used: bool,
    /// The number of loops around its declaration.
    pub(super) loop_depth: u32,
}

impl FunctionContext {
    /// The context of text outside of functions.
    pub(super) fn outside() -> Self {
        FunctionContext::new(Kind::Constant, Type::Void)
    }

    pub(super) fn new(kind: Kind, result: Type) -> Self {
        FunctionContext {
            kind,
            is_constructor: false,
            generation: 0,
            result,
            locals: Vec::new(),
            local_info: Vec::new(),
            loop_depth: 0,
            switch_depth: 0,
            illuminance_depth: 0,
            returns_value: false,
            unused: Vec::new(),
            flow: Flow::default(),
            facts: Facts::default(),
        }
    }

    /// Adds a local that holds a value from the start.
    pub(super) fn add_local(&mut self, local: Local, info: LocalInfo) -> LocalId {
        self.locals.push(local);
        self.local_info.push(info);
        LocalId(self.locals.len() as u32 - 1)
    }
}

/// The name of the function that initializes an instance.
pub(super) const CONSTRUCTOR: &str = "constructor";

/// The limit on functions of one name in one scope.
const MAX_OVERLOADS: usize = 64;

/// The parts of a function's header.
struct Signature {
    result: Type,
    precise: bool,
    parameters: Vec<Passing>,
    /// Those of the last parameters.
    defaults: Vec<Expression>,
    locals: Vec<Local>,
}

impl Checker<'_> {
    /// Declares a function at file scope or in the class and returns its id; `None` if it is in
    /// error or repeats a prototype. `generation` counts from a class up to the ancestor that
    /// declares the function: functions of nearer generations replace those of farther ones.
    pub(super) fn declare_function(
        &mut self,
        function: &ast::Function,
        method: Option<Method>,
        generation: usize,
    ) -> Option<FunctionId> {
        self.check_function_qualifiers(function);
        self.check_name_free_to_use(&function.name);
        let signature = self.check_signature(function)?;
        let existing = self.find_same_parameters(&function.name, &signature)?;
        match existing {
            Existing::Taken => None,
            Existing::None => {
                Some(self.add_function(function, method, signature, generation, None))
            }
            Existing::Function(id) if self.function_info[id.0 as usize].generation > generation => {
                self.function_info[id.0 as usize].replaced = true;
                Some(self.add_function(function, method, signature, generation, Some(id)))
            }
            // An ordinary function is preferred to an instance of a generic one.
            Existing::Function(id) if self.replaces_instance(id) => {
                self.function_info[id.0 as usize].replaced = true;
                Some(self.add_function(function, method, signature, generation, Some(id)))
            }
            Existing::Function(id) if self.is_specialised(id) => None,
            Existing::Function(id) => self.redeclare_function(function, id, &signature),
        }
    }

    /// True if the function being declared, which is no instance, takes the place of one that nothing has called.
    fn replaces_instance(&self, existing: FunctionId) -> bool {
        let info = &self.function_info[existing.0 as usize];
        self.generic_size.is_none() && info.instance.is_some() && info.called.is_none()
    }

    /// True if the instance being declared exists as an ordinary function.
    fn is_specialised(&self, existing: FunctionId) -> bool {
        let info = &self.function_info[existing.0 as usize];
        self.generic_size.is_some() && info.instance.is_none()
    }

    /// Adds the constructor, which no text can call.
    pub(super) fn declare_constructor(
        &mut self,
        function: &ast::Function,
        generation: usize,
    ) -> Option<FunctionId> {
        let signature = Signature { result: Type::Void, ..self.check_signature(function)? };
        let id = self.push_function(function, None, signature, generation);
        self.function_info[id.0 as usize].is_constructor = true;
        Some(id)
    }

    fn check_signature(&mut self, function: &ast::Function) -> Option<Signature> {
        let result = match &function.result {
            Some(written) => self.resolve_type(written, TypePlace::Result),
            None => Type::Void,
        };
        let mut parameters = Vec::new();
        let mut locals = Vec::new();
        for parameter in &function.parameters {
            let ty = self.check_parameter_type(parameter, &function.name.name);
            parameters.push(self.check_passing(&parameter.qualifiers));
            let name = parameter.name.as_ref().map_or(String::new(), |name| name.name.clone());
            let precise = parameter.qualifiers.find(Qualifier::Precise).is_some();
            locals.push(Local { name, ty, precise });
        }
        if result == Type::Error || locals.iter().any(|local| local.ty == Type::Error) {
            // Calls of it give no errors either.
            if function.name.name != CONSTRUCTOR {
                self.declare_poisoned(&function.name);
            }
            return None;
        }
        let precise = function.qualifiers.find(Qualifier::Precise).is_some();
        let defaults = match function.name.name == CONSTRUCTOR {
            // Hosts set these by name.
            true => Some(Vec::new()),
            false => self.check_outside(Kind::Constant, |checker| {
                checker.check_defaults(&function.parameters, &parameters, &locals)
            }),
        };
        let Some(defaults) = defaults else {
            self.declare_poisoned(&function.name);
            return None;
        };
        Some(Signature { result, precise, parameters, defaults, locals })
    }

    /// Checks the values of parameters that calls may leave out: those of the last parameters, all of them inputs.
    /// They are constants, which calls share: expressions would grow from call to call. `None` after an error.
    fn check_defaults(
        &mut self,
        parameters: &[ast::Parameter],
        passing: &[Passing],
        locals: &[Local],
    ) -> Option<Vec<Expression>> {
        let mut defaults: Vec<Expression> = Vec::new();
        for (parameter, (passing, local)) in parameters.iter().zip(passing.iter().zip(locals)) {
            let Some(written) = &parameter.default else {
                if let Some(earlier) = defaults.last() {
                    let diagnostic = Diagnostic::new(
                        codes::MISPLACED_DEFAULT,
                        "only the last parameters may have default values",
                    )
                    .at(parameter.span, "has none")
                    .label(earlier.span, "the default of a parameter before");
                    self.report(diagnostic);
                    return None;
                }
                continue;
            };
            let value = self.check_initializer(&local.ty, written);
            if *passing != Passing::In {
                self.report(
                    Diagnostic::new(
                        codes::MISPLACED_DEFAULT,
                        "a parameter that passes a value out has no default value",
                    )
                    .at(parameter.span, "has a default value")
                    .help("overload the function instead"),
                );
                return None;
            }
            let values = self.evaluate_constant(&value, "a default value")?;
            defaults.push(Expression {
                kind: ExpressionKind::Constant(values),
                ty: value.ty.clone(),
                span: value.span,
            });
        }
        Some(defaults)
    }

    /// Declares the name of an erroneous function, so that calls of it give no further errors.
    pub(super) fn declare_poisoned(&mut self, name: &ast::Identifier) {
        let named = Named { entity: Entity::Error, span: name.span };
        self.innermost().insert(name.name.clone(), named);
    }

    fn check_parameter_type(&mut self, parameter: &ast::Parameter, function: &str) -> Type {
        if function != CONSTRUCTOR
            && let Some(annotation) = parameter.annotations.first()
        {
            self.report_misplaced_annotation(annotation.key.span);
        }
        let ty = self.resolve_type(&parameter.ty, TypePlace::Parameter);
        if !matches!(ty, Type::Reference(_)) {
            return ty;
        }
        let outward = [Qualifier::Out, Qualifier::InOut];
        if let Some(span) = outward.iter().find_map(|each| parameter.qualifiers.find(*each)) {
            self.report_bad_qualifier("`out`", span, "a reference, which only the host can set");
            return Type::Error;
        }
        if function == CONSTRUCTOR {
            let shown = self.show(&ty);
            self.report(
                Diagnostic::new(
                    codes::REFERENCE_AS_VALUE,
                    format!("a constructor has no parameter of type `{shown}`"),
                )
                .at(parameter.span, "refers to a shader, and is not a value")
                .help(
                    "declare a `public` member, which the host sets and the constructor can test",
                ),
            );
            return Type::Error;
        }
        ty
    }

    fn check_passing(&mut self, qualifiers: &ast::Qualifiers) -> Passing {
        let mut passing = Passing::In;
        let outward = [Qualifier::Out, Qualifier::InOut];
        let passes_out = outward.iter().any(|each| qualifiers.find(*each).is_some());
        for &(qualifier, span) in &qualifiers.list {
            match qualifier {
                Qualifier::Out => passing = Passing::Out,
                Qualifier::InOut => passing = Passing::InOut,
                Qualifier::In | Qualifier::Precise => {}
                Qualifier::Const if !passes_out => {}
                Qualifier::Const => self.report_bad_qualifier(
                    "`const`",
                    span,
                    "a parameter that passes a value out",
                ),
                Qualifier::Public
                | Qualifier::Private
                | Qualifier::Scratch
                | Qualifier::Texture
                | Qualifier::Output
                | Qualifier::Attribute
                | Qualifier::Uniform
                | Qualifier::Invariant => {
                    self.report_bad_qualifier(qualifier_name(qualifier), span, "a parameter");
                }
            }
        }
        passing
    }

    fn check_function_qualifiers(&mut self, function: &ast::Function) {
        for &(qualifier, span) in &function.qualifiers.list {
            match qualifier {
                Qualifier::Precise | Qualifier::Public | Qualifier::Private => {}
                Qualifier::Const
                | Qualifier::Scratch
                | Qualifier::Texture
                | Qualifier::Output
                | Qualifier::Attribute
                | Qualifier::Uniform
                | Qualifier::Invariant
                | Qualifier::In
                | Qualifier::Out
                | Qualifier::InOut => {
                    self.report_bad_qualifier(qualifier_name(qualifier), span, "a function");
                }
            }
        }
    }

    /// Reports that a qualifier has no meaning for `what`.
    pub(super) fn report_bad_qualifier(&mut self, name: &str, span: Span, what: &str) {
        self.report(
            Diagnostic::new(codes::BAD_QUALIFIER, format!("{name} is not allowed for {what}"))
                .at(span, "not allowed here"),
        );
    }

    /// Finds the function of this level with the same parameters; `None` if the name is in error.
    fn find_same_parameters(
        &mut self,
        name: &ast::Identifier,
        signature: &Signature,
    ) -> Option<Existing> {
        let Some(named) = self.innermost().get(&name.name).cloned() else {
            return Some(Existing::None);
        };
        let ids = match &named.entity {
            Entity::Functions(ids) => ids,
            Entity::Error => return None,
            Entity::Local(_)
            | Entity::Member(_)
            | Entity::Constant(..)
            | Entity::Struct(_)
            | Entity::Enumeration(_)
            | Entity::Class(_)
            | Entity::Module => {
                self.report_duplicate(name, &named);
                return Some(Existing::Taken);
            }
        };
        if ids.len() >= MAX_OVERLOADS {
            self.report(
                Diagnostic::new(
                    codes::TOO_MANY_OVERLOADS,
                    format!("there are too many functions called `{}`", name.name),
                )
                .at(name.span, "one too many")
                .note(format!("the limit is {MAX_OVERLOADS}")),
            );
            return Some(Existing::Taken);
        }
        let same = ids.iter().copied().find(|id| {
            let function = self.function(*id);
            let types = function.locals[..function.parameters.len()].iter().map(|local| &local.ty);
            types.eq(signature.locals.iter().map(|local| &local.ty))
        });
        Some(same.map_or(Existing::None, Existing::Function))
    }

    fn add_function(
        &mut self,
        function: &ast::Function,
        method: Option<Method>,
        signature: Signature,
        generation: usize,
        replaced: Option<FunctionId>,
    ) -> FunctionId {
        let id = self.push_function(function, method, signature, generation);
        self.add_to_overloads(&function.name, id, replaced);
        id
    }

    fn push_function(
        &mut self,
        function: &ast::Function,
        method: Option<Method>,
        signature: Signature,
        generation: usize,
    ) -> FunctionId {
        let id = FunctionId(self.module.functions.len() as u32);
        if let Some(class) = &mut self.class {
            class.functions.push(id);
        }
        self.module.functions.push(Arc::new(Function {
            name: function.name.name.clone(),
            documentation: function.documentation.clone(),
            class: self.class.as_ref().map(|class| class.id),
            method,
            result: signature.result,
            precise: signature.precise,
            parameters: signature.parameters,
            defaults: signature.defaults,
            locals: signature.locals,
            body: Vec::new(),
            span: function.span,
            end: function.body.as_ref().map_or(function.span, |body| last_byte(body.span)),
        }));
        self.function_info.push(FunctionInfo {
            has_body: function.body.is_some(),
            constant_parameters: constant_parameters(function),
            generation,
            ..FunctionInfo::default()
        });
        id
    }

    fn add_to_overloads(
        &mut self,
        name: &ast::Identifier,
        id: FunctionId,
        replaced: Option<FunctionId>,
    ) {
        let level = self.innermost();
        let named = level
            .entry(name.name.clone())
            .or_insert_with(|| Named { entity: Entity::Functions(Vec::new()), span: name.span });
        if let Entity::Functions(ids) = &mut named.entity {
            ids.retain(|other| Some(*other) != replaced);
            ids.push(id);
        }
    }

    /// Checks a second declaration with the same parameters, as a prototype and its definition.
    fn redeclare_function(
        &mut self,
        function: &ast::Function,
        id: FunctionId,
        signature: &Signature,
    ) -> Option<FunctionId> {
        let previous = Arc::clone(self.function(id));
        let constant = &self.function_info[id.0 as usize].constant_parameters;
        if previous.result != signature.result
            || previous.parameters != signature.parameters
            || *constant != constant_parameters(function)
        {
            self.report(
                Diagnostic::new(
                    codes::DECLARED_TWICE,
                    format!("`{}` differs from its earlier declaration", function.name.name),
                )
                .at(function.span, "same parameter types, but another result or other qualifiers")
                .label(previous.span, "declared here first"),
            );
            // A body here was meant as the definition, so the prototype is not reported as
            // undefined.
            self.function_info[id.0 as usize].has_body |= function.body.is_some();
            return None;
        }
        if let Some(default) = signature.defaults.first() {
            self.report(
                Diagnostic::new(
                    codes::MISPLACED_DEFAULT,
                    "default values belong to the first declaration of a function",
                )
                .at(default.span, "in a later one")
                .label(previous.span, "declared here first"),
            );
        }
        let info = &mut self.function_info[id.0 as usize];
        function.body.as_ref()?;
        if info.has_body {
            self.report(
                Diagnostic::new(
                    codes::DECLARED_TWICE,
                    format!("`{}` is defined twice with the same parameters", function.name.name),
                )
                .at(function.span, "defined again here")
                .label(previous.span, "defined here first"),
            );
            return None;
        }
        info.has_body = true;
        Some(id)
    }

    /// Checks the body of a declared function.
    pub(super) fn check_function_body(&mut self, function: &ast::Function, id: FunctionId) {
        let Some(body) = &function.body else { return };
        let declared = Arc::clone(self.function(id));
        let kind = if self.class.is_some() { Kind::ClassFunction } else { Kind::FileFunction };
        let mut context = FunctionContext::new(kind, declared.result.clone());
        context.is_constructor = self.function_info[id.0 as usize].is_constructor;
        context.generation = self.function_info[id.0 as usize].generation;
        let outer = std::mem::replace(&mut self.function, context);
        let errors = self.errors;
        self.scopes.push();
        self.declare_parameters(function, &declared);
        let (statements, falls_through) = self.check_statements(&body.statements);
        self.close_scope();
        if falls_through {
            self.check_end_of_function(function, &declared.result);
        }
        // Statements with errors may have lost uses of variables.
        if self.errors == errors {
            self.report_unused_variables();
        }
        let context = std::mem::replace(&mut self.function, outer);
        let finished = Function {
            locals: context.locals,
            body: statements,
            documentation: function.documentation.clone().or(declared.documentation.clone()),
            span: function.span,
            ..Function::clone(&declared)
        };
        self.module.functions[id.0 as usize] = Arc::new(finished);
        self.function_info[id.0 as usize].facts = Arc::new(context.facts);
        self.check_doubtful(id);
    }

    fn declare_parameters(&mut self, function: &ast::Function, declared: &Function) {
        for (index, parameter) in function.parameters.iter().enumerate() {
            let mut local = declared.locals[index].clone();
            local.name = parameter.name.as_ref().map_or(String::new(), |name| name.name.clone());
            let info = LocalInfo {
                span: parameter.span,
                read_only: parameter.qualifiers.find(Qualifier::Const).is_some()
                    && declared.parameters[index] == Passing::In,
                assigned: declared.parameters[index] != Passing::Out,
                used: true,
                loop_depth: 0,
            };
            let id = self.function.add_local(local, info);
            if let Some(name) = &parameter.name {
                self.declare(name, Entity::Local(id));
            }
        }
    }

    /// Reports prototypes without a definition that the text or hosts call.
    pub(super) fn check_all_functions_defined(&mut self) {
        let inherited = self.prelude.map_or(0, |prelude| prelude.module.functions.len());
        for index in inherited..self.module.functions.len() {
            let function = Arc::clone(&self.module.functions[index]);
            let info = &self.function_info[index];
            let wanted = info.called.is_some() || function.method.is_some();
            if info.has_body || info.replaced || !wanted {
                continue;
            }
            let diagnostic = Diagnostic::new(
                codes::MISSING_BODY,
                format!("`{}` is declared, but never defined", function.name),
            )
            .at(function.span, "has no body anywhere in this file");
            let called = info.called;
            self.report(match called {
                Some(call) => diagnostic.label(call, "called here"),
                None => diagnostic,
            });
        }
    }
}

/// The closing brace of a block.
fn last_byte(span: Span) -> Span {
    Span::new(span.file, span.end.saturating_sub(1).max(span.start), span.end)
}

fn constant_parameters(function: &ast::Function) -> Vec<bool> {
    let constant = |parameter: &ast::Parameter| parameter.qualifiers.find(Qualifier::Const);
    function.parameters.iter().map(|parameter| constant(parameter).is_some()).collect()
}

enum Existing {
    /// There is no function with these parameters.
    None,
    /// This function has the same parameters.
    Function(FunctionId),
    /// The name denotes something else, which has been reported.
    Taken,
}

/// The keyword of a qualifier, in quotes.
pub(super) fn qualifier_name(qualifier: Qualifier) -> &'static str {
    match qualifier {
        Qualifier::Public => "`public`",
        Qualifier::Private => "`private`",
        Qualifier::Scratch => "`scratch`",
        Qualifier::Texture => "`texture`",
        Qualifier::Output => "`output`",
        Qualifier::Attribute => "`attribute`",
        Qualifier::Const => "`const`",
        Qualifier::Uniform => "`uniform`",
        Qualifier::Precise => "`precise`",
        Qualifier::Invariant => "`invariant`",
        Qualifier::In => "`in`",
        Qualifier::Out => "`out`",
        Qualifier::InOut => "`inout`",
    }
}
