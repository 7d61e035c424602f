//! The checker: from the syntax tree to the typed tree, with diagnostics for invalid text.
//!
//! # Order of work
//!
//! [`check_unit`] goes through the items of a file in order, so that a name is known from its
//! declaration on. Inside a class (and in the prelude) names are known everywhere, so there the
//! work has phases, one in each short function of `classes`: structs and constants, signatures,
//! members, the constructor, bodies, implied methods. While bodies are checked, facts are
//! collected: calls, and uses of features that only some methods may use. `call_graph` and `roles`
//! judge those at the end.
//!
//! # Errors
//!
//! Text that could not be checked has the type `Type::Error`, which suppresses consequential
//! errors, so that each mistake gives one diagnostic. An inherited body is checked again in the
//! context of each class; its warnings are reported once, and so is an error with the same code and
//! span.
//!
//! # Depth
//!
//! The parser bounds the depth of its tree, and recursion here follows that tree. Chains of
//! declarations without bound (calls, constants, structs, bases) are traversed without recursion or
//! have their own limits.

mod access;
mod assertions;
mod attributes;
mod call_graph;
mod calls;
mod candidates;
mod classes;
mod constants;
mod constructors;
mod control;
mod declarations;
mod doubtful;
mod effects;
mod elements;
mod enumerations;
mod evaluated;
mod evaluator;
mod expressions;
mod facts;
mod folding;
mod foreign;
mod functions;
mod generics;
mod idle;
mod implied;
mod inheritance;
mod initializers;
mod lost_state;
mod lvalues;
mod members;
mod modules;
mod nan;
mod notes;
mod operators;
mod order;
mod places;
mod prints;
mod reached;
mod references;
mod roles;
mod scope;
mod statements;
mod struct_methods;
mod suggestions;
mod super_calls;
mod type_names;
mod types;

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use rtsl_source::{Code, Diagnostic, Diagnostics, Span, deep_stack};
use rtsl_syntax::ast;

use crate::hir;
use crate::index::Index;
use classes::{ClassContext, ClassDeclaration};
use functions::{FunctionContext, FunctionInfo};
use generics::Generic;
use modules::ModuleScopes;
use scope::{Level, Scopes};
use types::StructInfo;

pub use modules::{Module, Uses};
pub use prints::Prints;
pub(crate) use type_names::plain_type_name;

/// The functions that every unit may call, checked once for many units.
#[derive(Debug, Default)]
pub struct Prelude {
    module: hir::Module,
    names: Level,
    function_info: Vec<FunctionInfo>,
    struct_info: Vec<StructInfo>,
    /// `class rt_ImpliedMaterial`, whose methods are added to materials that lack them.
    implied: Vec<ast::Class>,
}

impl Prelude {
    /// The prelude's declarations. The ids of its functions are the same in every unit checked on
    /// top of it.
    pub fn module(&self) -> &hir::Module {
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

/// Checks texts on top of the prelude that may use what only the prelude may. Their functions may call each other in
/// any order, and have parameters that are buffers.
pub fn check_on_prelude(
    units: &[ast::TranslationUnit],
    prelude: &Prelude,
    diagnostics: &mut Diagnostics,
) -> hir::Module {
    let mut checker = Checker {
        in_prelude: true,
        file: prelude.names.clone(),
        ..Checker::new(Some(prelude), std::mem::take(diagnostics))
    };
    let items: Vec<&ast::Item> = units.iter().flat_map(|unit| &unit.items).collect();
    checker.check_prelude_items(&items);
    checker.check_call_graph();
    *diagnostics = checker.diagnostics;
    checker.module
}

/// Checks one translation unit on top of the prelude. If `diagnostics` has errors afterwards, the
/// module serves only for completion in editors.
pub fn check_unit(
    unit: &ast::TranslationUnit,
    prelude: Option<&Prelude>,
    diagnostics: &mut Diagnostics,
) -> hir::Module {
    check_unit_with(unit, (&[], &Uses::default()), (prelude, Prints::Dropped), diagnostics)
}

/// Checks one translation unit that uses some of these modules, and keeps or drops its prints.
pub fn check_unit_with(
    unit: &ast::TranslationUnit,
    (modules, uses): (&[Module], &Uses),
    (prelude, prints): (Option<&Prelude>, Prints),
    diagnostics: &mut Diagnostics,
) -> hir::Module {
    let _span = tracing::debug_span!("check").entered();
    deep_stack::run(|| {
        let mut checker = Checker::new(prelude, std::mem::take(diagnostics));
        checker.modules = ModuleScopes::new(modules, uses);
        checker.prints = prints;
        checker.check_items(unit);
        *diagnostics = checker.diagnostics;
        checker.module
    })
}

/// Checks one translation unit as [`check_unit_with`] does, and notes what its names mean. The unit may come from a
/// text with errors.
pub fn index_unit(
    unit: &ast::TranslationUnit,
    (modules, uses): (&[Module], &Uses),
    prelude: &Prelude,
    diagnostics: &mut Diagnostics,
) -> (hir::Module, Index) {
    deep_stack::run(|| {
        let mut checker = Checker::new(Some(prelude), std::mem::take(diagnostics));
        checker.index = Some(Box::default());
        checker.modules = ModuleScopes::new(modules, uses);
        checker.prints = Prints::Kept;
        checker.check_items(unit);
        *diagnostics = checker.diagnostics;
        (checker.module, checker.index.map(|index| *index).unwrap_or_default())
    })
}

/// The state of the checker for one unit.
struct Checker<'a> {
    diagnostics: Diagnostics,
    /// The code and span of every diagnostic reported so far.
    reported: BTreeSet<(Code, Span)>,
    /// True while an inherited body is checked, whose warnings have been reported for the base.
    silent: bool,
    /// The number of errors found, including repeated ones.
    errors: usize,
    /// True while the prelude is checked: names starting with `rt_` may be declared, intrinsics
    /// called.
    in_prelude: bool,
    prelude: Option<&'a Prelude>,
    module: hir::Module,
    /// The checker's data about each function of the module, beside its tree.
    function_info: Vec<FunctionInfo>,
    /// The checker's data about each struct of the module, beside its fields.
    struct_info: Vec<StructInfo>,
    /// The places of the fields of structs whose fields were used, by name.
    field_places: HashMap<hir::StructId, HashMap<String, usize>>,
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
    /// The number of bytes that the choices of parameters may still have.
    choices_left: usize,
    /// The generic functions so far.
    generics: Vec<Generic<'a>>,
    /// The number of components of generic types in the instance being declared or checked.
    generic_size: Option<u8>,
    /// The header of the instance whose body is being checked.
    instance_shown: Option<String>,
    /// The instances whose bodies are still to be checked.
    wanted_instances: Vec<hir::FunctionId>,
    /// The number of names that may still be compared for suggestions.
    comparisons: usize,
    /// The number of operations left for constant expressions.
    evaluation_fuel: u32,
    /// The number of operations left for the search for constants that are NaN.
    nan_fuel: u32,
    /// The number of bytes of inherited text that may still be checked again.
    inheritable: usize,
    /// The modules that the unit uses.
    modules: ModuleScopes<'a>,
    prints: Prints,
    /// The notes for editors, if they are wanted.
    index: Option<Box<Index>>,
}

impl<'a> Checker<'a> {
    fn new(prelude: Option<&'a Prelude>, diagnostics: Diagnostics) -> Self {
        let mut checker = Checker {
            diagnostics,
            reported: BTreeSet::new(),
            silent: false,
            errors: 0,
            in_prelude: false,
            prelude,
            module: prelude.map(|prelude| prelude.module.clone()).unwrap_or_default(),
            function_info: prelude.map(|prelude| prelude.function_info.clone()).unwrap_or_default(),
            struct_info: prelude.map(|prelude| prelude.struct_info.clone()).unwrap_or_default(),
            field_places: HashMap::new(),
            file: Level::default(),
            class: None,
            function: FunctionContext::outside(),
            scopes: Scopes::default(),
            classes: Vec::new(),
            choices_left: enumerations::CHOICES_LIMIT,
            generics: Vec::new(),
            generic_size: None,
            instance_shown: None,
            wanted_instances: Vec::new(),
            comparisons: suggestions::COMPARISON_LIMIT,
            evaluation_fuel: evaluator::UNIT_FUEL,
            nan_fuel: nan::UNIT_FUEL,
            inheritable: inheritance::INHERITED_TEXT_LIMIT,
            modules: ModuleScopes::default(),
            prints: Prints::Dropped,
            index: None,
        };
        if prelude.is_none() {
            checker.add_spec_structs();
        }
        checker
    }

    /// Checks the items of a unit.
    fn check_items(&mut self, unit: &'a ast::TranslationUnit) {
        self.bring_imports(&unit.imports);
        for item in &unit.items {
            self.check_file_item(item);
        }
        self.check_all_functions_defined();
        self.check_call_graph();
        self.check_roles();
        self.check_idle();
    }

    /// Adds a diagnostic, unless one with the same code and span was reported.
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
        let diagnostic = match &self.instance_shown {
            Some(instance) => diagnostic.note(format!("in the instance {instance}")),
            None => diagnostic,
        };
        self.diagnostics.push(diagnostic);
    }

    fn function(&self, id: hir::FunctionId) -> &Arc<hir::Function> {
        &self.module.functions[id.0 as usize]
    }
}
