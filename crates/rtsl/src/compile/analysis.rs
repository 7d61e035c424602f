//! Analyses of texts for editors: trees, the meaning of names and diagnostics, of texts with errors, too.

use std::collections::BTreeSet;

use rtsl_ir::{OpKind, Place, Region};
use rtsl_lower::lower_class;
use rtsl_sema::check::index_unit;
use rtsl_sema::hir::{ClassId, Module};
use rtsl_sema::index::Index;
use rtsl_sema::prelude::{self, prelude};
use rtsl_source::{
    Diagnostic, Diagnostics, FileId, Severity, SourceMap, Span, deep_stack,
    diagnostic_codes as codes,
};
use rtsl_syntax::IncludeLoader;
use rtsl_syntax::ast::{Function, Item, TranslationUnit};
use rtsl_syntax::raw::{RawKind, raw_tokens};

use super::compiler::tracing;
use super::modules::ModuleLoader;

/// The analysis of a text. Its types are those of the compiler's stages, which change with every release.
#[derive(Debug)]
pub struct Analysis {
    /// The files of the compilation: the prelude, the text, and what it includes and imports.
    pub sources: SourceMap,
    /// The text.
    pub file: FileId,
    /// The syntax tree of the text and of what it includes. It must be dropped on a deep stack.
    tree: Option<TranslationUnit>,
    /// The syntax trees of its modules.
    modules: Vec<TranslationUnit>,
    /// The typed tree.
    pub module: Module,
    /// The number of classes and functions of the prelude, which come first in the typed tree.
    pub prelude: (usize, usize),
    /// The meaning of names.
    pub index: Index,
    /// The errors and warnings, without those that follow from errors of syntax.
    pub diagnostics: Diagnostics,
}

impl Analysis {
    /// Analyses a text whose includes and modules come from `loader`. Diagnostics call it `name`.
    pub fn new(name: &str, text: &str, loader: &mut dyn IncludeLoader) -> Analysis {
        let prelude = prelude();
        let mut sources = prelude.sources.clone();
        let file = sources.add(name, text);
        let mut diagnostics = Diagnostics::new();
        let tree = rtsl_syntax::parse(&mut sources, file, loader, &mut diagnostics);
        let modules = ModuleLoader::new(&mut sources, loader, &mut diagnostics).load(&tree, name);
        let has_broken_text = diagnostics.has_errors();
        let used = (modules.modules.as_slice(), &modules.uses);
        let mut found = Diagnostics::new();
        let (module, index) = index_unit(&tree, used, &prelude.checked, &mut found);
        if has_broken_text {
            let broken = Broken::new(&tree, &sources, &diagnostics);
            found = kept(found, |diagnostic| !broken.explains(diagnostic, &sources));
        }
        diagnostics.extend(found.iter().cloned());
        let of_prelude = prelude.checked.module();
        let prelude = (of_prelude.classes.len(), of_prelude.functions.len());
        if !diagnostics.has_errors() {
            lower_classes(&module, prelude.0, &mut diagnostics);
        }
        let modules = modules.modules.into_iter().map(|module| module.unit).collect();
        let tree = Some(tree);
        Analysis { sources, file, tree, modules, module, prelude, index, diagnostics }
    }

    /// The syntax tree of the text and of what it includes.
    pub fn tree(&self) -> &TranslationUnit {
        self.tree.as_ref().expect("it is taken when the analysis is dropped")
    }

    /// The syntax trees of the modules and of the classes of the library that the text uses.
    pub fn modules(&self) -> &[TranslationUnit] {
        &self.modules
    }

    /// The places of the text where a product and a sum are contracted to one operation that rounds once: what each
    /// spans, in the order of the text. Empty if the text has errors.
    pub fn contractions(&self) -> Vec<Span> {
        let mut found = BTreeSet::new();
        if self.diagnostics.has_errors() {
            return Vec::new();
        }
        let tracing = tracing(&self.sources);
        let name = &self.sources.file(self.file).name;
        deep_stack::run(|| {
            for index in self.prelude.0..self.module.classes.len() {
                let id = ClassId(index as u32);
                let Ok(class) = lower_class(&self.module, id, Some(&tracing)) else { continue };
                for mut function in class.methods.into_values().chain(class.constructor) {
                    rtsl_opt::contract::run(&mut function);
                    add_contractions(&function, &function.body, &mut |place| {
                        if place.source.name == *name {
                            found.insert((place.start, place.end));
                        }
                    });
                }
            }
        });
        found.into_iter().map(|(start, end)| Span::new(self.file, start, end)).collect()
    }

    /// True for a file of the prelude.
    pub fn is_of_prelude(&self, file: FileId) -> bool {
        (file.0 as usize) < prelude::FILES.len()
    }
}

/// Dropping trees recurses.
impl Drop for Analysis {
    fn drop(&mut self) {
        let trees = (self.tree.take(), std::mem::take(&mut self.modules));
        let module = std::mem::take(&mut self.module);
        deep_stack::run(|| drop((trees, module)));
    }
}

/// Adds the diagnostics of lowering.
fn lower_classes(module: &Module, first: usize, diagnostics: &mut Diagnostics) {
    deep_stack::run(|| {
        for index in first..module.classes.len() {
            if module.classes[index].is_imported {
                continue;
            }
            if let Err(problems) = lower_class(module, ClassId(index as u32), None) {
                diagnostics.extend(problems);
            }
        }
    });
}

/// Calls `add` for the places of contracted operations.
fn add_contractions(function: &rtsl_ir::Function, region: &Region, add: &mut impl FnMut(Place)) {
    for op in &region.ops {
        if matches!(op.kind, OpKind::Fma(..))
            && let Some(place) = function.names.place(op.results.get(0))
        {
            add(place);
        }
        for inner in op.kind.regions() {
            add_contractions(function, inner, add);
        }
    }
}

fn kept(diagnostics: Diagnostics, keep: impl Fn(&Diagnostic) -> bool) -> Diagnostics {
    let mut kept = Diagnostics::new();
    kept.extend(diagnostics.iter().filter(|it| keep(it)).cloned());
    kept
}

/// The parts of a text that could not be parsed.
struct Broken {
    /// The functions with such parts: the spans from the header to the end of the body.
    functions: Vec<Span>,
    /// The names in such parts, which may declare them.
    names: BTreeSet<String>,
}

impl Broken {
    fn new(tree: &TranslationUnit, sources: &SourceMap, errors: &Diagnostics) -> Broken {
        let errors = errors.iter().filter_map(|it| Some(it.primary.as_ref()?.span));
        let places: Vec<Span> = tree.skipped.iter().copied().chain(errors).collect();
        let is_broken = |function: &Span| places.iter().any(|place| overlap(*place, *function));
        let mut functions = Vec::new();
        let mut names = BTreeSet::new();
        functions_of(&tree.items, &mut |function| {
            if is_broken(&extent(function)) {
                functions.push(extent(function));
                names.insert(function.name.name.clone());
            }
        });
        for place in &tree.skipped {
            let text = sources.text(*place);
            let words = raw_tokens(text).into_iter().filter(|token| token.kind == RawKind::Name);
            names.extend(words.map(|token| text[token.range].to_owned()));
        }
        Broken { functions, names }
    }

    /// True if a diagnostic may follow from what is missing.
    fn explains(&self, diagnostic: &Diagnostic, sources: &SourceMap) -> bool {
        let Some(label) = &diagnostic.primary else { return false };
        let in_broken = self.functions.iter().any(|function| overlap(label.span, *function));
        let needs_whole_body = diagnostic.severity == Severity::Warning
            || [codes::NO_RETURN, codes::BAD_RETURN].contains(&diagnostic.code);
        if needs_whole_body {
            return in_broken;
        }
        let of_names = [
            codes::UNKNOWN_NAME,
            codes::UNKNOWN_TYPE,
            codes::UNKNOWN_FIELD,
            codes::UNKNOWN_BASE,
            codes::NO_MATCHING_FUNCTION,
            codes::NO_INHERITED,
            codes::MISSING_BODY,
            codes::BAD_BASES,
        ];
        let shown = sources.text(label.span);
        let is_missing = |name: &str| self.names.contains(name);
        of_names.contains(&diagnostic.code)
            && shown.split(|letter: char| !is_of_name(letter)).any(is_missing)
    }
}

fn is_of_name(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || letter == '_'
}

/// Calls `visit` for the functions of items and of their classes.
fn functions_of(items: &[Item], visit: &mut impl FnMut(&Function)) {
    for item in items {
        match item {
            Item::Function(function) => visit(function),
            Item::Class(class) => functions_of(&class.items, visit),
            Item::Struct(_) | Item::Enumeration(_) | Item::Assertion(_) | Item::Variable(_) => {}
        }
    }
}

/// The span of a function with its body.
fn extent(function: &Function) -> Span {
    function.body.as_ref().map_or(function.span, |body| function.span.to(body.span))
}

fn overlap(left: Span, right: Span) -> bool {
    left.file == right.file && left.start <= right.end && right.start <= left.end
}
