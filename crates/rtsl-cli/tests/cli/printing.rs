//! Prints and traces of `rtsl eval` and `rtsl render --pixel`, and the lines of `rtsl bench`.

use expect_test::expect;
use serde_json::Value as Json;

use crate::command::{DONE, Folder, INPUT_AT_FAULT, WRONG_USAGE};

const STEPS: &str = "float twice(float x) {
    print(\"twice {}\", x);
    return 2.0 * x;
}
class Steps : rt_Texture;
public int count = 2;
scratch int calls;
void lookup() {
    for (int i = 0; i < count; i++) print(\"{} of {}: {}\", i, count, rt_TextureUV.x > 0.5);
    calls++;
    print(\"{{}} {} {} {}\", vec2(rt_TextureUV), mat2(1.0, 2.0, 3.0, 4.0), color(0.5));
    rt_FloatTextureValue = twice(rt_TextureUV.x) / rt_TextureUV.y;
}
";

fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("steps.rtsl", STEPS);
    folder
}

fn eval(arguments: &[&str]) -> (String, String) {
    let ran = folder("prints").run(&[&["eval", "steps.rtsl"], arguments].concat()).exits(DONE);
    (ran.output(), ran.errors())
}

#[test]
fn methods_and_functions_print_in_order() {
    let (output, _) = eval(&["lookup", "--state", "rt_TextureUV=0.75,0.5"]);
    expect![[r#"
        steps.rtsl:9: Steps.lookup: 0 of 2: true
        steps.rtsl:9: Steps.lookup: 1 of 2: true
        steps.rtsl:11: Steps.lookup: {} (0.75, 0.5) ((1.0, 2.0), (3.0, 4.0)) (0.5, 0.5, 0.5)
        steps.rtsl:2: Steps.lookup: twice 0.75
        rt_FloatTextureValue = 3.0
        rt_TextureColor = [3.0,3.0,3.0]
        calls = 1
    "#]]
    .assert_eq(&output);
    let (output, _) = eval(&["twice", "--arg", "x=1.5"]);
    expect![[r#"
        steps.rtsl:2: twice: twice 1.5
        result = 3.0
    "#]]
    .assert_eq(&output);
}

/// The values are those of a text without prints, by machine code and by the interpreter.
#[test]
fn values_do_not_depend_on_prints() {
    let folder = folder("values");
    let plain: String =
        STEPS.lines().filter(|it| !it.contains("print(")).map(|it| format!("{it}\n")).collect();
    folder.write("plain.rtsl", plain);
    for backend in ["jit", "interp"] {
        let values = |file: &str| {
            let arguments =
                ["eval", file, "lookup", "--backend", backend, "--state", "rt_TextureUV=0.3,0.7"];
            let output = folder.run(&arguments).exits(DONE).output();
            let is_value = |line: &&str| line.contains(" = ") && !line.contains(": ");
            output.lines().filter(is_value).map(str::to_owned).collect::<Vec<_>>()
        };
        let values = ["plain.rtsl", "steps.rtsl"].map(values);
        assert_eq!(values[0].len(), 3, "{values:?}");
        assert_eq!(values[0], values[1]);
    }
}

#[test]
fn traces_show_calls_assignments_and_numbers_that_are_not_finite() {
    let arguments =
        ["lookup", "--state", "rt_TextureUV=0.75,0", "--param", "count=1", "--trace=lines"];
    let (output, errors) = eval(&arguments);
    expect![[r#"
        Steps.lookup(rt_TextureUV = (0.75, 0.0))
          steps.rtsl:9: i = 0
          steps.rtsl:9: Steps.lookup: 0 of 1: true
          steps.rtsl:9: i = 1
          steps.rtsl:10: calls = 1
          steps.rtsl:11: Steps.lookup: {} (0.75, 0.0) ((1.0, 2.0), (3.0, 4.0)) (0.5, 0.5, 0.5)
          steps.rtsl:2: Steps.lookup: twice 0.75
          steps.rtsl:12: rt_FloatTextureValue = inf
          steps.rtsl:12: Steps.lookup: inf is made here
        Steps.lookup returns rt_TextureColor = (inf, inf, inf), rt_FloatTextureValue = inf
        rt_FloatTextureValue = inf
        rt_TextureColor = ["Infinity","Infinity","Infinity"]
        calls = 1
    "#]]
    .assert_eq(&output);
    expect![[r#"
        warning[W0631]: a value that leaves `Steps.lookup` is not finite: inf
           ┌─ steps.rtsl:12:28
           │
        12 │     rt_FloatTextureValue = twice(rt_TextureUV.x) / rt_TextureUV.y;
           │                            ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^ made of finite numbers here

    "#]].assert_eq(&errors);
    // An infinity that is given is not made.
    let given = ["lookup", "--state", "rt_TextureUV=[\"Infinity\",1]", "--trace"];
    assert_eq!(eval(&given).1, "");
}

#[test]
fn answers_have_entries_by_lane() {
    let request = serde_json::json!({
        "source": STEPS, "method": "lookup", "params": {"count": 0},
        "state": {"rt_TextureUV": {"lanes": [[0.25, 1], [0.5, 1]]}},
    });
    let ran =
        folder("requests").run_with(&["eval", "--stdin"], &format!("{request}\n")).exits(DONE);
    let answer: Json = serde_json::from_str(&ran.output()).unwrap();
    let entries = answer["trace"]["entries"].as_array().unwrap();
    let shown = |it: &Json| format!("{} {} {} {}", it["lane"], it["file"], it["line"], it["text"]);
    let shown: Vec<String> = entries.iter().map(shown).collect();
    expect![[r#"
        [
            "0 \"request.rtsl\" 11 \"{} (0.25, 1.0) ((1.0, 2.0), (3.0, 4.0)) (0.5, 0.5, 0.5)\"",
            "0 \"request.rtsl\" 2 \"twice 0.25\"",
            "1 \"request.rtsl\" 11 \"{} (0.5, 1.0) ((1.0, 2.0), (3.0, 4.0)) (0.5, 0.5, 0.5)\"",
            "1 \"request.rtsl\" 2 \"twice 0.5\"",
        ]
    "#]]
    .assert_eq(&format!("{shown:#?}\n"));
}

const SCENE: &str = "LookAt 0 0 -4  0 0 0  0 1 0
Camera \"Pinhole\" \"float fov\" 40
Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 6
Sampler \"stratified\" \"integer pixelsamples\" 2
WorldBegin
LightSource \"DirectionalLight\" \"vector3 direction\" [1 -1 2]
Texture \"steps\" \"float\" \"Steps\" \"integer count\" 0
Material \"Lambertian\" \"texture kd\" \"steps\"
Shape \"Sphere\"
";

#[test]
fn one_pixel_of_a_scene() {
    let folder = folder("pixel");
    folder.write("scene.pbrt", SCENE);
    let run = |arguments: &[&str]| {
        folder.run(&[&["render", "scene.pbrt", "--pixel"], arguments].concat())
    };
    run(&["4,3", "--sample", "1"]).exits(DONE).prints(expect![[r#"
        sample 1: (0.2136033, 0.2136033, 0.2136033)
          steps.rtsl:11: Steps.lookup: {} (0.28415465, 0.47121412) ((1.0, 2.0), (3.0, 4.0)) (0.5, 0.5, 0.5)
          steps.rtsl:2: Steps.lookup: twice 0.28415465
          steps.rtsl:11: Steps.lookup: {} (0.28415465, 0.47121412) ((1.0, 2.0), (3.0, 4.0)) (0.5, 0.5, 0.5)
          steps.rtsl:2: Steps.lookup: twice 0.28415465
        pixel 4,3: (0.2136033, 0.2136033, 0.2136033), sample 1
    "#]]);
    let json: Json =
        serde_json::from_str(&run(&["4,3", "--json", "--trace"]).exits(DONE).output()).unwrap();
    assert_eq!((&json["pixel"][0], &json["pixel"][1]), (&Json::from(4), &Json::from(3)));
    let samples = json["samples"].as_array().unwrap();
    assert_eq!(samples.len(), 2);
    assert!(
        samples[1]["prints"]
            .as_array()
            .unwrap()
            .iter()
            .any(|it| it.as_str().unwrap().starts_with("twice"))
    );
    let kinds = |kind: &str| {
        samples[0]["entries"].as_array().unwrap().iter().filter(|it| it["kind"] == kind).count()
    };
    assert!(kinds("call") > 3 && kinds("call") == kinds("return") && kinds("note") > 0);
    // The sky.
    run(&["0,0"]).exits(DONE).prints(expect![[r#"
        pixel 0,0: (0.0, 0.0, 0.0), the mean of 2 samples
    "#]]);
    run(&["8,0"]).exits(INPUT_AT_FAULT).fails_with("E0627");
    for wrong in [&["4"][..], &["4,3", "-o", "picture.png"], &["x,y"], &["4,3", "--trace=all"]] {
        run(wrong).exits(WRONG_USAGE);
    }
    folder.run(&["render", "scene.pbrt"]).exits(WRONG_USAGE);
    folder.run(&["render", "scene.pbrt", "-o", "a.png", "--trace"]).exits(WRONG_USAGE);
}

const BRANCHES: &str = "class Branches : rt_Texture;
void lookup() {
    float x = rt_TextureUV.x;
    for (int i = 0; i < 8; i++) {
        if (x > 0.1 * float(i)) {
            x = sin(x) + exp(x) / (1.0 + x);
            x = 0.5 * sqrt(x) + pow(x, 0.3);
        }
    }
    rt_FloatTextureValue = x;
}
";

#[test]
fn lines_have_cost_active_lanes_and_divergence() {
    let folder = Folder::new("lines");
    folder.write("branches.rtsl", BRANCHES);
    let run = |arguments: &[&str]| {
        let common = ["bench", "branches.rtsl", "lookup", "--lines"];
        folder.run(&[&common[..], arguments].concat()).exits(DONE).output()
    };
    let coordinate = "rt_TextureUV={\"lanes\": [[0, 0], [0.85, 0]]}";
    let all = run(&["--json", "--state", coordinate]);
    let lines: Vec<Json> = all.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let cost: f64 = lines.iter().map(|line| line["cost"].as_f64().unwrap()).sum();
    assert!((cost - 1.0).abs() < 1e-6, "{cost}");
    let line = |number: u32| lines.iter().find(|it| it["line"] == number).unwrap();
    // Of each chunk of rays one half takes the branch.
    assert!(line(5)["diverged"].as_u64().unwrap() > 0, "{}", line(5));
    assert!(line(6)["activeLanes"].as_f64().unwrap() < 0.9, "{}", line(6));
    assert!(line(6)["cost"].as_f64().unwrap() > line(5)["cost"].as_f64().unwrap());
    let text = run(&["--state", "rt_TextureUV=0.85,0", "--width", "4", "--call-mode", "packet"]);
    assert!(text.starts_with("Branches.lookup: 256 rays, packet, 4 at a time"), "{text}");
    assert!(text.contains("            x = sin(x) + exp(x) / (1.0 + x);"), "{text}");
    assert!(!text.contains("% 50"), "{text}");
}
