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
fn libraries_refuse_integrators() {
    let folder = folder("build-integrator");
    folder.run(&["build", "deep.rtsl", "--emit", "ir"]).exits(DONE);
    let stages = folder.run(&["build", "deep.rtsl", "--emit", "stages"]).exits(DONE);
    assert!(
        stages.output().contains("stage 1: nearest_hit, surface answer"),
        "{}",
        stages.output()
    );
    for form in ["obj", "cpp", "header"] {
        let ran = folder.run(&["build", "deep.rtsl", "--emit", form, "-o", "out"]);
        ran.fails_with("E0707");
    }
}
