//! Shader sources, parsed and checked against the project's prelude.

use std::path::Path;

use rtsl_sema::check::check_unit;
use rtsl_sema::hir::Module;
use rtsl_sema::prelude::prelude;
use rtsl_source::{Diagnostic, Diagnostics, SourceMap, render};
use rtsl_syntax::{MemoryLoader, NoIncludes, ast, parse};

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
    let module = check_unit(&unit, Some(&prelude().checked), &mut diagnostics);
    (module, map, diagnostics.into_vec())
}

/// Returns the rendered diagnostics of a source.
pub fn diagnostics(text: &str) -> String {
    let (_, map, diagnostics) = check(text);
    render::all_to_text(&map, &diagnostics, false)
}

/// Returns the rendered diagnostics of a shader of the standard library, which may include others; none for a file that
/// others include.
pub fn library_diagnostics(path: &Path) -> String {
    let folder = path.parent().and_then(Path::parent).expect("the folder of the library");
    let mut loader = MemoryLoader::default();
    let mut name = String::new();
    for role in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        for file in role.read_dir().into_iter().flatten().map(|entry| entry.unwrap().path()) {
            let within = file.strip_prefix(folder).unwrap().to_string_lossy().replace('\\', "/");
            loader.files.insert(within.clone(), std::fs::read_to_string(&file).unwrap());
            if file == path {
                name = within;
            }
        }
    }
    let text = loader.files[&name].clone();
    if !text.lines().any(|line| line.starts_with("class ")) {
        return String::new();
    }
    let (mut map, mut diagnostics) = (SourceMap::new(), Diagnostics::new());
    let file = map.add(name, text);
    let unit = parse(&mut map, file, &mut loader, &mut diagnostics);
    check_unit(&unit, Some(&prelude().checked), &mut diagnostics);
    render::all_to_text(&map, diagnostics.iter(), false)
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
