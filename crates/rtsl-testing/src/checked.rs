//! Shader sources, parsed and checked against the project's prelude.

use std::path::Path;
use std::sync::LazyLock;

use rtsl_sema::check::{Prelude, check_prelude, check_unit};
use rtsl_sema::hir::Module;
use rtsl_source::{Diagnostic, Diagnostics, SourceMap, render};
use rtsl_syntax::{NoIncludes, ast, parse};

/// The project's prelude, checked once.
pub static PRELUDE: LazyLock<Prelude> = LazyLock::new(|| {
    let (prelude, text) = checked_prelude();
    assert_eq!(text, "", "the prelude is in error");
    prelude
});

/// Returns the project's prelude and its diagnostics.
pub fn checked_prelude() -> (Prelude, String) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../prelude");
    let mut paths: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let mut map = SourceMap::new();
    let mut diagnostics = Diagnostics::new();
    let mut units = Vec::new();
    for path in paths {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let file = map.add(name, std::fs::read_to_string(&path).unwrap());
        units.push(parse(&mut map, file, &mut NoIncludes, &mut diagnostics));
    }
    let prelude = check_prelude(&units, &mut diagnostics);
    let text = render::all_to_text(&map, diagnostics.iter(), false);
    (prelude, text)
}

/// Returns the tree of a source, with its source map.
pub fn parse_text(text: &str, diagnostics: &mut Diagnostics) -> (SourceMap, ast::TranslationUnit) {
    let mut map = SourceMap::new();
    let file = map.add("shader.rtsl", text);
    let unit = parse(&mut map, file, &mut NoIncludes, diagnostics);
    (map, unit)
}

/// Returns the typed tree of a source and its diagnostics.
pub fn check(text: &str) -> (Module, SourceMap, Vec<Diagnostic>) {
    let mut diagnostics = Diagnostics::new();
    let (map, unit) = parse_text(text, &mut diagnostics);
    let module = check_unit(&unit, Some(&PRELUDE), &mut diagnostics);
    (module, map, diagnostics.into_vec())
}

/// Returns the rendered diagnostics of a source.
pub fn diagnostics(text: &str) -> String {
    let (_, map, diagnostics) = check(text);
    render::all_to_text(&map, &diagnostics, false)
}

/// Returns the codes of the diagnostics of a source.
pub fn codes(text: &str) -> Vec<&'static str> {
    check(text).2.iter().map(|diagnostic| diagnostic.code.as_str()).collect()
}

/// Returns the source of a texture whose `lookup` has this body.
pub fn texture(body: &str) -> String {
    format!("class C : rt_Texture;\nvoid lookup() {{\n{body}\n}}\n")
}

/// Returns `inner` within `depth` pairs of `open` and `close`.
pub fn nested(open: &str, inner: &str, close: &str, depth: usize) -> String {
    open.repeat(depth) + inner + &close.repeat(depth)
}
