//! Integrators written in RTSL, from the command line.

use expect_test::expect;

use crate::command::{DONE, Folder, INPUT_AT_FAULT, WRONG_USAGE};

/// Shows the distance of the first surface, and adds light of its own.
const DEEP: &str = "class Deep : rt_Integrator;
public float gain = 1.0;
output float depth;
void radiance() {
    rt_Surface surface = nearestHit();
    depth = surface.distance;
    rt_SampleColor = gain * surface.emission();
    contribute(vec3(0.0, 3.0, 0.0), vec3(0.0, 1.0, 0.0), 1.0, color(0.25));
}
";

const SCENE: &str = "LookAt 0 0 -5 0 0 0 0 1 0\nCamera \"Pinhole\"
Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8
Sampler \"independent\" \"integer pixelsamples\" 1
WorldBegin\nMaterial \"Emissive\" \"rgb radiance\" [1 2 3]\nShape \"Sphere\"\n";

fn folder(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("deep.rtsl", DEEP);
    folder.write("scene.pbrt", SCENE);
    folder
}

#[test]
fn eval_asks_a_scene() {
    let folder = folder("eval-scene");
    let ray = ["--state", "rt_RayOrigin=0,0,-5", "--state", "rt_RayDirection=0,0,2"];
    let arguments = [&["eval", "deep.rtsl", "radiance"][..], &ray].concat();
    let in_scene = [&arguments[..], &["--scene", "scene.pbrt", "--param", "gain=2"]].concat();
    folder.run(&in_scene).exits(DONE).prints(expect![[r#"
        rt_SampleColor = [2.25,4.25,6.25]
        depth = 2.0
    "#]]);
    // Without a scene nothing is there, and contributions are not added.
    folder.run(&arguments).exits(DONE).prints(expect![[r#"
        rt_SampleColor = [0.0,0.0,0.0]
        depth = 0.0
    "#]]);
    let missing = [&arguments[..], &["--scene", "missing.pbrt"]].concat();
    assert!(folder.run(&missing).exits(WRONG_USAGE).errors().contains("missing.pbrt"));
    folder.write("ball.rtsl", crate::command::SPHERE);
    let other = ["eval", "ball.rtsl", "intersect", "--scene", "scene.pbrt"];
    assert!(folder.run(&other).exits(WRONG_USAGE).errors().contains("only `radiance`"));
}

#[test]
fn render_takes_another_integrator() {
    let folder = folder("render-integrator");
    let render = ["render", "scene.pbrt", "-o", "a.png", "--integrator"];
    folder.run(&[&render[..], &["Deep", "-D", "integrator.gain=0.5"]].concat()).exits(DONE);
    folder.run(&[&render[..], &["Normals"]].concat()).exits(DONE);
    folder.run(&[&render[..], &["path"]].concat()).exits(DONE);
    let unknown = folder.run(&[&render[..], &["Normal"]].concat()).exits(INPUT_AT_FAULT);
    assert!(unknown.errors().contains("did you mean `Normals`?"), "{}", unknown.errors());
    let both = [&render[..], &["Path", "--renderer", "batch"]].concat();
    folder.run(&both).exits(WRONG_USAGE);
}

#[test]
fn optimised_kernels_render_the_same_picture() {
    let folder = folder("render-optimise");
    let picture = |when: &str| {
        let output = format!("{when}.exr");
        let render = ["render", "scene.pbrt", "-o", &output, "--integrator", "Path"];
        folder.run(&[&render[..], &["--optimise", when]].concat()).exits(DONE);
        std::fs::read(folder.0.path().join(output)).unwrap()
    };
    let never = picture("never");
    assert!(picture("first") == never && picture("background") == never);
    folder.run(&["render", "scene.pbrt", "-o", "a.exr", "--optimise", "late"]).exits(WRONG_USAGE);
}

#[test]
fn libraries_refuse_integrators() {
    let folder = folder("build-integrator");
    let searches = "class Wax : rt_Material;
        void shade() { rt_SampleColor = color(nearestHit(rt_HitPoint, vec3(1.0)).distance); }";
    folder.write("wax.rtsl", searches);
    folder.run(&["build", "deep.rtsl", "--emit", "ir"]).exits(DONE);
    let stages = folder.run(&["build", "deep.rtsl", "--emit", "stages"]).exits(DONE);
    assert!(
        stages.output().contains("stage 1: nearest_hit, surface answer"),
        "{}",
        stages.output()
    );
    for form in ["obj", "cpp", "header"] {
        for file in ["deep.rtsl", "wax.rtsl"] {
            folder.run(&["build", file, "--emit", form, "-o", "out"]).fails_with("E0707");
        }
    }
}

#[test]
fn bench_measures_integrators_in_a_scene() {
    let folder = folder("bench-integrator");
    let bench = ["bench", "deep.rtsl", "radiance", "--scene", "scene.pbrt", "--time", "1"];
    let json = folder.run(&[&bench[..], &["--json", "--param", "gain=2"]].concat()).exits(DONE);
    let rows: Vec<serde_json::Value> =
        json.output().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let widths: Vec<_> = rows.iter().map(|row| row["width"].as_u64().unwrap()).collect();
    assert_eq!(widths, [1, 4, 8, 16]);
    for row in &rows {
        assert_eq!((&row["class"], &row["size"]), (&"Deep".into(), &serde_json::json!([8, 8])));
        // 16 samples of each pixel, each with one shadow ray.
        let rays = &row["rays"];
        assert_eq!((&row["paths"], &rays["camera"]), (&1024.into(), &1024.into()));
        assert_eq!((&rays["shadow"], &rays["traced"]), (&1024.into(), &0.into()));
        let speed = row["millionPathsPerSecond"]["median"].as_f64().unwrap();
        let of_rays = row["millionRaysPerSecond"].as_f64().unwrap();
        assert!(speed > 0.0 && (of_rays / speed - 2.0).abs() < 1e-9, "{row}");
    }
    let text = folder.run(&[&bench[..], &["--width", "4", "--size", "16x8"]].concat()).exits(DONE);
    let table = text.output();
    let (heading, row) = table.split_once("compile ms\n").unwrap();
    let first = "Deep.radiance in scene.pbrt: 16x8, 16 samples, ";
    assert!(heading.starts_with(first) && heading.contains("2.00 rays a path"), "{heading}");
    assert!(row.starts_with("    4 ") && row.lines().count() == 1, "{row}");
}

#[test]
fn bench_says_what_integrators_need() {
    let folder = folder("bench-integrator-wrong");
    let without = folder.run(&["bench", "deep.rtsl"]).exits(WRONG_USAGE);
    assert!(without.errors().contains("`--scene FILE.pbrt`"), "{}", without.errors());
    let bench = ["bench", "deep.rtsl", "radiance", "--scene", "scene.pbrt"];
    let state = [&bench[..], &["--state", "rt_RayOrigin=0,0,-5"]].concat();
    assert!(folder.run(&state).exits(WRONG_USAGE).errors().contains("`--state`"));
    folder.run(&["bench", "deep.rtsl", "--scene", "missing.pbrt"]).fails_with("E0601");
    folder.write("ball.rtsl", crate::command::SPHERE);
    let other = ["bench", "ball.rtsl", "intersect", "--scene", "scene.pbrt"];
    assert!(folder.run(&other).exits(WRONG_USAGE).errors().contains("only `radiance`"));
    let scene = ["bench", "scene.pbrt", "--scene", "scene.pbrt"];
    assert!(folder.run(&scene).exits(WRONG_USAGE).errors().contains("`--scene`"));
}

#[test]
fn test_renders_pictures_with_integrators() {
    let folder = folder("test-integrator");
    folder.run(&["test", "deep.rtsl"]).exits(DONE).prints(expect![[r#"
        Deep (integrator), defaults
          held    radiance is finite
          -       no more light is found than is emitted: the integrator does not scatter light
          held    results have the same bits at every width
          held    every call comes to its end
          held    pictures have the same bits at every width

    "#]]);
}
