//! Classes.

use std::collections::BTreeSet;

use rtsl_ir::class::Annotation;
use rtsl_source::{Diagnostic, diagnostic_codes as codes, with_article};
use rtsl_spec::{Method, Role};
use rtsl_syntax::ast::{self, Qualifier};

use super::Checker;
use super::functions::{CONSTRUCTOR, Kind};
use super::inheritance::ClassItem;
use super::roles::role_list;
use super::scope::{Entity, Level};
use super::suggestions::suggest;
use super::types::{INT, TypePlace};
use crate::hir::{
    Class, ClassId, Constructor, ConstructorParameter, FunctionId, Member, MemberId, Passing,
    Storage, Type,
};

/// The limit on scalars in all members of one class.
const MAX_CLASS_LEAVES: u32 = 1 << 22;

/// A class of the unit.
#[derive(Debug)]
pub(super) struct ClassDeclaration<'a> {
    pub(super) ast: &'a ast::Class,
    /// The index of the class that it inherits from.
    pub(super) parent: Option<usize>,
    pub(super) roles: Vec<Role>,
    /// True if some base was not found.
    pub(super) roles_unknown: bool,
    /// The module that declares it.
    pub(super) home: Option<usize>,
    /// Its own members that its text does not name.
    pub(super) unread: Vec<MemberId>,
    /// Its own functions without parameters that set something and that its text does not call.
    pub(super) uncalled: Vec<FunctionId>,
}

/// The class being checked.
#[derive(Debug)]
pub(super) struct ClassContext {
    pub(super) id: ClassId,
    pub(super) name: String,
    pub(super) roles: Vec<Role>,
    /// True if some base was not found, so that state variables of any role may be meant.
    pub(super) roles_unknown: bool,
    pub(super) names: Level,
    pub(super) members: Vec<Member>,
    /// For each member, the generation of the class that declares it.
    pub(super) member_generations: Vec<usize>,
    /// The members that the text names.
    pub(super) named: BTreeSet<MemberId>,
    pub(super) constructor: Option<Constructor>,
    methods: Vec<(Method, FunctionId)>,
    /// All functions, also those that others have replaced, those of the farthest ancestor first.
    pub(super) functions: Vec<FunctionId>,
}

impl ClassContext {
    /// The own members that the text does not name. Outputs are for hosts.
    fn unread(&self) -> Vec<MemberId> {
        let members = (0..).map(MemberId).zip(self.members.iter().zip(&self.member_generations));
        let unread = members.filter(|(id, (member, generation))| {
            **generation == 0 && member.storage != Storage::Output && !self.named.contains(id)
        });
        unread.map(|(id, _)| id).collect()
    }
}

/// A function whose body is to be checked.
struct Pending<'a> {
    ast: &'a ast::Function,
    id: FunctionId,
    item: ClassItem<'a>,
}

impl<'a> Checker<'a> {
    /// Checks a class and adds it to the module.
    pub(super) fn check_class(&mut self, class: &'a ast::Class) {
        let index = self.open_class(class);
        let items = self.items_with_inherited(index);
        self.declare_structs_and_constants(&items);
        let mut functions = self.declare_functions(&items);
        self.declare_members(&items);
        functions.extend(self.declare_constructors(&items));
        self.check_assertions(&items);
        self.check_elements();
        self.check_bodies(&functions);
        self.check_uncalled_functions(&functions);
        self.add_implied_methods(class);
        self.close_class(class);
    }

    fn open_class(&mut self, class: &'a ast::Class) -> usize {
        let bases = self.check_bases(class);
        let index = self.classes.len();
        self.classes.push(ClassDeclaration {
            ast: class,
            parent: bases.parent,
            roles: bases.roles.clone(),
            roles_unknown: bases.unknown,
            home: self.modules.home(),
            unread: Vec::new(),
            uncalled: Vec::new(),
        });
        self.declare(&class.name, Entity::Class(index));
        self.class = Some(ClassContext {
            id: ClassId(self.module.classes.len() as u32),
            name: class.name.name.clone(),
            roles: bases.roles,
            roles_unknown: bases.unknown,
            names: Level::new(),
            members: Vec::new(),
            member_generations: Vec::new(),
            named: BTreeSet::new(),
            constructor: None,
            methods: Vec::new(),
            functions: Vec::new(),
        });
        index
    }

    fn close_class(&mut self, class: &ast::Class) {
        let Some(context) = self.class.take() else { return };
        self.classes[context.id.0 as usize].unread = context.unread();
        let mut methods = context.methods;
        methods.sort_by_key(|(method, _)| *method);
        self.module.classes.push(Class {
            name: context.name,
            roles: context.roles,
            documentation: class.documentation.clone(),
            members: context.members,
            constructor: context.constructor,
            methods,
            is_imported: self.modules.home().is_some(),
            span: class.span,
        });
    }

    /// Runs `check` for an item, with the names of its module. Warnings about inherited items are dropped, since they
    /// were reported for the base.
    fn for_item(&mut self, item: ClassItem<'a>, check: impl FnOnce(&mut Self)) {
        let outer = std::mem::replace(&mut self.silent, item.generation > 0);
        self.with_names_of(item.home, check);
        self.silent = outer;
    }

    fn check_assertions(&mut self, items: &[ClassItem<'a>]) {
        for item in items {
            if let ast::Item::Assertion(assertion) = item.item {
                self.for_item(*item, |checker| checker.check_file_assertion(assertion));
            }
        }
    }

    fn declare_structs_and_constants(&mut self, items: &[ClassItem<'a>]) {
        // Those of the farthest ancestors come first, and do not depend on those of a class below them.
        for items in items.chunk_by(|one, other| one.home == other.home) {
            let plain = items.iter().map(|item| item.item).filter(|item| match item {
                ast::Item::Variable(variable) => is_constant(variable),
                _ => true,
            });
            let plain: Vec<&ast::Item> = plain.collect();
            self.with_names_of(items[0].home, |checker| {
                checker.declare_in_order(&plain, Self::declare_class_constant);
            });
        }
    }

    fn declare_class_constant(&mut self, variable: &'a ast::Variable) {
        if let Some(annotation) = variable.annotations.first() {
            self.report_misplaced_annotation(annotation.key.span);
        }
        if let Some(span) = variable.qualifiers.find(Qualifier::Texture) {
            self.report_bad_qualifier("`texture`", span, "a constant");
        }
        self.declare_constant(variable);
    }

    fn declare_members(&mut self, items: &[ClassItem<'a>]) {
        for item in items {
            if let ast::Item::Variable(variable) = item.item
                && !is_constant(variable)
            {
                let generation = item.generation;
                self.for_item(*item, |checker| checker.declare_member(variable, generation));
            }
        }
        let members = self.class.as_ref().map_or(&[][..], |class| &class.members);
        let leaves = members
            .iter()
            .fold(0_u32, |sum, member| sum.saturating_add(self.leaf_count(&member.ty)));
        if leaves > MAX_CLASS_LEAVES
            && let Some(member) = members.last()
        {
            let span = member.span;
            self.report(
                Diagnostic::new(codes::TYPE_TOO_LARGE, "the members of this class are too large")
                    .at(span, "the last of them")
                    .note(format!("they may have at most {MAX_CLASS_LEAVES} numbers"))
                    .help("large tables are buffers: members declared with `[]`, set by the host"),
            );
        }
    }

    fn declare_functions(&mut self, items: &[ClassItem<'a>]) -> Vec<Pending<'a>> {
        let mut pending = Vec::new();
        for item in items {
            let ast::Item::Function(function) = item.item else { continue };
            let generation = item.generation;
            if function.name.name == CONSTRUCTOR {
                continue;
            }
            self.for_item(*item, |checker| {
                if checker.is_generic(function) {
                    checker.declare_generic(function, generation);
                } else if let Some(id) = checker.check_class_function(function, generation) {
                    pending.push(Pending { ast: function, id, item: *item });
                }
            });
        }
        pending
    }

    /// Runs after the members are declared, so that defaults that name a member can be
    /// distinguished from unknown names.
    fn declare_constructors(&mut self, items: &[ClassItem<'a>]) -> Vec<Pending<'a>> {
        let mut pending = Vec::new();
        for item in items {
            let ast::Item::Function(function) = item.item else { continue };
            let generation = item.generation;
            if function.name.name != CONSTRUCTOR {
                continue;
            }
            self.for_item(*item, |checker| {
                if let Some(id) = checker.check_constructor(function, generation) {
                    pending.push(Pending { ast: function, id, item: *item });
                }
            });
        }
        pending
    }

    /// Checks the bodies of functions. Those that others have replaced follow if `super` calls them.
    fn check_bodies(&mut self, functions: &[Pending<'a>]) {
        let mut waiting: Vec<&Pending<'a>> = functions.iter().collect();
        loop {
            let is_ready = |function: &&Pending<'a>| {
                let info = &self.function_info[function.id.0 as usize];
                !info.replaced || info.called_by_super
            };
            let (ready, others): (Vec<_>, Vec<_>) = waiting.into_iter().partition(is_ready);
            if ready.is_empty() {
                break;
            }
            for function in ready {
                self.for_item(function.item, |checker| {
                    checker.check_function_body(function.ast, function.id);
                });
            }
            waiting = others;
        }
        self.check_instances();
    }

    /// Warns about functions that are never called, by hosts or the text, although their names
    /// suggest that they should be: those with nearly the name of an interface method, and those
    /// with the name of the class.
    fn check_uncalled_functions(&mut self, functions: &[Pending<'a>]) {
        let facts = functions.iter().map(|each| &self.function_info[each.id.0 as usize].facts);
        let called: BTreeSet<FunctionId> =
            facts.flat_map(|facts| facts.calls.iter().map(|call| call.callee)).collect();
        for Pending { ast: function, id, item } in functions {
            let name = &function.name;
            if !called.contains(id) && item.generation == 0 {
                self.check_cpp_constructor(function);
            }
            let is_method = Method::from_name(&name.name).is_some() || name.name == CONSTRUCTOR;
            if is_method || !has_interface_signature(function) || called.contains(id) {
                continue;
            }
            let roles = self.class.as_ref().map_or(Vec::new(), |class| class.roles.clone());
            let methods = roles.iter().flat_map(|role| role.methods()).map(Method::name);
            if let Some(similar) = self.similar_of(&name.name, methods) {
                let diagnostic = Diagnostic::new(
                    codes::MISSPELLED_METHOD,
                    format!("`{}` is not an interface method, and is never called", name.name),
                )
                .at(name.span, "never called");
                let diagnostic = suggest(diagnostic, name.span, Some(similar));
                self.for_item(*item, |checker| checker.report(diagnostic));
            } else if item.generation == 0
                && self.function_info[id.0 as usize].facts.sets_something()
                && let Some(declaration) = self.classes.last_mut()
            {
                declaration.uncalled.push(*id);
            }
        }
    }

    /// Warns about a function with the name of its class, which would be a constructor in C++.
    fn check_cpp_constructor(&mut self, function: &ast::Function) {
        let name = &function.name;
        if self.class.as_ref().is_none_or(|class| class.name != name.name) {
            return;
        }
        let start = function.result.as_ref().map_or(name.span, |result| result.span);
        let header = start.to(name.span);
        self.report(
            Diagnostic::new(
                codes::NAMED_LIKE_CLASS,
                format!("`{}` is an ordinary function, and is never called", name.name),
            )
            .at(name.span, "the class's name has no special meaning")
            .suggest(
                "the function that initializes an instance is called",
                header,
                CONSTRUCTOR,
            ),
        );
    }

    fn add_implied_methods(&mut self, class: &ast::Class) {
        let present: Vec<(Method, FunctionId)> =
            self.class.iter().flat_map(|class| class.methods.iter().copied()).collect();
        let implied = self.implied_functions(&present);
        let functions: Vec<&ast::Function> =
            implied.iter().map(|(function, _)| *function).collect();
        if !self.spend_implied(&functions, class) {
            return;
        }
        let outer = std::mem::replace(&mut self.in_prelude, true);
        let mut declared = Vec::new();
        for (function, method) in implied {
            if let Some(id) = self.declare_function(function, method, 0) {
                if let Some(method) = method {
                    self.add_method(method, id);
                }
                self.function_info[id.0 as usize].is_implied = true;
                declared.push((function, id));
            }
        }
        for (function, id) in declared {
            self.check_function_body(function, id);
        }
        self.in_prelude = outer;
    }

    fn add_method(&mut self, method: Method, id: FunctionId) {
        if let Some(class) = &mut self.class {
            class.methods.retain(|(other, _)| *other != method);
            class.methods.push((method, id));
        }
    }

    /// A helper or an interface method.
    fn check_class_function(
        &mut self,
        function: &ast::Function,
        generation: usize,
    ) -> Option<FunctionId> {
        let Some(method) = Method::from_name(&function.name.name) else {
            return self.declare_function(function, None, generation);
        };
        let class = self.class.as_ref()?;
        let is_own = method.roles().iter().any(|role| class.roles.contains(role));
        let has_signature = has_interface_signature(function);
        if is_own {
            if !has_signature {
                self.report_signature(function, method);
                self.declare_poisoned(&function.name);
                return None;
            }
            let id = self.declare_function(function, Some(method), generation)?;
            self.add_method(method, id);
            return Some(id);
        }
        if has_signature {
            if !class.roles_unknown {
                self.report_method_of_other_role(function, method);
            }
            self.declare_poisoned(&function.name);
            return None;
        }
        self.declare_function(function, None, generation)
    }

    fn report_signature(&mut self, function: &ast::Function, method: Method) {
        let name = method.name();
        self.report(
            Diagnostic::new(
                codes::BAD_METHOD_SIGNATURE,
                format!("the interface method `{name}` must be `void {name}()`"),
            )
            .at(function.span, "other parameters or another result")
            .note("interface methods receive and return values through state variables")
            .help("if it is a helper function, give it another name"),
        );
    }

    fn report_method_of_other_role(&mut self, function: &ast::Function, method: Method) {
        let Some(class) = &self.class else { return };
        let own = role_list(&class.roles, "and");
        let others = role_list(method.roles(), "or");
        let class_name = class.name.clone();
        let methods: Vec<&str> =
            class.roles.iter().flat_map(|role| role.methods()).map(Method::name).collect();
        let diagnostic = Diagnostic::new(
            codes::METHOD_OF_OTHER_ROLE,
            format!("{own} cannot have an interface method of {others}"),
        )
        .at(function.name.span, format!("`{}` is a method of {others}", method.name()))
        .note(format!("the class `{class_name}` is {}", with_article(&own)))
        .note(format!("its methods are {}", super::references::quoted_list(&methods)));
        self.report(diagnostic);
    }

    fn check_constructor(
        &mut self,
        function: &ast::Function,
        generation: usize,
    ) -> Option<FunctionId> {
        if let Some(previous) = self.class.as_ref().and_then(|class| class.constructor.as_ref()) {
            let previous = previous.function;
            if self.function_info[previous.0 as usize].generation == generation {
                let span = self.function(previous).span;
                self.report(
                    Diagnostic::new(codes::BAD_CONSTRUCTOR, "a class has one constructor")
                        .at(function.span, "a second one")
                        .label(span, "the first"),
                );
                return None;
            }
            self.function_info[previous.0 as usize].replaced = true;
        }
        if let Some(result) = &function.result
            && result.name.name != "void"
        {
            self.report(
                Diagnostic::new(codes::BAD_CONSTRUCTOR, "a constructor returns nothing")
                    .at(result.span, "remove the type"),
            );
        }
        let parameters = self.check_constructor_parameters(function);
        let id = self.declare_constructor(function, generation)?;
        if function.body.is_none() {
            self.report(
                Diagnostic::new(codes::BAD_CONSTRUCTOR, "this constructor has no body")
                    .at(function.span, "expected `{ ... }`"),
            );
            self.function_info[id.0 as usize].has_body = true;
        }
        for (index, parameter) in function.parameters.iter().enumerate() {
            if self.function(id).parameters[index] != Passing::In {
                self.report(
                    Diagnostic::new(
                        codes::BAD_CONSTRUCTOR,
                        "parameters of a constructor must be inputs",
                    )
                    .at(parameter.span, "remove `out` or `inout`"),
                );
            }
        }
        if let Some(class) = &mut self.class {
            class.constructor = Some(Constructor { function: id, parameters });
        }
        Some(id)
    }

    fn check_constructor_parameters(
        &mut self,
        function: &ast::Function,
    ) -> Vec<ConstructorParameter> {
        let mut parameters = Vec::new();
        for parameter in &function.parameters {
            if parameter.name.is_none() {
                self.report(
                    Diagnostic::new(
                        codes::BAD_CONSTRUCTOR,
                        "a parameter of a constructor needs a name",
                    )
                    .at(parameter.span, "hosts set it by its name"),
                );
            }
            let mut annotations: Vec<Annotation> = self.check_annotations(&parameter.annotations);
            self.add_choices(&parameter.ty, &INT, &mut annotations);
            let default = parameter.default.as_ref().and_then(|default| {
                let ty = self.resolve_type(&parameter.ty, TypePlace::Parameter);
                let value = self.check_outside(Kind::Initializer, |checker| {
                    checker.check_initializer(&ty, default)
                });
                (value.ty != Type::Error).then_some(value)
            });
            if let (Some(name), Some(default)) = (&parameter.name, &default) {
                self.check_default(&name.name, default, &annotations);
            }
            parameters.push(ConstructorParameter { default, annotations, span: parameter.span });
        }
        parameters
    }
}

fn is_constant(variable: &ast::Variable) -> bool {
    variable.qualifiers.find(Qualifier::Const).is_some()
}

/// True if the function is declared as `void name()`.
fn has_interface_signature(function: &ast::Function) -> bool {
    let returns_nothing = function
        .result
        .as_ref()
        .is_none_or(|result| result.name.name == "void" && result.sizes.is_empty());
    returns_nothing && function.parameters.is_empty()
}
