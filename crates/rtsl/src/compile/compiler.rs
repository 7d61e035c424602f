//! The pipeline from text to classes: parsing, checking, lowering.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rtsl_ir::Source;
use rtsl_ir::class::Class;
use rtsl_lower::{Tracing, lower_class};
use rtsl_sema::check::{Prints, check_unit_with};
use rtsl_sema::hir::ClassId;
use rtsl_sema::prelude::{self, CheckedPrelude, prelude};
use rtsl_source::{Diagnostic, Diagnostics, SourceMap, deep_stack, diagnostic_codes as codes};
use rtsl_syntax::IncludeLoader;
use rtsl_syntax::ast::TranslationUnit;

use super::library;
use super::loader::{FileLoader, read_text};
use super::modules::{ModuleLoader, Modules};
use super::outline::{ClassOutline, Outline};
use super::unit::{Compilation, Unit};

/// The number of loop iterations of a ray in a call, or of a constructor, after which a loop is taken for endless: the
/// usual loop budget of a host. A class's initial values have it if the host sets none, because every host that shows
/// a default or makes a library computes them, so they must come to an end.
pub const DEFAULT_LOOP_BUDGET: u32 = 1 << 24;

/// Options of compilation.
///
/// ```
/// use rtsl::{Compiler, CompilerOptions};
///
/// // Untrusted text: constructors end.
/// let options = CompilerOptions { loop_budget: Some(100_000), ..CompilerOptions::default() };
/// let text = "class A : rt_Texture; constructor() { while (true) {} }";
/// let unit = Compiler::new(options).compile("a.rtsl", text).unit.expect("it compiles");
/// let error = rtsl::Instance::new(unit.class("A")?, []).unwrap_err();
/// assert_eq!(error.iter().next().map(|it| it.code.as_str()), Some("E0619"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CompilerOptions {
    /// The greatest number of loop iterations of a constructor, all loops taken together; unlimited if `None`. Methods
    /// have the budget of the engine. Initial values of members have this budget too, or 16,777,216 if it is `None`.
    pub loop_budget: Option<u32>,
    /// The folders that `#include` searches after that of the including file.
    pub search_path: Vec<PathBuf>,
    /// True if classes keep their prints and the places of values, for engines with a
    /// [trace](crate::EngineOptions::trace). Results are the same.
    pub traced: bool,
}

/// Compiles text to classes.
///
/// ```
/// use rtsl::{Compiler, MemoryLoader};
///
/// // The host loads includes: here from memory.
/// let mut loader = MemoryLoader::default();
/// loader.files.insert("grey.rtsl".to_owned(), "float grey() { return 0.5; }".to_owned());
/// let text = "#include \"grey.rtsl\"\nclass A : rt_Texture; void lookup() { rt_TextureColor = color(grey()); }";
/// let compilation = Compiler::default().compile_with("a.rtsl", text, &mut loader);
/// assert_eq!(compilation.unit.expect("it compiles").classes().len(), 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Compiler {
    options: CompilerOptions,
}

impl Compiler {
    /// Creates a compiler with these options.
    pub fn new(options: CompilerOptions) -> Compiler {
        Compiler { options }
    }

    /// The options.
    pub fn options(&self) -> &CompilerOptions {
        &self.options
    }

    /// Compiles text that is in no file; diagnostics call it `name`. Includes are searched on the search path.
    pub fn compile(&self, name: &str, text: &str) -> Compilation {
        self.compile_with(name, text, &mut FileLoader::new(self.options.search_path.clone()))
    }

    /// Compiles text whose includes come from `loader`.
    pub fn compile_with(
        &self,
        name: &str,
        text: &str,
        loader: &mut dyn IncludeLoader,
    ) -> Compilation {
        let prelude = prelude();
        let mut sources = prelude.sources.clone();
        let mut diagnostics = prelude.diagnostics.clone();
        let file = sources.add(name, text);
        let tree = rtsl_syntax::parse(&mut sources, file, loader, &mut diagnostics);
        let modules = ModuleLoader::new(&mut sources, loader, &mut diagnostics).load(&tree, name);
        // Checks of a broken syntax tree would report errors that follow from the first ones.
        if diagnostics.has_errors() {
            return Compilation { unit: None, diagnostics, sources };
        }
        let tracing = self.options.traced.then(|| tracing(&sources));
        let tracing = tracing.as_ref();
        // The trees are dropped on the deep stack, too: dropping recurses.
        let classes =
            deep_stack::run(|| self.classes(tree, modules, tracing, prelude, &mut diagnostics));
        let unit = (!diagnostics.has_errors()).then_some(Unit { classes });
        Compilation { unit, diagnostics, sources }
    }

    /// Checks a syntax tree and lowers its classes. Of classes with errors there is only a diagnostic.
    fn classes(
        &self,
        tree: TranslationUnit,
        modules: Modules,
        tracing: Option<&Tracing>,
        prelude: &CheckedPrelude,
        diagnostics: &mut Diagnostics,
    ) -> Vec<Arc<Class>> {
        let used = (modules.modules.as_slice(), &modules.uses);
        let prints = if tracing.is_some() { Prints::Kept } else { Prints::Dropped };
        let module = check_unit_with(&tree, used, (Some(&prelude.checked), prints), diagnostics);
        let mut classes = Vec::new();
        if diagnostics.has_errors() {
            return classes;
        }
        for index in prelude.checked.module().classes.len()..module.classes.len() {
            if module.classes[index].is_imported {
                continue;
            }
            match lower_class(&module, ClassId(index as u32), tracing) {
                Ok(class) => classes.push(Arc::new(self.with_budget(class))),
                Err(problems) => diagnostics.extend(problems),
            }
        }
        classes
    }

    /// Bounds the loops of a class's initial values and constructor. Linking bounds those of methods.
    fn with_budget(&self, mut class: Class) -> Class {
        let budget = self.options.loop_budget;
        // These run without being linked.
        let unlinked = class.constructor.iter_mut().filter(|_| class.references.is_empty());
        unlinked.chain([&mut class.initializer]).for_each(rtsl_opt::differentiate::run);
        rtsl_opt::budget::run(&mut class.initializer, budget.unwrap_or(DEFAULT_LOOP_BUDGET));
        if let (Some(budget), Some(constructor)) = (budget, &mut class.constructor) {
            rtsl_opt::budget::run(constructor, budget);
        }
        class
    }

    /// Compiles a file. If it can't be read, the one diagnostic reports that.
    pub fn compile_file(&self, path: &Path) -> Compilation {
        match read_text(path) {
            Ok(text) => {
                let mut loader = FileLoader::beside(path, self.options.search_path.clone());
                self.compile_with(&path.display().to_string(), &text, &mut loader)
            }
            Err(reason) => unreadable(path, &reason),
        }
    }

    /// Returns the declarations of a file. Faults are passed over.
    ///
    /// # Errors
    /// If it can't be read.
    pub fn outline_file(&self, path: &Path) -> Result<Outline, Diagnostic> {
        let text = read_text(path).map_err(|reason| unreadable_file(path, &reason))?;
        let mut loader = FileLoader::beside(path, self.options.search_path.clone());
        Ok(self.outline(&path.display().to_string(), &text, &mut loader))
    }

    /// Returns the declarations of a text whose includes come from `loader`. Faults are passed over.
    pub fn outline(&self, name: &str, text: &str, loader: &mut dyn IncludeLoader) -> Outline {
        let mut outline = outline_of(name, text, loader);
        // Each round finds the bases of those of the round before.
        let mut seen = BTreeSet::new();
        loop {
            let missing = outline.missing_bases();
            let new = missing.into_iter().filter(|base| seen.insert(base.clone()));
            let new: Vec<ClassOutline> = new.filter_map(|base| library_class(&base)).collect();
            if new.is_empty() {
                return outline;
            }
            outline.inherited.extend(new);
        }
    }

    /// Returns the syntax tree of a file as text, with the diagnostics of parsing. Nothing is checked.
    pub fn print_syntax_tree(&self, path: &Path) -> (String, Compilation) {
        let text = match read_text(path) {
            Ok(text) => text,
            Err(reason) => return (String::new(), unreadable(path, &reason)),
        };
        let mut loader = FileLoader::beside(path, self.options.search_path.clone());
        let mut compilation =
            Compilation { unit: None, diagnostics: Diagnostics::new(), sources: SourceMap::new() };
        let Compilation { sources, diagnostics, .. } = &mut compilation;
        let file = sources.add(path.display().to_string(), text);
        let tree = rtsl_syntax::parse(sources, file, &mut loader, diagnostics);
        (rtsl_syntax::print::print(&tree), compilation)
    }
}

/// The texts whose places values have: all but those of the prelude.
pub(super) fn tracing(sources: &SourceMap) -> Tracing {
    let sources = sources.files().enumerate().map(|(index, (_, file))| {
        let source = || Source::new(file.name.clone(), file.text.clone());
        (index >= prelude::FILES.len()).then(|| Arc::new(source()))
    });
    Tracing { sources: sources.collect() }
}

fn outline_of(name: &str, text: &str, loader: &mut dyn IncludeLoader) -> Outline {
    let mut sources = SourceMap::new();
    let file = sources.add(name, text);
    let tree = rtsl_syntax::parse(&mut sources, file, loader, &mut Diagnostics::new());
    // The tree is dropped on the deep stack: dropping recurses.
    deep_stack::run(|| {
        let tree = tree;
        Outline::of(&tree, &sources)
    })
}

/// The declaration of a class of the standard library.
fn library_class(name: &str) -> Option<ClassOutline> {
    let file = library::file_of_class(name)?;
    outline_of(file.path, file.text, &mut FileLoader::default()).class(name).cloned()
}

fn unreadable_file(path: &Path, reason: &str) -> Diagnostic {
    let message = format!("`{}` can't be read: {reason}", path.display());
    Diagnostic::new(codes::UNREADABLE_FILE, message)
}

fn unreadable(path: &Path, reason: &str) -> Compilation {
    let mut diagnostics = Diagnostics::new();
    diagnostics.push(unreadable_file(path, reason));
    Compilation { unit: None, diagnostics, sources: SourceMap::new() }
}
