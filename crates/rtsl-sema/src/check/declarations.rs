//! Declarations: items at file scope, structs, constants, variables of functions.

use std::collections::BTreeMap;
use std::sync::Arc;

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast::{self, Qualifier};

use super::Checker;
use super::constructors::is_open;
use super::functions::{FunctionContext, Kind, LocalInfo, qualifier_name};
use super::order::declaration_order;
use super::scope::{Entity, Named};
use super::types::TypePlace;
use crate::hir::{Expression, ExpressionKind, Local, StatementKind, Struct, StructId, Type};

impl<'a> Checker<'a> {
    /// Checks one item at file scope.
    pub(super) fn check_file_item(&mut self, item: &'a ast::Item) {
        match item {
            ast::Item::Struct(declaration) => {
                self.declare_struct(declaration);
            }
            ast::Item::Enumeration(declaration) => self.declare_enumeration(declaration),
            ast::Item::Assertion(assertion) => self.check_file_assertion(assertion),
            ast::Item::Variable(variable) => self.declare_file_variable(variable),
            ast::Item::Function(function) if self.is_generic(function) => {
                self.declare_generic(function, 0);
            }
            ast::Item::Function(function) => {
                if let Some(id) = self.declare_function(function, None, 0) {
                    self.check_function_body(function, id);
                }
            }
            ast::Item::Class(class) => self.check_class(class),
        }
        self.check_instances();
    }

    /// Checks the items of the prelude, which may refer to each other in any order.
    pub(super) fn check_prelude_items(&mut self, items: &[&'a ast::Item]) {
        self.declare_in_order(items, Self::declare_file_variable);
        let mut declared = Vec::new();
        for item in items {
            if let ast::Item::Function(function) = item
                && let Some(id) = self.declare_function(function, None, 0)
            {
                declared.push((function, id));
            }
        }
        for (function, id) in declared {
            self.check_function_body(function, id);
        }
        self.check_all_functions_defined();
    }

    /// Declares the structs, enumerations and constants among `items`, which may refer to each other in any
    /// order.
    pub(super) fn declare_in_order(
        &mut self,
        items: &[&'a ast::Item],
        declare_variable: fn(&mut Self, &'a ast::Variable),
    ) {
        let order = declaration_order(items);
        for index in &order.circular {
            let name = match items[*index] {
                ast::Item::Struct(declaration) => &declaration.name,
                ast::Item::Enumeration(declaration) => &declaration.name,
                ast::Item::Variable(variable) => &variable.name,
                ast::Item::Assertion(_) | ast::Item::Function(_) | ast::Item::Class(_) => continue,
            };
            self.report(
                Diagnostic::new(
                    codes::CIRCULAR_DECLARATION,
                    format!("`{}` depends on itself", name.name),
                )
                .at(name.span, "directly, or through the names it uses"),
            );
            self.declare(name, Entity::Error);
        }
        for index in order.sorted {
            if order.circular.contains(&index) {
                continue;
            }
            match items[index] {
                ast::Item::Struct(declaration) => {
                    self.declare_struct(declaration);
                }
                ast::Item::Enumeration(declaration) => self.declare_enumeration(declaration),
                ast::Item::Variable(variable) => declare_variable(self, variable),
                ast::Item::Assertion(_) | ast::Item::Function(_) | ast::Item::Class(_) => {}
            }
        }
    }

    /// Declares a struct in the innermost scope.
    pub(super) fn declare_struct(&mut self, declaration: &ast::Struct) -> Option<StructId> {
        let mut fields: Vec<(String, Type)> = Vec::new();
        let mut spans: BTreeMap<&str, Span> = BTreeMap::new();
        let mut failed = false;
        for field in &declaration.fields {
            let ty = self.resolve_type(&field.ty, TypePlace::Field);
            failed |= ty == Type::Error;
            self.check_name_free_to_use(&field.name);
            if let Some(&first) = spans.get(field.name.name.as_str()) {
                let name = &field.name.name;
                self.report(
                    Diagnostic::new(codes::DECLARED_TWICE, format!("`{name}` is declared twice"))
                        .at(field.name.span, "declared again here")
                        .label(first, "a field of that name is declared here"),
                );
                continue;
            }
            spans.insert(&field.name.name, field.name.span);
            fields.push((field.name.name.clone(), ty));
        }
        if failed || fields.is_empty() {
            if fields.is_empty() {
                self.report(
                    Diagnostic::new(codes::EMPTY_STRUCT, "a struct needs at least one field")
                        .at(declaration.span, "no fields"),
                );
            }
            self.declare(&declaration.name, Entity::Error);
            return None;
        }
        let id = StructId(self.module.structs.len() as u32);
        self.module.structs.push(Arc::new(Struct { name: declaration.name.name.clone(), fields }));
        self.measure_struct(id, declaration.span);
        self.note_fields(id, declaration);
        // Unnamed structs have generated names that no text can write; those are not checked.
        if declaration
            .name
            .name
            .starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        {
            self.declare(&declaration.name, Entity::Struct(id));
        } else {
            let named = Named { entity: Entity::Struct(id), span: declaration.name.span };
            self.innermost().insert(declaration.name.name.clone(), named);
        }
        Some(id)
    }

    fn declare_file_variable(&mut self, variable: &ast::Variable) {
        for &(qualifier, span) in &variable.qualifiers.list {
            if !matches!(qualifier, Qualifier::Const | Qualifier::Precise | Qualifier::Invariant) {
                self.report_bad_qualifier(
                    qualifier_name(qualifier),
                    span,
                    "a constant at file scope",
                );
            }
        }
        if let Some(annotation) = variable.annotations.first() {
            self.report_misplaced_annotation(annotation.key.span);
        }
        if variable.qualifiers.find(Qualifier::Const).is_none() {
            self.report(
                Diagnostic::new(
                    codes::FILE_VARIABLE,
                    format!("`{}` is a variable at file scope", variable.name.name),
                )
                .at(variable.span, "only constants are allowed at file scope")
                .help("make it `const`, or a member of the class"),
            );
            self.declare(&variable.name, Entity::Error);
            return;
        }
        self.declare_constant(variable);
    }

    /// Declares a constant of a file or class; its value must be a constant expression.
    pub(super) fn declare_constant(&mut self, variable: &ast::Variable) {
        let outer = std::mem::replace(&mut self.function, FunctionContext::outside());
        let entity = self.constant_entity(variable);
        self.function = outer;
        self.declare(&variable.name, entity);
    }

    fn constant_entity(&mut self, variable: &ast::Variable) -> Entity {
        let ty = self.resolve_type(&variable.ty, TypePlace::Variable);
        let Some(initializer) = &variable.initializer else {
            self.report_constant_without_value(variable);
            return Entity::Error;
        };
        let value = self.check_initializer(&ty, initializer);
        if ty == Type::Error {
            return Entity::Error;
        }
        match self.evaluate_constant(&value, "the value of a constant") {
            Some(values) => Entity::Constant(value.ty.clone(), values),
            None => Entity::Error,
        }
    }

    fn report_constant_without_value(&mut self, variable: &ast::Variable) {
        self.report(
            Diagnostic::new(
                codes::BAD_INITIALIZER,
                format!("the constant `{}` has no value", variable.name.name),
            )
            .at(variable.span, "expected `= ...`"),
        );
    }

    /// Declares a variable of a function and returns its statement, or nothing for a constant.
    pub(super) fn check_local(&mut self, variable: &ast::Variable) -> Option<StatementKind> {
        self.check_local_qualifiers(variable);
        let ty = self.resolve_type(&variable.ty, TypePlace::Variable);
        let value = variable.initializer.as_ref().map(|each| self.check_initializer(&ty, each));
        let is_const = variable.qualifiers.find(Qualifier::Const).is_some();
        if is_const && value.is_none() {
            self.report_constant_without_value(variable);
        }
        if is_const
            && let Some(value) = &value
            && let Some(entity) = self.known_constant(value)
        {
            self.declare(&variable.name, entity);
            return None;
        }
        let failed = value.as_ref().is_some_and(|value| value.ty == Type::Error);
        let ty = match &value {
            Some(value) if !failed && is_open(&ty) => value.ty.clone(),
            None if is_open(&ty) => self.report_open_variable(variable),
            _ if failed && is_open(&ty) => Type::Error,
            _ => ty,
        };
        let id = self.add_variable(variable, ty, value.is_some() || is_const, is_const);
        Some(StatementKind::Declare(id, value))
    }

    fn add_variable(
        &mut self,
        variable: &ast::Variable,
        ty: Type,
        assigned: bool,
        read_only: bool,
    ) -> crate::hir::LocalId {
        let info = LocalInfo {
            span: variable.name.span,
            read_only,
            assigned,
            used: false,
            loop_depth: self.function.loop_depth,
        };
        let local = Local {
            name: variable.name.name.clone(),
            ty,
            precise: variable.qualifiers.find(Qualifier::Precise).is_some(),
        };
        let id = self.function.add_local(local, info);
        self.declare(&variable.name, Entity::Local(id));
        id
    }

    /// Folds a `const` variable of a function to a constant if its value is known. Otherwise it is
    /// a variable that cannot be assigned.
    fn known_constant(&mut self, value: &Expression) -> Option<Entity> {
        if value.ty == Type::Error {
            return None;
        }
        if let ExpressionKind::Constant(values) = &value.kind {
            return Some(Entity::Constant(value.ty.clone(), Arc::clone(values)));
        }
        let values = self.evaluate(value, true).ok()?;
        Some(Entity::Constant(value.ty.clone(), values.into()))
    }

    fn report_open_variable(&mut self, variable: &ast::Variable) -> Type {
        self.report(
            Diagnostic::new(codes::MISPLACED_BUFFER, "an array without a size is not allowed here")
                .at(variable.span, "give it a size, or an initial value that has one"),
        );
        Type::Error
    }

    fn check_local_qualifiers(&mut self, variable: &ast::Variable) {
        for &(qualifier, span) in &variable.qualifiers.list {
            if !matches!(qualifier, Qualifier::Const | Qualifier::Precise | Qualifier::Invariant) {
                self.report_bad_qualifier(
                    qualifier_name(qualifier),
                    span,
                    "a variable of a function",
                );
            }
        }
        if let Some(annotation) = variable.annotations.first() {
            self.report_misplaced_annotation(annotation.key.span);
        }
    }

    /// Reports that annotations belong to members and parameters of the constructor.
    pub(super) fn report_misplaced_annotation(&mut self, span: Span) {
        self.report(
            Diagnostic::new(
                codes::MISPLACED_ANNOTATION,
                "annotations are allowed for parameters of instances only",
            )
            .at(span, "not one")
            .note("these are public members and the parameters of `constructor`"),
        );
    }

    /// Checks text outside of functions: an initializer or default.
    pub(super) fn check_outside<T>(&mut self, kind: Kind, check: impl FnOnce(&mut Self) -> T) -> T {
        let context = FunctionContext::new(kind, Type::Void);
        let outer = std::mem::replace(&mut self.function, context);
        let result = check(self);
        self.function = outer;
        result
    }
}
