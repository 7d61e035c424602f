//! Modules, classes of the library as bases, and calls of inherited functions.

use rtsl::{Compilation, Compiler, Instance, MemoryLoader, Method, new_state};

use crate::common::{call_packet, component, engines};

/// Compiles a text that may import these files.
fn compile(text: &str, files: &[(&str, &str)]) -> Compilation {
    let mut loader = MemoryLoader::default();
    for (name, text) in files {
        loader.files.insert((*name).to_owned(), (*text).to_owned());
    }
    Compiler::default().compile_with("test.rtsl", text, &mut loader)
}

/// The value of a texture at u = 0.25, which is the same on all backends.
fn value(text: &str, class: &str, files: &[(&str, &str)]) -> f32 {
    let compilation = compile(text, files);
    assert_eq!(compilation.report(false), "");
    let instance = Instance::new(compilation.unit.unwrap().class(class).unwrap(), []).unwrap();
    let values = engines().into_iter().map(|engine| {
        let mut state = new_state(1);
        state.floats_mut(component("rt_TextureUV"))[0] = 0.25;
        call_packet(&engine, &instance, Method::Lookup, &mut state);
        state.floats(component("rt_FloatTextureValue"))[0]
    });
    let values: Vec<f32> = values.collect();
    assert!(values.iter().all(|value| value.to_bits() == values[0].to_bits()), "{values:?}");
    values[0]
}

const WAVES: (&str, &str) = (
    "water/waves.rtsl",
    "import water.scale;
     const float HEIGHT = 2.0;
     float height(float x) { return HEIGHT * x * scale.SCALE; }
     class Wave : rt_Texture {
         private float phase;
         constructor() { phase = HEIGHT; }
         float at(float x) { return height(x) + phase; }
         void lookup() { rt_FloatTextureValue = at(rt_TextureUV.x); }
     };",
);
const SCALE: (&str, &str) = ("water/scale.rtsl", "const float SCALE = 4.0;");

#[test]
fn functions_and_constants_of_modules_have_qualified_names() {
    let text = "import water.waves as w; import water.scale;
        const float HEIGHT = 100.0;
        class A : rt_Texture { void lookup() { rt_FloatTextureValue = w.height(rt_TextureUV.x) + scale.SCALE + HEIGHT; } };";
    assert_eq!(value(text, "A", &[WAVES, SCALE]), 2.0 + 4.0 + 100.0);
}

#[test]
fn inherited_text_has_the_names_of_its_module() {
    // `HEIGHT` in inherited text is that of the module.
    let text = "import water.waves as w;
        const float HEIGHT = 100.0;
        class A : w.Wave { float at(float x) { return super.at(x) + HEIGHT; } };";
    assert_eq!(value(text, "A", &[WAVES, SCALE]), 4.0 + 100.0);
}

#[test]
fn the_unit_has_its_own_classes_only() {
    let text = "import water.waves; class A : waves.Wave {}; class B : Checker {};";
    let compilation = compile(text, &[WAVES, SCALE]);
    assert_eq!(compilation.report(false), "");
    let names: Vec<String> =
        compilation.unit.unwrap().classes().iter().map(|it| it.name.clone()).collect();
    assert_eq!(names, ["A", "B"]);
}

#[test]
fn classes_of_the_library_are_inherited_without_an_import() {
    let text = "class Half : Constant { void lookup() { super.lookup(); rt_FloatTextureValue = 0.5 * luminance(rt_TextureColor); } };
        class Constant : Constant { };";
    let compilation = compile(text, &[]);
    assert_eq!(compilation.report(false), "");
    let classes = compilation.unit.unwrap();
    let parameters = |class: &str| classes.class(class).unwrap().parameters.len();
    assert_eq!(parameters("Half"), 1);
    assert_eq!(parameters("Constant"), 1);
}

#[test]
fn super_calls_reach_each_generation() {
    let text = "class A : rt_Texture {
            private float a; constructor() { a = 1.0; }
            float f(float x) { return x + a; }
            float g() { return f(1.0); }
            void lookup() { rt_FloatTextureValue = g(); }
        };
        class B : A { float f(float x) { return 10.0 * super.f(x); } };
        class C : B {
            private float c; constructor() { super.constructor(); c = a + 1.0; }
            float f(float x) { return super.f(x) + 100.0 * c; }
            void lookup() { super.lookup(); rt_FloatTextureValue += 1000.0; }
        };";
    assert_eq!(value(text, "A", &[]), 2.0);
    assert_eq!(value(text, "B", &[]), 20.0);
    assert_eq!(value(text, "C", &[]), 20.0 + 200.0 + 1000.0);
}

#[test]
fn modules_have_generic_functions_and_enumerations() {
    let module = (
        "tools.rtsl",
        "const float GAIN = 3.0;
         enum Kind { Soft, Hard = 4 };
         genType amplify(genType x) { return x * GAIN; }",
    );
    let text = "import tools;
        const float GAIN = 100.0;
        class A : rt_Texture {
            public tools.Kind kind = tools.Hard;
            void lookup() { rt_FloatTextureValue = tools.amplify(rt_TextureUV).x + tools.amplify(1.0) + float(kind); }
        };";
    assert_eq!(value(text, "A", &[module]), 0.75 + 3.0 + 4.0);
}

#[test]
fn too_many_modules_are_an_error() {
    let files: Vec<(String, String)> = (0..300)
        .map(|it| (format!("m{it}.rtsl"), format!("import m{}; const float X = 1.0;", it + 1)))
        .collect();
    let files: Vec<(&str, &str)> = files.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
    let text =
        "import m0; class A : rt_Texture { void lookup() { rt_FloatTextureValue = m0.X; } };";
    let report = compile(text, &files).report(false);
    assert!(report.contains("E0019"), "{report}");
}
