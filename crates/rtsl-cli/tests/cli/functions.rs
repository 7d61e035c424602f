//! `rtsl eval` of functions that are no methods.

use expect_test::expect;

use crate::command::{DONE, Folder, INPUT_AT_FAULT, WRONG_USAGE};

const WAVES: &str = "struct Wave { float height; vec2 slope; };
float halved(float x) { return 0.5 * x; }
int halved(int x) { return x / 2; }
vec3 turned(vec3 v) { return v.yzx; }
color turned(color c) { return c; }
Wave wave(float x) { Wave w; w.height = x; w.slope = vec2(x, 1.0); return w; }
class Waves : rt_Texture {
    public float scale = 2.0;
    scratch float unrelated;
    float at(float x) { return scale * halved(x); }
    void mark() { unrelated = 7.0; rt_FloatTextureValue = 1.0; }
    bool split(float x, out float whole, inout vec2 sum) {
        whole = floor(x);
        sum += vec2(x);
        return x > 0.0;
    }
    float sum(float values[3]) { return values[0] + values[1] + values[2]; }
    float across() { return rt_TextureUV.x; }
    void lookup() { rt_FloatTextureValue = at(rt_TextureUV.x); }
};
class Long : Waves {
    float at(float x) { return 10.0 * super.at(x); }
    float level() { return 1.0; }
}; // the end";

fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("waves.rtsl", WAVES);
    folder
}

fn evaluated(folder: &Folder, arguments: &[&str]) -> String {
    let arguments = [&["eval", "waves.rtsl"][..], arguments].concat();
    folder.run(&arguments).exits(DONE).output()
}

#[test]
fn functions_have_results_and_out_parameters() {
    let folder = folder("functions");
    let run = |arguments: &[&str]| evaluated(&folder, arguments);
    let of_class = ["--class", "Waves"];
    assert!(run(&["at", "--class", "Waves", "--arg", "x=3"]).contains("result = 3.0\n"));
    let scaled = ["at", "--class", "Waves", "--arg", "x=3", "--param", "scale=4"];
    assert!(run(&scaled).contains("result = 6.0\n"));
    // Instances of the class call its own functions.
    assert!(run(&["at", "--class", "Long", "--arg", "x=3"]).contains("result = 30.0\n"));
    assert!(run(&["level"]).contains("result = 1.0\n"));
    let split = [&["split", "--arg", "x=2.5", "--arg", "sum=1,2"][..], &of_class].concat();
    expect![[r#"
        result = true
        sum = [3.5,4.5]
        whole = 2.0
    "#]]
    .assert_eq(&run(&split));
    assert!(run(&["sum", "--class", "Waves", "--arg", "values=[1,2,3.5]"]).contains("= 6.5\n"));
    let across = ["across", "--class", "Waves", "--state", "rt_TextureUV=0.25,0"];
    assert!(run(&across).contains("result = 0.25\n"));
    assert_eq!(
        run(&["mark", "--class", "Waves"]),
        "rt_FloatTextureValue = 1.0\nrt_TextureColor = [1.0,1.0,1.0]\nunrelated = 7.0\n"
    );
    let wave = run(&["wave", "--arg", "x=2"]);
    assert_eq!(wave, "result = {\"height\":2.0,\"slope\":[2.0,1.0]}\n");
}

#[test]
fn overloads_are_chosen_by_their_arguments() {
    let folder = folder("overloads");
    let run = |arguments: &[&str]| evaluated(&folder, arguments);
    assert_eq!(run(&["halved", "--arg", "x=7"]), "result = 3\n");
    assert_eq!(run(&["halved", "--arg", "x=7.0"]), "result = 3.5\n");
    assert_eq!(run(&["halved(float)", "--arg", "x=7"]), "result = 3.5\n");
    assert_eq!(run(&["turned", "--arg", "v=1,2,3"]), "result = [2.0,3.0,1.0]\n");
    assert_eq!(run(&["turned", "--arg", "c=1,2,3"]), "result = [1.0,2.0,3.0]\n");
}

#[test]
fn functions_of_the_library_are_inherited() {
    let folder = Folder::new("library-functions");
    folder.write("lamp.rtsl", "class IesLight : IesLight { };\nclass Lamp : IesLight { };\n");
    let arguments = ["--arg", "low=1", "--arg", "high=3", "--arg", "angle=1.5"];
    for class in ["Lamp", "IesLight"] {
        let call = [&["eval", "lamp.rtsl", "part", "--class", class][..], &arguments].concat();
        assert_eq!(folder.run(&call).exits(DONE).output(), "result = 0.25\n");
    }
}

#[test]
fn generic_functions_are_called_for_each_size() {
    let folder = Folder::new("generic-functions");
    folder.write(
        "generic.rtsl",
        "genType twice(genType a, float b) { return b * a; }\nenum Kind { First, Second = 4 };\n\
         int number(Kind kind) { return int(kind); }\n",
    );
    let run = |arguments: &[&str]| {
        folder.run(&[&["eval", "generic.rtsl"][..], arguments].concat()).exits(DONE).output()
    };
    assert_eq!(run(&["twice", "--arg", "a=3.0", "--arg", "b=2"]), "result = 6.0\n");
    assert_eq!(run(&["twice", "--arg", "a=1,2", "--arg", "b=2"]), "result = [2.0,4.0]\n");
    assert_eq!(run(&["number", "--arg", "kind=4"]), "result = 4\n");
}

#[test]
fn wrong_calls_say_how_to_call() {
    let folder = folder("wrong-calls");
    let fails = |arguments: &[&str], expected: &str| {
        let arguments = [&["eval", "waves.rtsl"][..], arguments].concat();
        let errors = folder.run(&arguments).exits(WRONG_USAGE).errors();
        assert!(errors.contains(expected), "{expected}\n{errors}");
    };
    fails(
        &["halvd", "--arg", "x=1"],
        "there is no method or function `halvd`; did you mean `halved`?",
    );
    fails(
        &["wave"],
        "`Wave wave(float x)` is not called with these arguments: give `--arg x=VALUE`",
    );
    fails(&["wave", "--arg", "x=1", "--arg", "y=1"], "there is no parameter `y`");
    let whole =
        ["split", "--class", "Waves", "--arg", "x=1", "--arg", "sum=1,2", "--arg", "whole=1"];
    fails(&whole, "`whole` is an out parameter, which takes no value");
    fails(
        &["halved", "--arg", "y=1"],
        "no `halved` has parameters of these names; there are `float halved(float x)`, `int halved(int x)`",
    );
    fails(&["halved", "--arg", "x=true"], "no `halved` takes values like these");
    fails(&["halved(vec2)", "--arg", "x=1"], "no `halved` has parameters of these types");
    fails(&["at", "--arg", "x=1"], "choose a class with `--class`");
    fails(&["lookup", "--class", "Waves", "--arg", "x=1"], "`x` is an argument of a function");
    folder.write("two.rtsl", "float f(vec3 v) { return 1.0; }\nfloat f(color v) { return 2.0; }\n");
    let errors =
        folder.run(&["eval", "two.rtsl", "f", "--arg", "v=1,2,3"]).exits(WRONG_USAGE).errors();
    assert!(errors.contains("several functions `f` take these arguments"), "{errors}");
    assert!(errors.contains("name its types, as in `'f(vec3)'`"), "{errors}");
    let run = folder.run(&["eval", "two.rtsl", "f(color)", "--arg", "v=1,2,3"]).exits(DONE);
    assert_eq!(run.output(), "result = 2.0\n");
    folder.write(
        "endless.rtsl",
        "float f() { float x = 0.0; while (x >= 0.0) x += 0.5; return x; }\n",
    );
    folder.run(&["eval", "endless.rtsl", "f", "--budget", "100"]).fails_with("E0619");
    folder.write("broken.rtsl", "float f() { return y; }\n");
    folder.run(&["eval", "broken.rtsl", "f"]).fails_with("E0201");
}

#[test]
fn functions_of_all_roles_are_called() {
    let folder = Folder::new("functions-of-roles");
    for (role, body) in [
        ("Camera", "void generateRay() {}"),
        ("Primitive", "void intersect() { hit(twice(1.0)); }"),
        ("Texture", "void lookup() {}"),
        ("Material", "void emission() { rt_EmissionColor = color(twice(1.0)); }"),
        ("Light", "void illumination() {}"),
        ("Integrator", "void radiance() { rt_SampleColor = color(twice(1.0)); }"),
    ] {
        let text =
            format!("class A : rt_{role}; float twice(float x) {{ return 2.0 * x; }}\n{body}\n");
        folder.write("a.rtsl", text);
        let run = folder.run(&["eval", "a.rtsl", "twice", "--arg", "x=2"]).exits(DONE);
        assert!(run.output().contains("result = 4.0\n"), "{role}: {}", run.output());
    }
    // What only some methods know is read in one of them.
    folder.write(
        "normal.rtsl",
        "class A : rt_Primitive; vec3 at() { return rt_HitPoint; }
         void intersect() { hit(1.0); } void computeNormal() { rt_GeometricNormal = at(); }",
    );
    let arguments = ["eval", "normal.rtsl", "at", "--state", "rt_HitPoint=1,2,3"];
    assert!(folder.run(&arguments).exits(DONE).output().contains("result = [1.0,2.0,3.0]\n"));
}

#[test]
fn requests_call_functions_for_many_rays() {
    let folder = folder("function-requests");
    let requests = r#"{"id": 1, "source": "float f(float x, out int n) { n = int(x); return x * x; }", "method": "f", "args": {"x": {"lanes": [1.5, 2.5]}}}
{"id": 2, "file": "waves.rtsl", "class": "Waves", "method": "at", "args": {"x": 3}, "backend": "interp"}
{"id": 3, "source": "float f(float x) { return x; }", "method": "g"}"#;
    let answers = folder.run_with(&["eval", "--stdin"], requests).exits(DONE).output();
    expect![[r#"
        {"id":1,"ok":true,"diagnostics":[],"result":{"lanes":[2.25,6.25]},"out":{"n":{"lanes":[1,2]}},"state":{},"scratch":{}}
        {"id":2,"ok":true,"diagnostics":[],"result":{"lanes":[3.0]},"out":{},"state":{},"scratch":{}}
        {"id":3,"ok":false,"error":"there is no method or function `g`; did you mean `f`?","diagnostics":[]}
    "#]]
    .assert_eq(&answers);
    let json = folder.run(&["eval", "waves.rtsl", "halved", "--arg", "x=true", "--json"]);
    json.exits(INPUT_AT_FAULT);
}
