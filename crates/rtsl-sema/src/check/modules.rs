//! Modules: files whose names other files import.
//!
//! A module is checked once, with names of its own at file scope. An importing file has each of them under the module's
//! name and a dot: `microfacets.ggx`. Inherited items of a class are checked with the names of the module that declares
//! them.

use std::collections::BTreeMap;

use rtsl_source::{Diagnostic, diagnostic_codes as codes};
use rtsl_syntax::ast;

use super::Checker;
use super::scope::{Entity, Level, Named};
use super::suggestions::suggest;

/// A module with the modules that it uses.
#[derive(Clone, Debug, Default)]
pub struct Module {
    /// The syntax tree.
    pub unit: ast::TranslationUnit,
    /// The modules that it uses.
    pub uses: Uses,
}

/// The modules that a file uses, as indices in a list of modules. No module uses itself, directly or through others.
#[derive(Clone, Debug, Default)]
pub struct Uses {
    /// The module of each import of the file.
    pub imports: Vec<usize>,
    /// The modules of classes that the file inherits without importing them, by the names of the classes.
    pub bases: BTreeMap<String, usize>,
}

/// The modules of a unit, and the one whose text is being checked.
#[derive(Debug, Default)]
pub(super) struct ModuleScopes<'a> {
    modules: &'a [Module],
    /// Modules and classes that the unit itself uses.
    uses: Uses,
    /// The names at file scope of each module; `None` until it is checked.
    names: Vec<Option<Level>>,
    /// The names at file scope of the unit, while text of a module is checked.
    unit_names: Level,
    /// The module whose text is being checked; `None` for the unit itself.
    home: Option<usize>,
}

impl<'a> ModuleScopes<'a> {
    pub(super) fn new(modules: &'a [Module], uses: &Uses) -> Self {
        let names = vec![None; modules.len()];
        ModuleScopes { modules, uses: uses.clone(), names, unit_names: Level::new(), home: None }
    }

    /// The module whose text is being checked.
    pub(super) fn home(&self) -> Option<usize> {
        self.home
    }

    fn uses(&self) -> &Uses {
        self.home.map_or(&self.uses, |home| &self.modules[home].uses)
    }

    fn names_mut(&mut self, home: Option<usize>) -> &mut Level {
        match home {
            Some(home) => self.names[home].get_or_insert_default(),
            None => &mut self.unit_names,
        }
    }
}

impl<'a> Checker<'a> {
    /// Declares the names of the modules that a file imports.
    pub(super) fn bring_imports(&mut self, imports: &[ast::Import]) {
        let modules = self.modules.uses().imports.clone();
        for (import, module) in imports.iter().zip(modules) {
            self.check_module(module);
            let Some(name) = import.name() else { continue };
            self.declare(name, Entity::Module);
            let names = self.modules.names[module].iter().flatten();
            let own = names.filter(|(own, named)| {
                !own.contains('.') && !matches!(named.entity, Entity::Module)
            });
            let qualified = own.map(|(own, named)| (format!("{}.{own}", name.name), named.clone()));
            let qualified: Vec<(String, Named)> = qualified.collect();
            self.file.extend(qualified);
        }
    }

    /// Checks a module, unless that is done.
    fn check_module(&mut self, index: usize) {
        if self.modules.names[index].is_some() {
            return;
        }
        let modules = self.modules.modules;
        let module = &modules[index];
        self.with_names_of(Some(index), |checker| {
            checker.bring_imports(&module.unit.imports);
            for item in &module.unit.items {
                checker.check_file_item(item);
            }
        });
    }

    /// Returns the class of a base that the file being checked inherits without having imported it.
    pub(super) fn class_of_base(&mut self, name: &str) -> Option<Entity> {
        let module = *self.modules.uses().bases.get(name)?;
        self.check_module(module);
        let named = self.modules.names[module].as_ref()?.get(name)?;
        Some(named.entity.clone())
    }

    /// Runs `work` with the names at file scope of a module, or of the unit.
    pub(super) fn with_names_of<T>(
        &mut self,
        home: Option<usize>,
        work: impl FnOnce(&mut Self) -> T,
    ) -> T {
        if home == self.modules.home {
            return work(self);
        }
        let outer = std::mem::replace(&mut self.modules.home, home);
        let names = std::mem::take(self.modules.names_mut(home));
        let outer_names = std::mem::replace(&mut self.file, names);
        *self.modules.names_mut(outer) = outer_names;
        let result = work(self);
        let outer_names = std::mem::take(self.modules.names_mut(outer));
        let names = std::mem::replace(&mut self.file, outer_names);
        *self.modules.names_mut(home) = names;
        self.modules.home = outer;
        result
    }

    /// Returns the name of a part of a module: `ggx` of the module `microfacets` is `microfacets.ggx`.
    pub(super) fn qualified_name(
        &self,
        module: &ast::Expression,
        part: &ast::Identifier,
    ) -> Option<String> {
        let ast::ExpressionKind::Name(name) = &module.kind else { return None };
        let is_module = matches!(self.find(name).map(|named| &named.entity), Some(Entity::Module));
        is_module.then(|| format!("{name}.{}", part.name))
    }

    /// As [`Self::qualified_name`]; reports it if the module has no such part.
    pub(super) fn name_in_module(
        &mut self,
        module: &ast::Expression,
        part: &ast::Identifier,
    ) -> Option<String> {
        let qualified = self.qualified_name(module, part)?;
        if self.find(&qualified).is_none() {
            let message = format!("there is no `{qualified}`");
            let diagnostic =
                Diagnostic::new(codes::UNKNOWN_NAME, message).at(part.span, "not in the module");
            let names: Vec<String> = self.file.keys().cloned().collect();
            let similar = self.similar_of(&qualified, names.iter().map(String::as_str));
            self.report(suggest(diagnostic, module.span.to(part.span), similar));
            let named = Named { entity: Entity::Error, span: part.span };
            self.file.insert(qualified.clone(), named);
        }
        Some(qualified)
    }
}
