//! Loading of the modules that a unit imports, and of the files of the standard library whose classes it inherits.

use std::collections::{BTreeMap, BTreeSet};

use rtsl_sema::check::{Module, Uses};
use rtsl_source::{Diagnostic, Diagnostics, SourceMap, diagnostic_codes as codes};
use rtsl_spec::Role;
use rtsl_syntax::ast::{Import, Item, TranslationUnit};
use rtsl_syntax::{IncludeError, IncludeLoader};

use super::library;
use super::loader::FileLoader;

/// The greatest number of modules that a unit uses, directly and through others.
const MAX_MODULES: usize = 256;
/// The greatest number of bytes of all of them.
const MAX_MODULE_BYTES: usize = 16 << 20;

/// The modules of a unit.
#[derive(Debug, Default)]
pub(super) struct Modules {
    /// Each after those that it uses.
    pub modules: Vec<Module>,
    /// Modules and classes that the unit uses.
    pub uses: Uses,
}

/// Loads the modules of a unit from `loader`.
pub(super) struct ModuleLoader<'a> {
    pub sources: &'a mut SourceMap,
    pub loader: &'a mut dyn IncludeLoader,
    pub diagnostics: &'a mut Diagnostics,
    /// The loader of what files of the standard library include and import, which does not depend on the host's.
    library: FileLoader,
    loaded: Vec<Module>,
    /// The indices of loaded modules, by the names of their files.
    indices: BTreeMap<String, usize>,
    /// The files that are being loaded, each imported by the one before.
    open: Vec<String>,
    bytes: usize,
}

impl<'a> ModuleLoader<'a> {
    pub fn new(
        sources: &'a mut SourceMap,
        loader: &'a mut dyn IncludeLoader,
        diagnostics: &'a mut Diagnostics,
    ) -> Self {
        ModuleLoader {
            sources,
            loader,
            diagnostics,
            library: FileLoader::default(),
            loaded: Vec::new(),
            indices: BTreeMap::new(),
            open: Vec::new(),
            bytes: 0,
        }
    }

    /// Loads everything that the unit in the file `name` uses.
    pub fn load(mut self, unit: &TranslationUnit, name: &str) -> Modules {
        self.open.push(name.to_owned());
        let uses = self.uses_of(unit, name);
        Modules { modules: self.loaded, uses }
    }

    fn uses_of(&mut self, unit: &TranslationUnit, name: &str) -> Uses {
        let mut uses = Uses::default();
        for import in &unit.imports {
            match self.module_of(import, name) {
                Some(index) => uses.imports.push(index),
                // The indices are those of the imports up to the first that failed, which was reported.
                None => break,
            }
        }
        for base in bases_of_library(unit) {
            let file = library::file_of_class(base);
            let module =
                file.and_then(|file| self.module(file.path.to_owned(), || file.text.to_owned()));
            uses.bases.extend(module.map(|index| (base.to_owned(), index)));
        }
        uses
    }

    /// Returns the module of an import; `None` if it cannot be had, which is reported.
    fn module_of(&mut self, import: &Import, importing: &str) -> Option<usize> {
        let file = import.file();
        let found = match self.loader_of(importing).load(&file, importing) {
            Ok(found) => found,
            Err(error) => {
                self.report_missing(import, &file, &error);
                return None;
            }
        };
        if let Some(first) = self.open.iter().position(|name| *name == found.name) {
            let message = format!("the module `{}` imports itself", import.dotted());
            let mut diagnostic =
                Diagnostic::new(codes::CIRCULAR_IMPORT, message).at(import.span, "imported here");
            if self.open.len() > first + 1 {
                let through = self.open[first + 1..].join("`, `");
                diagnostic = diagnostic.note(format!("through `{through}`"));
            }
            self.diagnostics.push(diagnostic);
            return None;
        }
        let text = found.text;
        let index = self.module(found.name, || text);
        if index.is_none() {
            let message = "a unit uses too many modules, or too large ones";
            let diagnostic = Diagnostic::new(codes::EXPANSION_LIMIT, message)
                .at(import.span, "one too many")
                .note(format!("the limits are {MAX_MODULES} modules and {MAX_MODULE_BYTES} bytes"));
            self.diagnostics.push(diagnostic);
        }
        index
    }

    /// Parses a module, unless that is done; `None` beyond the limits.
    fn module(&mut self, name: String, text: impl FnOnce() -> String) -> Option<usize> {
        if let Some(index) = self.indices.get(&name) {
            return Some(*index);
        }
        let text = text();
        self.bytes += text.len();
        if self.loaded.len() + self.open.len() > MAX_MODULES || self.bytes > MAX_MODULE_BYTES {
            return None;
        }
        let file = self.sources.add(name.clone(), text);
        let loader: &mut dyn IncludeLoader = match library::file(&name) {
            Some(_) => &mut self.library,
            None => self.loader,
        };
        let unit = rtsl_syntax::parse(self.sources, file, loader, self.diagnostics);
        self.open.push(name.clone());
        let uses = self.uses_of(&unit, &name);
        self.open.pop();
        self.loaded.push(Module { unit, uses });
        let index = self.loaded.len() - 1;
        self.indices.insert(name, index);
        Some(index)
    }

    /// Returns the loader of what a file includes and imports.
    fn loader_of(&mut self, file: &str) -> &mut dyn IncludeLoader {
        match library::file(file) {
            Some(_) => &mut self.library,
            None => self.loader,
        }
    }

    fn report_missing(&mut self, import: &Import, file: &str, error: &IncludeError) {
        let missing = |message: String| Diagnostic::new(codes::MODULE_NOT_FOUND, message);
        let diagnostic = match error {
            IncludeError::NotFound(looked_at) => {
                let diagnostic = missing(format!("there is no module `{}`", import.dotted()));
                let places = looked_at.iter().map(|place| format!("`{place}`"));
                let places: Vec<String> = places.collect();
                diagnostic.note(match places.is_empty() {
                    true => format!("no folder is searched for `{file}`"),
                    false => format!("there is no {}", places.join(", no ")),
                })
            }
            IncludeError::Escapes => {
                missing(format!("the module `{}` is outside of the search path", import.dotted()))
            }
            IncludeError::Unreadable(reason) => {
                missing(format!("can't read the module `{}`: {reason}", import.dotted()))
            }
        };
        self.diagnostics.push(diagnostic.at(import.span, "imported here"));
    }
}

/// The bases of classes that the unit does not declare before, and that are neither roles nor imported.
fn bases_of_library(unit: &TranslationUnit) -> BTreeSet<&str> {
    let mut declared = BTreeSet::new();
    let mut bases = BTreeSet::new();
    for item in &unit.items {
        let Item::Class(class) = item else { continue };
        let unknown = class.bases.iter().map(|base| base.name.as_str()).filter(|base| {
            Role::from_class(base).is_none() && !declared.contains(base) && !base.contains('.')
        });
        bases.extend(unknown);
        declared.insert(class.name.name.as_str());
    }
    bases
}
