//! Calls of inherited functions that a class has replaced: `super.BSDF()`.

use std::collections::BTreeMap;

use rtsl_source::{Diagnostic, Span, diagnostic_codes as codes};
use rtsl_syntax::ast;

use super::Checker;
use super::expressions::error_expression;
use super::functions::Kind;
use super::suggestions::suggest;
use crate::hir::{Expression, FunctionId, Type};

/// The receiver of calls of inherited functions.
pub(super) const SUPER: &str = "super";

impl Checker<'_> {
    /// Checks a call of a function as the classes above the one that declares the caller have it.
    pub(super) fn check_super_call(
        &mut self,
        name: &ast::Identifier,
        arguments: &[ast::Expression],
        span: Span,
    ) -> Expression {
        self.note_inherited(&name.name);
        let arguments = self.check_arguments(arguments);
        if self.class.is_none() || self.function.kind != Kind::ClassFunction {
            self.report(
                Diagnostic::new(codes::NO_INHERITED, "`super` is for functions of classes")
                    .at(span, "not in a function of a class"),
            );
            return error_expression(span);
        }
        let inherited = self.inherited_functions(&name.name);
        if inherited.is_empty() {
            return self.report_no_inherited(name, span);
        }
        if arguments.iter().any(|argument| argument.ty == Type::Error) {
            return error_expression(span);
        }
        match self.choose_among(&name.name, &inherited, &arguments) {
            Ok(id) => {
                self.function_info[id.0 as usize].called_by_super = true;
                self.note_function(id, name.span);
                self.call_function(id, arguments, span)
            }
            Err(diagnostic) => {
                self.report(diagnostic.at(span, ""));
                error_expression(span)
            }
        }
    }

    /// The functions of this name that the class inherits from generations above that of the caller: of those with the
    /// same parameters the nearest.
    fn inherited_functions(&self, name: &str) -> Vec<FunctionId> {
        let Some(class) = &self.class else { return Vec::new() };
        let generation = self.function.generation;
        let mut nearest: BTreeMap<String, FunctionId> = BTreeMap::new();
        for id in &class.functions {
            let (function, own) = (self.function(*id), &self.function_info[id.0 as usize]);
            if function.name != name || own.generation <= generation {
                continue;
            }
            let parameters = &function.locals[..function.parameters.len()];
            let types: Vec<String> = parameters.iter().map(|local| self.show(&local.ty)).collect();
            // Functions of farther generations come first.
            nearest.insert(types.join(","), *id);
        }
        nearest.into_values().collect()
    }

    fn report_no_inherited(&mut self, name: &ast::Identifier, span: Span) -> Expression {
        let generation = self.function.generation;
        let functions = self.class.iter().flat_map(|class| &class.functions);
        let names: Vec<String> = functions
            .filter(|id| self.function_info[id.0 as usize].generation > generation)
            .map(|id| self.function(*id).name.clone())
            .collect();
        let message = format!("no class above has a function `{}`", name.name);
        let mut diagnostic =
            Diagnostic::new(codes::NO_INHERITED, message).at(name.span, "not inherited");
        if names.is_empty() {
            diagnostic = diagnostic.note("the class inherits no functions");
        }
        let similar = self.similar_of(&name.name, names.iter().map(String::as_str));
        self.report(suggest(diagnostic, name.span, similar));
        error_expression(span)
    }
}
