//! The C++ that the manual shows is what the compiler writes.

use rtsl::aot::AotOptions;
use rtsl::{Backend, Compiler, Engine, EngineOptions, library};

fn sphere() -> String {
    let unit = library::unit_of_class(&Compiler::default(), "Sphere").unwrap();
    let options = EngineOptions { backend: Backend::Interpreter, ..EngineOptions::default() };
    let (engine, _) = Engine::new(options).unwrap();
    engine.aot_library(unit.classes(), &AotOptions::default()).unwrap().cpp()
}

#[test]
fn the_manual_shows_the_spheres_intersect() {
    let page = include_str!("../../../../docs/src/how-to/embed-cpp.md");
    let shown = page.split("```").find(|block| block.contains("bool intersect(State &state)"));
    let shown = shown.expect("the page has it").trim_start_matches("cpp\n");
    let text = sphere();
    let start = text.find("    bool intersect(").unwrap();
    let end = start + text[start..].find("\n    }\n").unwrap() + "\n    }\n".len();
    let written = text[start..end].lines().map(|line| line.strip_prefix("    ").unwrap_or(line));
    let written: String = written.map(|line| format!("{line}\n")).collect();
    assert_eq!(shown, written, "take this for the page:\n{written}");
}

#[test]
fn the_same_text_every_time() {
    assert_eq!(sphere(), sphere());
}
