//! What a test file's input is put through. One entry of [`MODES`] for each stage that can be
//! printed.

use libtest_mimic::Failed;
use rtsl_source::{Diagnostics, SourceMap, render};
use rtsl_syntax::MemoryLoader;
use rtsl_syntax::ast::TranslationUnit;

use crate::file::TestFile;

/// A way to turn an input into text.
pub struct Mode {
    /// The name in test files.
    pub name: &'static str,
    /// Gives the text that the expectation is compared with.
    pub run: fn(&TestFile<'_>) -> Result<String, Failed>,
}

/// All modes; `tests/README.md` describes them.
pub const MODES: &[Mode] =
    &[Mode { name: "ast", run: ast }, Mode { name: "syntax-errors", run: syntax_errors }];

/// The mode of this name.
pub fn find(name: &str) -> Option<&'static Mode> {
    MODES.iter().find(|mode| mode.name == name)
}

/// The tree of a text without errors.
fn ast(test: &TestFile<'_>) -> Result<String, Failed> {
    let (map, unit, diagnostics) = parse(test);
    if diagnostics.has_errors() {
        return Err(render::all_to_text(&map, diagnostics.iter(), false).into());
    }
    Ok(rtsl_syntax::print::print(&unit))
}

/// The diagnostics of preprocessor and parser.
fn syntax_errors(test: &TestFile<'_>) -> Result<String, Failed> {
    let (map, _, diagnostics) = parse(test);
    Ok(render::all_to_text(&map, diagnostics.iter(), false))
}

fn parse(test: &TestFile<'_>) -> (SourceMap, TranslationUnit, Diagnostics) {
    let mut files = test.files().into_iter();
    let (name, text) = files.next().unwrap_or_default();
    let mut map = SourceMap::new();
    let file = map.add(name.clone(), text.clone());
    // The file itself is there too, so that it can include itself.
    let mut loader = MemoryLoader { files: files.collect() };
    loader.files.insert(name, text);
    let mut diagnostics = Diagnostics::new();
    let unit = rtsl_syntax::parse(&mut map, file, &mut loader, &mut diagnostics);
    (map, unit, diagnostics)
}
