//! A report is the same whatever runs the code.

use rtsl::{Backend, Compiler, Engine, EngineOptions, Instance, library};
use rtsl_contract::{Options, Report, check, engine_options};

fn report(path: &str, backend: Backend, width: Option<u32>) -> Option<Report> {
    let file = library::files().iter().find(|file| file.path == path).expect("the library has it");
    let unit = Compiler::default().compile(file.path, file.text).unit.expect("it compiles");
    let instance = Instance::new(&unit.classes()[0], []).expect("it has defaults");
    // Without LLVM there is nothing to compare.
    let (engine, _) = Engine::new(EngineOptions { backend, width, ..engine_options() }).ok()?;
    let options = Options { samples: 1000, seed: 7, compare_bits: false };
    Some(check(&engine, &instance, &options).expect("it has code"))
}

#[test]
fn the_interpreter_and_machine_code_give_the_same_report() {
    for path in [
        "shaders/materials/phong.rtsl",
        "shaders/primitives/disk.rtsl",
        "shaders/lights/constant_sky.rtsl",
        "shaders/cameras/thin_lens.rtsl",
        "shaders/textures/checker.rtsl",
    ] {
        let expected = report(path, Backend::Interpreter, None).expect("the interpreter is there");
        assert!(expected.holds(), "{path}\n{expected}");
        for width in [4, 8] {
            let Some(found) = report(path, Backend::Jit, Some(width)) else { continue };
            assert_eq!(found, expected, "{path} at width {width}");
        }
    }
}
