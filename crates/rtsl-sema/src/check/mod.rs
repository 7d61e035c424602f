//! The checker: from the syntax tree to the typed tree, or to what is wrong with the text.
//!
//! # Order of work
//!
//! [`check_unit`] goes through the items of a file in order, so that a name is known from its
//! declaration on. Inside a class (and in the prelude) names are known everywhere, so there
//! the work has phases, one in each short function of `classes`: structs and constants, signatures,
//! members, the constructor, bodies, implied methods. While bodies are checked, facts are
//! collected: who calls whom, and who does what only some methods may do. `call_graph` and
//! `roles` judge those at the end.
//!
//! # Errors
//!
//! What could not be checked has the type `Type::Error`, which silences what follows from it, so
//! that one mistake gives one message and several mistakes several. An inherited body is checked
//! again in the context of each class; its warnings are reported once, and so is an error
//! with the same code at the same place.
//!
//! # Depth
//!
//! The parser bounds the depth of its tree, and recursion here follows that tree. What
//! declarations can chain without bound (calls, constants, structs, bases) is walked without recursion
//! or has a limit of its own.

mod call_graph;
mod calls;
mod candidates;
mod classes;
mod constants;
mod constructors;
mod control;
mod declarations;
mod effects;
mod elements;
mod evaluator;
mod expressions;
mod facts;
mod folding;
mod foreign;
mod functions;
mod implied;
mod inheritance;
mod initializers;
mod lost_state;
mod lvalues;
mod members;
mod nan;
mod operators;
mod order;
mod places;
mod references;
mod roles;
mod scope;
mod statements;
mod suggestions;
mod types;

use std::collections::BTreeSet;
use std::sync::Arc;

use rtsl_source::{Code, Diagnostic, Diagnostics, Span, deep_stack};
use rtsl_syntax::ast;

use crate::hir::Module;
use classes::{ClassContext, ClassDeclaration};
use functions::{FunctionContext, FunctionInfo};
use scope::{Level, Scopes};
use types::StructInfo;

pub(crate) use types::plain_type_name;

/// The functions that every unit may call, checked once for many units.
#[derive(Debug, Default)]
pub struct Prelude {
    module: Module,
    names: Level,
    function_info: Vec<FunctionInfo>,
    struct_info: Vec<StructInfo>,
    /// `class rt_ImpliedMaterial`, whose methods materials get that lack them.
    implied: Vec<ast::Class>,
}

impl Prelude {
    /// What the prelude declares; the ids of its functions are the same in every unit checked on it.
    pub fn module(&self) -> &Module {
        &self.module
    }
}

/// Checks the prelude's text. Its functions may call each other in any order.
pub fn check_prelude(units: &[ast::TranslationUnit], diagnostics: &mut Diagnostics) -> Prelude {
    let mut checker =
        Checker { in_prelude: true, ..Checker::new(None, std::mem::take(diagnostics)) };
    let items: Vec<&ast::Item> = units.iter().flat_map(|unit| &unit.items).collect();
    let implied = implied::take_implied_classes(&items);
    checker.check_prelude_items(&items);
    checker.check_call_graph();
    *diagnostics = checker.diagnostics;
    Prelude {
        module: checker.module,
        names: checker.file,
        function_info: checker.function_info,
        struct_info: checker.struct_info,
        implied,
    }
}

/// Checks one translation unit on top of the prelude. Where `diagnostics` has errors afterwards
/// the module is of no use but for completion.
pub fn check_unit(
    unit: &ast::TranslationUnit,
    prelude: Option<&Prelude>,
    diagnostics: &mut Diagnostics,
) -> Module {
    deep_stack::run(|| {
        let mut checker = Checker::new(prelude, std::mem::take(diagnostics));
        for item in &unit.items {
            checker.check_file_item(item);
        }
        checker.check_all_functions_defined();
        checker.check_call_graph();
        checker.check_roles();
        *diagnostics = checker.diagnostics;
        checker.module
    })
}

/// All that is known while a unit is checked.
struct Checker<'a> {
    diagnostics: Diagnostics,
    /// Code and place of all that was reported.
    reported: BTreeSet<(Code, Span)>,
    /// Warnings about an inherited body have been given for the base.
    silent: bool,
    /// How many errors were found, repeated ones included.
    errors: usize,
    /// The text checked is the prelude: names starting with `rt_` may be declared, intrinsics called.
    in_prelude: bool,
    prelude: Option<&'a Prelude>,
    module: Module,
    /// What is known of each function of the module beyond its tree.
    function_info: Vec<FunctionInfo>,
    /// What is known of each struct of the module beyond its fields.
    struct_info: Vec<StructInfo>,
    /// Names at file scope.
    file: Level,
    /// The class being checked.
    class: Option<ClassContext>,
    /// The function, initializer or constant being checked.
    function: FunctionContext,
    /// Names in the blocks of the function being checked.
    scopes: Scopes,
    /// All classes so far.
    classes: Vec<ClassDeclaration<'a>>,
    /// How many more names may be compared for suggestions.
    comparisons: usize,
    /// How many more operations constant expressions may take.
    evaluation_fuel: u32,
    /// How many more operations the search for constants that are not numbers may take.
    nan_fuel: u32,
    /// How many more bytes of inherited text may be checked again.
    inheritable: usize,
}

impl<'a> Checker<'a> {
    fn new(prelude: Option<&'a Prelude>, diagnostics: Diagnostics) -> Self {
        Checker {
            diagnostics,
            reported: BTreeSet::new(),
            silent: false,
            errors: 0,
            in_prelude: false,
            prelude,
            module: prelude.map(|prelude| prelude.module.clone()).unwrap_or_default(),
            function_info: prelude.map(|prelude| prelude.function_info.clone()).unwrap_or_default(),
            struct_info: prelude.map(|prelude| prelude.struct_info.clone()).unwrap_or_default(),
            file: Level::default(),
            class: None,
            function: FunctionContext::outside(),
            scopes: Scopes::default(),
            classes: Vec::new(),
            comparisons: suggestions::COMPARISON_LIMIT,
            evaluation_fuel: evaluator::UNIT_FUEL,
            nan_fuel: nan::UNIT_FUEL,
            inheritable: inheritance::INHERITED_TEXT_LIMIT,
        }
    }

    /// Adds a diagnostic, unless it says again what was said of the same place.
    fn report(&mut self, diagnostic: Diagnostic) {
        self.errors += usize::from(diagnostic.is_error());
        if self.silent && !diagnostic.is_error() {
            return;
        }
        if let Some(label) = &diagnostic.primary
            && !self.reported.insert((diagnostic.code, label.span))
        {
            return;
        }
        self.diagnostics.push(diagnostic);
    }

    fn function(&self, id: crate::hir::FunctionId) -> &Arc<crate::hir::Function> {
        &self.module.functions[id.0 as usize]
    }
}
