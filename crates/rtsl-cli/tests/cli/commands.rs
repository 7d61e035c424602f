//! Runs the command as its users do: what it prints, and how it exits.

use std::path::Path;
use std::process::{Command, Stdio};

use expect_test::expect;
use rtsl_image::Aov;

use crate::command::{DONE, Folder, INPUT_AT_FAULT, SPHERE, WRONG_USAGE, rtsl};

#[test]
fn check_accepts_and_refuses() {
    let folder = Folder::new("check");
    folder.write("good.rtsl", SPHERE);
    folder.write(
        "bad.rtsl",
        "class A : rt_Texture;\nvoid lookup() { rt_TextureColor = colour(1); }\n",
    );
    let good = folder.run(&["check", "good.rtsl"]).exits(DONE);
    assert_eq!(good.errors(), "");
    let bad = folder.run(&["check", "good.rtsl", "bad.rtsl"]).exits(INPUT_AT_FAULT);
    assert!(bad.errors().contains("bad.rtsl:2:35"), "{}", bad.errors());
    assert!(bad.errors().ends_with("error: 1 error in 2 files\n"), "{}", bad.errors());
    folder.run(&["check"]).exits(WRONG_USAGE);
    folder.run(&["check", "--no-such-option", "good.rtsl"]).exits(WRONG_USAGE);
    folder.run(&["chekc"]).exits(WRONG_USAGE);
}

#[test]
fn check_prints_diagnostics_as_json() {
    let folder = Folder::new("check-json");
    folder.write("bad.rtsl", "class A : rt_Texture;\nfloat x = 1 +;\n");
    let ran = folder.run(&["check", "--json", "bad.rtsl"]).exits(INPUT_AT_FAULT);
    assert_eq!(ran.errors(), "");
    ran.prints(expect![[r#"
        {"code":"E0101","severity":"error","message":"expected an expression, found `;`","file":"bad.rtsl","line":2,"column":14,"endLine":2,"endColumn":15,"notes":[],"help":[]}
    "#]]);
}

#[test]
fn colors_are_as_asked() {
    let folder = Folder::new("colors");
    folder.write("bad.rtsl", "float");
    let is_colored = |arguments: &[&str]| folder.run(arguments).errors().contains('\u{1b}');
    assert!(is_colored(&["check", "bad.rtsl", "--color", "always"]));
    assert!(!is_colored(&["check", "bad.rtsl", "--color", "never"]));
    assert!(!is_colored(&["check", "bad.rtsl"]));
}

#[test]
fn unreadable_files_are_errors() {
    let folder = Folder::new("unreadable");
    folder.write("latin1.rtsl", b"// \xe4\n");
    for file in ["missing.rtsl", "latin1.rtsl", "."] {
        folder.run(&["check", file]).fails_with("E0601");
        folder.run(&["build", file, "--emit", "ir"]).fails_with("E0601");
        folder.run(&["build", file, "--emit", "ast"]).fails_with("E0601");
        folder.run(&["eval", file, "lookup"]).fails_with("E0601");
        folder.run(&["bench", file]).fails_with("E0601");
    }
    let render = folder.run(&["render", "missing.pbrt", "-o", "x.png"]).exits(INPUT_AT_FAULT);
    assert!(render.errors().contains("error[E0601]"), "{}", render.errors());
}

#[test]
fn hostile_texts_are_one_error_each() {
    let folder = Folder::new("hostile");
    let texture = "class A : rt_Texture;\n";
    folder.write("long.rtsl", format!("{texture}float {};", "x".repeat(2 << 20)));
    folder.run(&["check", "long.rtsl"]).fails_with("E0007");
    let deep = format!("{texture}float x = {}1{};", "(".repeat(10_000), ")".repeat(10_000));
    folder.write("deep.rtsl", deep);
    folder.run(&["check", "deep.rtsl"]).fails_with("E0104");
    folder.write("cycle.rtsl", "#include \"cycle2.rtsl\"\n");
    folder.write("cycle2.rtsl", "#include \"cycle.rtsl\"\n");
    folder.run(&["check", "cycle.rtsl"]).fails_with("E0021");
    for (name, text, code) in [
        ("recursive", "class A : rt_Texture;\nfloat f(float x) { return f(x); }\n", "E0216"),
        (
            "state",
            "class C : rt_Camera;\nvoid generateRay() { rt_RayOrigin.xy = rt_TextureUV; }\n",
            "E0305",
        ),
        ("method", "class C : rt_Camera;\nvoid shade() { }\n", "E0303"),
    ] {
        let file = format!("{name}.rtsl");
        folder.write(&file, text);
        folder.run(&["check", &file]).fails_with(code);
    }
}

#[test]
fn eval_prints_what_a_method_sets() {
    let folder = Folder::new("eval");
    folder.write("ball.rtsl", SPHERE);
    let ray = ["--state", "rt_RayOrigin=0,0,-5", "--state", "rt_RayDirection=0,0,1"];
    let arguments = [&["eval", "ball.rtsl", "intersect", "--param", "radius=2"][..], &ray].concat();
    folder.run(&arguments).exits(DONE).prints(expect![[r#"
        hit = true
        rt_HitDistance = 3.0
        where = [0.0,0.0,-2.0]
    "#]]);
    let interpreted = [&arguments[..], &["--backend", "interp", "--json"]].concat();
    folder.run(&interpreted).exits(DONE).prints(expect![[r#"
        {"id":null,"ok":true,"diagnostics":[],"state":{"rt_HitDistance":{"lanes":[3.0]}},"scratch":{"where":{"lanes":[[0.0,0.0,-2.0]]}},"hit":{"lanes":[true]}}
    "#]]);
    folder.run(&["eval", "ball.rtsl"]).exits(DONE);
    folder.run(&["eval", "ball.rtsl", "lookup"]).fails_with("E0508");
    folder.run(&["eval", "ball.rtsl", "intersekt"]).exits(WRONG_USAGE);
    folder.run(&["eval", "ball.rtsl", "intersect", "--param", "r=1"]).fails_with("E0502");
    folder.run(&["eval", "ball.rtsl", "intersect", "--param", "radius=true"]).fails_with("E0503");
    folder.run(&["eval", "ball.rtsl", "intersect", "--class", "Bal"]).fails_with("E0507");
    folder.run(&["eval", "ball.rtsl", "intersect", "--width", "3"]).exits(WRONG_USAGE);
    folder.run(&["eval"]).exits(WRONG_USAGE);
}

#[test]
fn missing_parameters_and_endless_loops_are_errors() {
    let folder = Folder::new("eval-errors");
    folder.write(
        "needs.rtsl",
        "class A : rt_Texture;\nconstructor(float scale) { }\nvoid lookup() { }",
    );
    folder.run(&["eval", "needs.rtsl", "lookup"]).fails_with("E0501");
    folder.write(
        "endless.rtsl",
        "class A : rt_Texture;\nvoid lookup() { float x = 0.0; while (x >= 0.0) x += 1.0; \
         rt_FloatTextureValue = x; }",
    );
    for backend in ["jit", "interp"] {
        folder
            .run(&["eval", "endless.rtsl", "lookup", "--budget", "1000", "--backend", backend])
            .fails_with("E0619");
    }
}

const ENDLESS: &str = "class A : rt_Texture;
void lookup() { float x = 0.0; while (x >= 0.0) x += 0.5; rt_FloatTextureValue = x; }
";

/// Without a word about budgets, whatever has the loop: a method, the constructor, an initial value.
#[test]
fn endless_loops_end_without_a_budget() {
    let folder = Folder::new("endless");
    folder.write("method.rtsl", ENDLESS);
    let constructor = "class A : rt_Texture; private float x;
        constructor() { while (x >= 0.0) x += 0.5; }
        void lookup() { rt_FloatTextureValue = x; }";
    folder.write("constructor.rtsl", constructor);
    let initial = "float endless() { float x = 0.0; while (x >= 0.0) x += 0.5; return x; }
        class A : rt_Texture; public float x = endless();
        void lookup() { rt_FloatTextureValue = x; }";
    folder.write("initial.rtsl", initial);
    folder.run(&["eval", "method.rtsl", "lookup"]).fails_with("E0619");
    folder.run(&["eval", "constructor.rtsl", "lookup"]).fails_with("E0619");
    folder.run(&["test", "constructor.rtsl"]).fails_with("E0619");
    folder.run(&["build", "initial.rtsl", "--emit", "layout"]).fails_with("E0619");
    let request = serde_json::json!({ "source": ENDLESS, "method": "lookup" }).to_string();
    let answer = folder.run_with(&["eval", "--stdin"], &request).exits(DONE).output();
    assert!(answer.contains("E0619"), "{answer}");
}

/// A library's hosts bound its constructors, if anybody does: its code is that of the text.
#[test]
fn libraries_have_no_budget_of_the_command() {
    let folder = Folder::new("library-budget");
    let text = "class A : rt_Texture; public int n = 3; private float x;
        constructor() { for (int i = 0; i < n; i++) x += 0.5; }
        void lookup() { rt_FloatTextureValue = x; }";
    folder.write("a.rtsl", text);
    let library = folder.run(&["build", "a.rtsl", "--emit", "cpp"]).exits(DONE).output();
    assert!(library.contains("for (") || library.contains("while ("), "{library}");
    assert!(!library.contains("16777216"), "{library}");
}

/// The greatest budget takes minutes; the signal of Ctrl-C ends it at once.
#[cfg(unix)]
#[test]
fn an_interrupt_ends_an_evaluation_at_once() {
    let folder = Folder::new("interrupt");
    folder.write("endless.rtsl", ENDLESS);
    let started = std::time::Instant::now();
    let mut child = rtsl()
        .args(["eval", "endless.rtsl", "lookup", "--backend", "interp", "--budget", "1073741824"])
        .current_dir(&folder.0)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(500));
    assert!(child.try_wait().unwrap().is_none(), "it runs until it is interrupted");
    let interrupt = format!("kill -INT {}", child.id());
    assert!(Command::new("sh").args(["-c", &interrupt]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), None, "the signal ended it, and not: {errors}");
    assert!(started.elapsed().as_secs() < 20, "at once");
}

#[test]
fn requests_are_answered_in_order() {
    let folder = Folder::new("stdin");
    folder.write("ball.rtsl", SPHERE);
    let requests = [
        r#"{"id": 1, "source": "class A : rt_Texture; void lookup() { }"}"#,
        r#"{"id": 2, "source": "class A : rt_Texture; float x = ;"}"#,
        "nonsense",
        "[1]",
        r#"{"id": "x", "source": "", "unknown": 1}"#,
        r#"{"id": 5, "file": "ball.rtsl", "method": "intersect", "state": {"rt_RayOrigin": {"lanes": [[0,0,-5],[9,9,9]]}, "rt_RayDirection": [0,0,1]}}"#,
        r#"{"id": 6, "source": "class A : rt_Material; void shade() { rt_SampleColor = trace(vec3(0), vec3(1)) + ambient(); illuminance { rt_SampleColor += rt_LightColor; } }", "method": "shade", "host": {"trace": [1,0,0], "ambient": [0,1,0], "lights": [{"direction": [0,1,0], "color": [0,0,1]}, {"direction": [0,1,0], "distance": 3, "color": [0,0,0.25]}]}}"#,
        r#"{"id": 7, "source": "class A : rt_Texture; scratch int n; scratch mat2 m; struct S { bool b; uint u[2]; }; scratch S s; void lookup() { n += 1; m[1][0] = 2.0; s.u[1] += 1u; s.b = !s.b; rt_FloatTextureValue = uintBitsToFloat(0x7FC00000u); }", "method": "lookup", "scratch": {"n": {"lanes": [1, 2]}, "s": {"b": true, "u": [1, 4294967294]}}}"#,
        r#"{"id": 8, "source": "class A : rt_Texture; public vec3 p[]; void lookup() { rt_FloatTextureValue = p[1].y + float(p.length()); }", "method": "lookup", "buffers": {"p": [[1,2,3],[4,0.5,6]]}, "backend": "interp", "math": "strict"}"#,
        r#"{"id": 9, "source": "class A : rt_Texture; public rt_Texture t; void lookup() { rt_TextureColor = t.lookup(); } class B : rt_Texture; public float v; void lookup() { rt_FloatTextureValue = v; }", "class": "A", "method": "lookup", "params": {"t": {"class": "B", "params": {"v": 0.1}}}}"#,
        r#"{"id": 10, "source": "class A : rt_Texture { }; class B : A { void lookup() { } };", "class": "A", "method": "lookup", "lanes": 99999999}"#,
    ];
    let ran = folder.run_with(&["eval", "--stdin"], &requests.join("\n")).exits(DONE);
    assert_eq!(ran.errors(), "");
    ran.prints(expect![[r#"
        {"id":1,"ok":true,"diagnostics":[],"classes":["A"]}
        {"id":2,"ok":false,"diagnostics":[{"code":"E0101","severity":"error","message":"expected an expression, found `;`","file":"request.rtsl","line":1,"column":33,"endLine":1,"endColumn":34,"notes":[],"help":[]}]}
        {"id":null,"ok":false,"error":"not JSON: expected ident at line 1 column 2","diagnostics":[]}
        {"id":null,"ok":false,"error":"not a request: invalid length 1, expected struct Request with 18 elements","diagnostics":[]}
        {"id":"x","ok":false,"error":"not a request: unknown field `unknown`, expected one of `id`, `source`, `file`, `class`, `method`, `params`, `args`, `state`, `scratch`, `buffers`, `lanes`, `backend`, `width`, `math`, `budget`, `scene`, `host`, `trace`","diagnostics":[]}
        {"id":5,"ok":true,"diagnostics":[],"state":{"rt_HitDistance":{"lanes":[4.0,"Infinity"]}},"scratch":{"where":{"lanes":[[0.0,0.0,-1.0],[0.0,0.0,0.0]]}},"hit":{"lanes":[true,false]}}
        {"id":6,"ok":true,"diagnostics":[],"state":{"rt_SampleColor":{"lanes":[[1.0,1.0,1.25]]}},"scratch":{}}
        {"id":7,"ok":true,"diagnostics":[],"state":{"rt_FloatTextureValue":{"lanes":["NaN","NaN"]},"rt_TextureColor":{"lanes":[["NaN","NaN","NaN"],["NaN","NaN","NaN"]]}},"scratch":{"m":{"lanes":[[[0.0,0.0],[2.0,0.0]],[[0.0,0.0],[2.0,0.0]]]},"n":{"lanes":[2,3]},"s":{"lanes":[{"b":false,"u":[1,4294967295]},{"b":false,"u":[1,4294967295]}]}}}
        {"id":8,"ok":true,"diagnostics":[],"state":{"rt_FloatTextureValue":{"lanes":[2.5]},"rt_TextureColor":{"lanes":[[2.5,2.5,2.5]]}},"scratch":{}}
        {"id":9,"ok":true,"diagnostics":[],"state":{"rt_FloatTextureValue":{"lanes":[0.1]},"rt_TextureColor":{"lanes":[[0.1,0.1,0.1]]}},"scratch":{}}
        {"id":10,"ok":false,"diagnostics":[{"code":"E0508","severity":"error","message":"`A` has no method `lookup`","file":null,"line":null,"column":null,"endLine":null,"endColumn":null,"notes":["`A` has no methods"],"help":[]}]}
    "#]]);
}

#[test]
fn every_form_can_be_built() {
    let folder = Folder::new("build");
    folder.write("ball.rtsl", SPHERE);
    for (form, expected) in [
        ("ast", "class Ball : rt_Primitive"),
        ("ir", "function Ball.intersect"),
        ("packet", "packet W=4"),
        ("llvm", "define void"),
        ("asm", ".text"),
    ] {
        let arguments = ["build", "ball.rtsl", "--emit", form, "--width", "4"];
        let ran = folder.run(&arguments).exits(DONE);
        assert!(ran.output().contains(expected), "{form}: {}", ran.output());
    }
    let target =
        ["build", "ball.rtsl", "--emit", "asm", "--method", "intersect", "--shape", "stream"];
    folder
        .run(&[&target[..], &["--target", "x86-64-v4", "-O3", "--math", "fast"]].concat())
        .exits(DONE);
    folder.run(&[&target[..], &["--target", "pdp-11"]].concat()).exits(WRONG_USAGE);
    folder.run(&["build", "ball.rtsl", "--emit", "wasm"]).exits(WRONG_USAGE);
    let ir = ["build", "ball.rtsl", "--emit", "ir", "--method", "intersect"];
    let known = folder.run(&[&ir[..], &["--specialise", "--param", "radius=3"]].concat());
    assert!(!known.exits(DONE).output().contains("load member"));
    let unread = folder.run(&[&ir[..], &["--reads", "rt_HitPoint"]].concat()).exits(DONE);
    assert!(!unread.output().contains("state:rt_HitDistance@0 ="));
    folder.run(&[&ir[..], &["--reads", "rt_Hit"]].concat()).exits(WRONG_USAGE);
    folder.run(&[&ir[..], &["--param", "radius=3"]].concat()).exits(WRONG_USAGE);
    folder.run(&["build", "ball.rtsl", "--emit", "ir", "--method", "shade"]).fails_with("E0508");
    folder
        .run(&["build", "ball.rtsl", "--emit", "ir", "-o", "no/such/folder"])
        .exits(INPUT_AT_FAULT);
}

#[test]
fn the_times_of_stages_are_shown_on_request() {
    let folder = Folder::new("timings");
    folder.write("sphere.rtsl", SPHERE);
    let build = ["build", "sphere.rtsl", "--emit", "ir"];
    let timed = |rest: &[&str]| folder.run(&[&build[..], &["--timings"], rest].concat());
    let table = timed(&[]).exits(DONE).output();
    for stage in
        ["stage ", "prelude ", "parse ", "lower ", "link ", "optimize ", "  dce ", "total "]
    {
        assert!(table.contains(stage), "{stage}: {table}");
    }
    let json = timed(&["--json", "-o", "sphere.ir"]).exits(DONE).output();
    let json: serde_json::Value = serde_json::from_str(&json).expect("it is one object");
    let stages = json["stages"].as_array().expect("it is a list");
    assert!(stages.iter().all(|stage| stage["calls"].as_u64() > Some(0)), "{json}");
    assert!(stages.iter().any(|stage| stage["name"] == "optimize"), "{json}");
    // The form is the same, and without an output file it is not printed.
    let form = folder.run(&build).exits(DONE).output();
    assert_eq!(std::fs::read_to_string(folder.0.path().join("sphere.ir")).unwrap(), form);
    assert!(!table.contains(&form));
    folder.run(&[&build[..], &["--json"]].concat()).exits(WRONG_USAGE);
}

#[test]
fn stages_are_lines_on_standard_error() {
    let folder = Folder::new("verbose");
    folder.write("sphere.rtsl", SPHERE);
    let check = |flags: &[&str]| folder.run(&[&["check", "sphere.rtsl"], flags].concat());
    assert_eq!(check(&[]).exits(DONE).errors(), "");
    let lines = check(&["-v"]).exits(DONE).errors();
    assert!(
        lines.contains("parse file=sphere.rtsl: ") && lines.contains("lower class="),
        "{lines}"
    );
    let build = folder.run(&["-vv", "build", "sphere.rtsl", "--emit", "ir"]).exits(DONE);
    assert!(build.errors().contains("  dce: "), "{}", build.errors());
}

#[test]
fn rays_that_a_method_waits_for_are_told_with_the_reason() {
    let folder = Folder::new("deferral");
    folder.write(
        "cel.rtsl",
        "class Cel : rt_Material;
void shade() {
    color mirrored = 0.5 * trace(rt_HitPoint, rt_ShadingNormal);
    color seen = trace(rt_HitPoint, rt_RayDirection);
    float bright = luminance(seen);
    color sum = bright > 0.5 ? color(1.0) : mirrored;
    illuminance { sum += rt_LightColor; }
    illuminance { sum += rand() * rt_LightColor; }
    rt_SampleColor = sum;
}
",
    );
    assert_eq!(folder.run(&["check", "cel.rtsl"]).exits(DONE).errors(), "");
    let lines = folder.run(&["check", "cel.rtsl", "-v"]).exits(DONE).errors();
    let notes: Vec<&str> = lines.lines().filter(|line| line.starts_with("note: ")).collect();
    expect![[r#"
        note: `Cel.shade` goes on without waiting for 1 ray and 1 loop over lights
        note: cel.rtsl:4: `Cel.shade` waits for this ray: its light decides what the method does (cel.rtsl:6)
        note: cel.rtsl:8: `Cel.shade` waits for the shadow rays of this loop: the body of `illuminance` traces rays, draws random numbers or calls other objects"#]].assert_eq(&notes.join("\n"));
}

#[test]
fn libraries_have_several_classes_call_modes_and_widths() {
    let folder = Folder::new("library");
    folder.write("ball.rtsl", SPHERE);
    let library = ["build", "ball.rtsl", "Ward", "--bind", "Ward.kd=Constant"];
    let build = |rest: &[&str]| folder.run(&[&library[..], rest].concat());
    build(&["--emit", "obj", "-o", "ball.o"]).exits(DONE);
    let object = std::fs::read(folder.0.path().join("ball.o")).unwrap();
    assert_eq!(&object[..4], b"\x7fELF");
    assert_eq!(entries(folder.0.path()), ["ball.o", "ball.rtsl"]);
    let modes = ["--call-mode", "single,packet", "--width", "4,16", "--prefix", "my"];
    let header = build(&[&["--emit", "header"], &modes[..]].concat()).exits(DONE).output();
    for declared in [
        "extern const RtslLibrary my_library;",
        "    float radius; /* float */\n",
        "    float kd_value[3]; /* color: The colour. */\n",
        "void my_Ball_intersect_single(RtslCall *call);",
        "void my_Ward_BSDF_packet16(RtslCall *call);",
    ] {
        assert!(header.contains(declared), "{declared}: {header}");
    }
    let layout = build(&["--emit", "layout", "--class", "Ward", "--method", "BSDF"]);
    let layout: serde_json::Value = serde_json::from_str(&layout.exits(DONE).output()).unwrap();
    let class = &layout["classes"][0];
    assert_eq!(class["kernels"].as_array().map(Vec::len), Some(1));
    assert_eq!(class["parameters"][0]["name"], "kd.value");
    let parameters = class["parameters"].as_array().unwrap();
    let kd = parameters.iter().find(|it| it["name"] == "kd").unwrap();
    assert_eq!(kd["type"], "texture color", "{kd}");
    let text = build(&["--emit", "cpp", "--class", "Ball"]).exits(DONE).output();
    assert!(text.contains("struct Ball {") && text.contains("bool intersect("), "{text}");
    build(&["--emit", "obj", "--bind", "Ward.kz=Constant"]).fails_with("E0502");
    build(&["--emit", "obj", "--bind", "Ward.kd=Sphere"]).fails_with("E0506");
    build(&["--emit", "obj", "--bind", "Ward.kd=Constnat"]).fails_with("E0507");
    build(&["--emit", "obj", "--bind", "kd"]).exits(WRONG_USAGE);
    build(&["--emit", "obj", "--prefix", "1"]).fails_with("E0607");
    build(&["--emit", "obj", "--method", "generateRay"]).fails_with("E0508");
    build(&["--emit", "ir"]).exits(WRONG_USAGE);
    folder.run(&["build", "Ward", "Ward", "--emit", "obj"]).fails_with("E0611");
    folder.run(&["build", "Ward", "--emit", "ir", "--prefix", "x"]).exits(WRONG_USAGE);
    folder.run(&["build", "Ward", "--emit", "obj", "--specialise"]).exits(WRONG_USAGE);
}

fn entries(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn render_writes_a_picture() {
    let folder = Folder::new("render");
    folder.write("ball.rtsl", SPHERE);
    let scene = "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"Pinhole\"\nWorldBegin\n\
                 LightSource \"SkyLight\"\nMaterial \"Lambertian\"\nShape \"Sphere\"\n";
    folder.write("scene.pbrt", scene);
    let small = ["--size", "8x6", "--spp", "1"];
    for output in ["picture.png", "picture.exr"] {
        let arguments = [&["render", "scene.pbrt", "-o", output][..], &small].concat();
        let ran = folder.run(&[&arguments[..], &["--stats", "stats.json"]].concat()).exits(DONE);
        assert_eq!(ran.output(), "");
    }
    assert_eq!(&std::fs::read(folder.0.path().join("picture.png")).unwrap()[1..4], b"PNG");
    let stats = std::fs::read_to_string(folder.0.path().join("stats.json")).unwrap();
    assert!(stats.contains("cold_start_seconds"), "{stats}");
    let with_aovs = [&["render", "scene.pbrt", "-o", "x.png", "--aov", "normal,time"], &small[..]];
    folder.run(&with_aovs.concat()).exits(DONE);
    assert!(
        ["x.png", "x.normal.png", "x.time.png"].iter().all(|it| folder.0.path().join(it).exists())
    );
    folder.run(&["render", "scene.pbrt", "-o", "x.png", "--aov", "colour"]).fails_with("E0624");
    folder.run(&["render", "scene.pbrt", "-o", "x.jpeg"]).exits(WRONG_USAGE);
    folder.run(&["render", "scene.pbrt", "-o", "no/such/folder/x.png"]).exits(WRONG_USAGE);
    folder.run(&["render", "scene.pbrt"]).exits(WRONG_USAGE);
    folder.run(&["render", "scene.pbrt", "-o", "x.png", "--size", "0x9"]).exits(WRONG_USAGE);
}

/// The folder of a file that is named without one is the current folder.
#[test]
fn scenes_named_without_a_folder_find_what_their_shaders_include() {
    let folder = Folder::new("include");
    folder.write("half.rtsl", "const float HALF = 0.5;\n");
    let material = "#include \"half.rtsl\"\nclass Half : rt_Material;\n\
                    void BSDF() { rt_BSDFValue = color(HALF / 3.14159); }\n";
    folder.write("material.rtsl", material);
    let scene = "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"Pinhole\"\nWorldBegin\n\
                 LightSource \"SkyLight\"\nMaterial \"Half\"\nShape \"Sphere\"\n";
    folder.write("scene.pbrt", scene);
    for scene in ["scene.pbrt", "./scene.pbrt"] {
        let render = ["render", scene, "-o", "x.png", "--size", "4x4", "--spp", "1"];
        folder.run(&render).exits(DONE);
        let small = ["--size", "4x4", "--repetitions", "1", "--threads", "1", "--width", "4"];
        folder.run(&[&["bench", scene], &small[..]].concat()).exits(DONE);
    }
    folder.run(&["check", "material.rtsl"]).exits(DONE);
}

#[test]
fn pictures_are_kept_as_asked() {
    let folder = Folder::new("kept");
    let scene = "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"Pinhole\"\n\
                 Integrator \"interactive\"\nWorldBegin\n\
                 LightSource \"SkyLight\"\nMaterial \"Lambertian\"\nShape \"Sphere\"\n";
    folder.write("scene.pbrt", scene);
    let render = |output: &str, options: &[&str]| {
        let start = ["render", "scene.pbrt", "-o", output, "--size", "64x64", "--spp", "1"];
        folder.run(&[&start[..], options].concat())
    };
    let bytes = |output: &str, options: &[&str]| {
        render(output, options).exits(DONE);
        std::fs::read(folder.0.path().join(output)).unwrap()
    };
    let standard = bytes("a.png", &[]);
    assert_eq!(standard, bytes("b.png", &["--view", "standard"]));
    assert_ne!(standard, bytes("c.png", &["--view", "filmic"]));
    assert_ne!(standard, bytes("d.png", &["--view", "raw"]));
    let float = bytes("a.exr", &["--exr", "float"]);
    assert!(bytes("b.exr", &["--exr", "half"]).len() < float.len());
    let parts = bytes("c.exr", &["--exr-parts", "--aov", "depth"]);
    assert!(parts.windows(8).any(|name| name == b"distance"), "a part has this name");
    render("e.png", &["--view", "pale"]).exits(WRONG_USAGE);
    // A folder that has the picture's name.
    std::fs::create_dir(folder.0.path().join("f.png")).unwrap();
    let ran = render("f.png", &[]).exits(WRONG_USAGE);
    assert!(ran.errors().contains("cannot write `f.png`: it is a folder"), "{}", ran.errors());
    render("g.png", &["--denoise"]).fails_with("E0704");
    render("h.exr", &["--aov", "variance"]).exits(DONE);
    // The integrator of this scene calls `shade`, which says nothing about albedo.
    let ran = render("i.exr", &["--aov", "normal,albedo"]).exits(INPUT_AT_FAULT);
    assert!(ran.errors().contains("error[E0624]: `Whitted` has no output `albedo`"));
    let outputs = bytes("j.exr", &["--integrator", "Depth", "--aov", "depth,distance"]);
    for channel in [&b"\0depth\0"[..], b"\0Z\0"] {
        assert!(outputs.windows(channel.len()).any(|name| name == channel), "{channel:?}");
    }
    render("k.png", &["--integrator", "Depth", "--aov", "depth"]).exits(DONE);
    assert!(folder.0.path().join("k.depth.png").is_file());
    assert!(!folder.0.path().join("g.png").exists());
}

#[test]
fn bad_scenes_are_errors() {
    let folder = Folder::new("scenes");
    folder.write(
        "shaders.rtsl",
        "class Endless : rt_Material;\n\
         void shade() { float x = 0.0; while (x >= 0.0) x += 0.0 * rt_HitPoint.x; \
         rt_SampleColor = color(x); }\n\
         class Through : rt_Texture;\npublic rt_Texture inner;\n\
         void lookup() { rt_TextureColor = inner.lookup(); }\n",
    );
    let start = "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"Pinhole\"\nWorldBegin\n";
    for (name, rest, code) in [
        ("class", "Shape \"Spere\"\n", "E0609"),
        ("parameter", "Shape \"Sphere\" \"float raduis\" 1\n", "E0608"),
        ("endless", "Material \"Endless\"\nShape \"Sphere\"\n", "E0619"),
        (
            "cycle",
            "Texture \"a\" \"spectrum\" \"Through\" \"texture inner\" \"b\"\n\
             Texture \"b\" \"spectrum\" \"Through\" \"texture inner\" \"a\"\n\
             Material \"Lambertian\" \"texture kd\" \"a\"\nShape \"Sphere\"\n",
            "E0505",
        ),
    ] {
        let scene = format!("{name}.pbrt");
        folder.write(&scene, format!("{start}{rest}"));
        let arguments = ["render", &scene, "-o", "x.png", "--size", "4x4", "--spp", "1"];
        let ran = folder.run(&arguments).exits(INPUT_AT_FAULT);
        assert!(ran.errors().contains(&format!("error[{code}]")), "{name}: {}", ran.errors());
    }
}

#[test]
fn explain_info_and_help_answer() {
    let folder = Folder::new("help");
    let page = folder.run(&["explain", "e0104"]).exits(DONE).output();
    assert!(page.starts_with("# E0104: "), "{page}");
    assert!(folder.run(&["explain"]).exits(DONE).output().contains("E0104  "));
    folder.run(&["explain", "E9999"]).exits(WRONG_USAGE);
    let info = folder.run(&["info"]).exits(DONE).output();
    assert!(info.starts_with("rtsl ") && info.contains("\nwidth "), "{info}");
    assert!(info.contains("\ndenoiser      none: `no-such-library` "), "{info}");
    let sphere = folder.run(&["info", "Sphere"]).exits(DONE).output();
    assert!(sphere.contains("vec3 center = [0.0 0.0 0.0];"), "{sphere}");
    assert!(sphere.contains("float radius = 1.0;"), "{sphere}");
    let defaults = "class A : rt_Texture; struct S { int i; }; public S s; public rt_Texture t; public float data[];
        public texture color kd = color(0.25, 0.5, 1.0); public texture float rough;
        enum Mode { Fast, Exact = 4 }; public Mode mode = Exact;
        public int many[17]; constructor(bool on = true, mat2 m = mat2(2.0), color c, int n[2] = int[](-1, 7)) { }";
    std::fs::write(folder.0.path().join("defaults.rtsl"), defaults).unwrap();
    expect![[r#"
        A: texture
        methods: 
        parameters:
          bool on = true
          mat2 m = [2.0 0.0 0.0 2.0]
          color c, required
          int[2] n = [-1 7]
          S s
          rt_Texture t
          float[] data
          texture color kd = [0.25 0.5 1.0]
          texture float rough = 0.0
          int mode = "Exact"; choices "Fast = 0, Exact = 4"
          int[17] many

    "#]]
    .assert_eq(&folder.run(&["info", "defaults.rtsl"]).exits(DONE).output());
    let choices = "enum Mode { Fast, Exact = 4 }; class A : rt_Texture; public Mode mode = Exact;
        void lookup() { rt_FloatTextureValue = float(mode); }";
    folder.write("choices.rtsl", choices);
    let layout = folder.run(&["build", "choices.rtsl", "--emit", "layout"]).exits(DONE).output();
    let layout: serde_json::Value = serde_json::from_str(&layout).unwrap();
    let parameter = &layout["classes"][0]["parameters"][0];
    assert_eq!(parameter["choices"], serde_json::json!({ "Fast": 0, "Exact": 4 }), "{parameter}");
    folder.run(&["eval", "choices.rtsl", "lookup", "--param", "mode=Fast"]).exits(DONE);
    folder.run(&["eval", "choices.rtsl", "lookup", "--param", "mode=Fats"]).fails_with("E0504");
    // Every image that a renderer makes is named.
    let help = folder.run(&["help", "render"]).exits(DONE).output();
    assert!(Aov::ALL.iter().all(|aov| help.contains(aov.name())), "{help}");
    folder.run(&["info", "Spere"]).fails_with("E0507");
    assert!(folder.run(&["help"]).exits(DONE).output().contains("Topics of"));
    assert!(folder.run(&["help", "eval"]).exits(DONE).output().contains("--stdin"));
    assert!(folder.run(&["help", "language"]).exits(DONE).output().starts_with("# "));
    folder.run(&["help", "nothing"]).exits(WRONG_USAGE);
    folder.run(&["--help"]).exits(DONE);
    folder.run(&["--version"]).exits(DONE);
    folder.run(&[]).exits(WRONG_USAGE);
}

/// State that renderers compute from other state has its value for every command that calls a method.
#[test]
fn state_that_follows_from_other_state_is_derived() {
    let folder = Folder::new("derived");
    let text = "class Slab : rt_Primitive;
void intersect() {
    float near = (-1.0 - rt_RayOrigin.z) * rt_InverseRayDirection.z;
    if (near > 0.0) hit(near);
}
void computeNormal() { rt_GeometricNormal = rt_HitPoint; }
void computeTextureCoordinates() { rt_TextureUV = rt_ShadingNormal.xy; }
";
    folder.write("slab.rtsl", text);
    let eval = |method: &str, state: &[&str]| {
        let state = state.iter().flat_map(|it| ["--state", it]);
        let arguments: Vec<&str> = ["eval", "slab.rtsl", method].into_iter().chain(state).collect();
        folder.run(&arguments).exits(DONE).output()
    };
    let hit = "hit = true\nrt_HitDistance = 4.0\n";
    // The direction is the default.
    assert_eq!(eval("intersect", &["rt_RayOrigin=0,0,-5"]), hit);
    let given = ["rt_RayOrigin=0,0,-5", "rt_InverseRayDirection=0,0,0.5"];
    assert_eq!(eval("intersect", &given), hit.replace("4.0", "2.0"));
    let point = eval("computeNormal", &["rt_RayOrigin=1,0,-5", "rt_HitDistance=4"]);
    assert!(point.contains("rt_GeometricNormal = [1.0,0.0,-1.0]"), "{point}");
    let coordinates = eval("computeTextureCoordinates", &["rt_GeometricNormal=0.5,0.25,1"]);
    assert!(coordinates.contains("rt_TextureUV = [0.5,0.25]"), "{coordinates}");
    let request = r#"{"file": "slab.rtsl", "method": "intersect", "state": {"rt_RayOrigin": [0, 0, -5],
        "rt_RayDirection": {"lanes": [[0, 0, 1], [0, 0, 2]]}}}"#;
    let answer = folder.run_with(&["eval", "--stdin"], &request.replace('\n', " "));
    let answer = answer.exits(DONE).output();
    assert!(answer.contains(r#""hit":{"lanes":[true,true]}"#), "{answer}");
    assert!(answer.contains(r#""rt_HitDistance":{"lanes":[4.0,2.0]}"#), "{answer}");
    let debug = ["debug", "slab.rtsl", "intersect", "--state", "rt_RayOrigin=0,0,-5"];
    let shown = folder.run(&debug).exits(DONE).output();
    assert!(shown.starts_with(hit), "{shown}");
}

#[test]
fn a_black_picture_says_why() {
    let folder = Folder::new("black");
    folder.write("empty.rtsl", "class Empty : rt_Material;\n");
    let scene = |lines: &str| {
        format!(
            "LookAt 0 0 -5  0 0 0  0 1 0\nFilm \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\n\
             Sampler \"stratified\" \"integer pixelsamples\" 1\nCamera \"Pinhole\"\nWorldBegin\n{lines}\n"
        )
    };
    let warning = |lines: &str| {
        folder.write("scene.pbrt", scene(lines));
        let ran = folder.run(&["render", "scene.pbrt", "-o", "out.png"]).exits(DONE);
        let errors = ran.errors();
        errors.split_once("warning[W0510]").map(|(_, it)| it.to_owned())
    };
    let dark = warning("Material \"Empty\"\nShape \"Sphere\"").expect("it is black");
    assert!(dark.contains("no light source"), "{dark}");
    assert!(dark.contains("the material `Empty` has no `BSDF`, `emission` or `shade`"), "{dark}");
    let sky = "LightSource \"SkyLight\"";
    assert_eq!(warning(&format!("{sky}\nMaterial \"Empty\"\nShape \"Sphere\"")), None);
    assert_eq!(warning(&format!("{sky}\nShape \"Sphere\"")), None);
}

/// An integrator that is a class may ask for light, or for none.
#[test]
fn black_pictures_of_integrators_name_what_these_ask_for() {
    let folder = Folder::new("black-integrators");
    let text = "class Near : rt_Integrator;
        void radiance() { if (nearestHit().distance < 1.0) rt_SampleColor = color(1.0); }";
    folder.write("near.rtsl", text);
    let warning = |integrator: &str, world: &str| {
        let scene = format!(
            "Integrator \"{integrator}\"\nCamera \"Pinhole\"\nWorldBegin\n{world}\nTranslate 0 0 5\nShape \"Sphere\"\n"
        );
        folder.write("scene.pbrt", scene);
        let options = ["--size", "8x8", "--spp", "1", "-o", "out.png"];
        let ran = folder.run(&[&["render", "scene.pbrt"], &options[..]].concat()).exits(DONE);
        ran.errors().split_once("warning[W0510]").map(|(_, it)| it.to_owned())
    };
    let dark = warning("Path", "").expect("it is black");
    assert!(dark.contains("no light source"), "{dark}");
    assert_eq!(warning("Near", ""), None);
    assert_eq!(warning("Path", "LightSource \"SkyLight\""), None);
}
