//! Values that are not finite: both renderers count the samples that they affect, and report the methods that returned
//! them.

use std::path::{Path, PathBuf};

use expect_test::expect;
use rtsl_render::request::render_scene_from;
use rtsl_render::{Execution, LoadOptions, RenderRequest, RenderResult};
use rtsl_scene::reader::MemoryFiles;
use rtsl_scene::{BATCH, INTERACTIVE};

/// Classes with a mistake each, which shows on one half of the picture.
const SHADERS: &str = "class BrokenTexture : rt_Texture;
    void lookup() { rt_TextureColor = color(sqrt(-rt_HitPoint.x), 0.5, 0.5); }

    class BrokenLight : rt_Light;
    void illumination() {
        rt_LightDirection = vec3(0.0, 0.0, -1.0);
        rt_LightColor = color(log(-rt_HitPoint.x), 1.0, 1.0);
    }

    class BrokenDensity : rt_Light;
    void illumination() {
        rt_LightDirection = vec3(0.0, 0.0, -1.0);
        rt_LightColor = color(1.0);
        rt_PDF = sqrt(-rt_HitPoint.x);
    }

    class BrokenLamp : rt_Primitive, rt_Material;
    void intersect() { hit(-rt_RayOrigin.z / rt_RayDirection.z); }
    void computeNormal() { rt_GeometricNormal = vec3(0.0, 0.0, -1.0); }
    void emission() { rt_EmissionColor = color(1.0 / max(-rt_HitPoint.x, 0.0)); }

    class BrokenSky : rt_Light;
    void emission() { rt_EmissionColor = color(sqrt(-rt_RayDirection.x)); }

    class BrokenCamera : rt_Camera;
    void generateRay() {
        rt_RayOrigin = vec3(2.0 * rt_ScreenCoord - 1.0, 0.0);
        rt_RayDirection = vec3(0.0, 0.0, 1.0);
        rt_SampleColor = color(sqrt(0.5 - rt_ScreenCoord.x), 1.0, 1.0);
    }

    class BrokenBSDF : rt_Material;
    void BSDF() { rt_BSDFValue = color(sqrt(-rt_HitPoint.x)); }

    class BrokenShade : rt_Material;
    void shade() {
        rt_SampleColor = sqrt(-rt_HitPoint.x) * trace(rt_HitPoint, vec3(0.0, 0.0, -1.0));
    }";

const FRONT: &str = "LookAt 0 0 -5  0 0 0  0 1 0 Camera \"Orthographic\"";
const WALL: &str = "Shape \"Parallelogram\" \"point3 corner\" [-2 -2 0] \"vector3 sideU\" [4 0 0] \"vector3 sideV\" [0 4 0]\n";
const SUN: &str = "LightSource \"DirectionalLight\" \"vector3 direction\" [0 0 1]\n";

fn render(camera: &str, world: &str, renderer: &str) -> RenderResult {
    render_samples(camera, world, renderer, 4)
}

fn render_samples(camera: &str, world: &str, renderer: &str, samples: u32) -> RenderResult {
    let scene = format!(
        "{camera}
        PixelFilter \"box\"
        Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16
        Sampler \"independent\"
        WorldBegin
        {world}"
    );
    let files = [("scene.pbrt", &*scene), ("broken.rtsl", SHADERS)];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let request = RenderRequest {
        scene: Path::new("scene.pbrt").to_owned(),
        load: LoadOptions::with_integrator(renderer),
        samples: Some(samples),
        execution: Execution::on_threads(2),
        ..RenderRequest::default()
    };
    let result = render_scene_from(&request, &MemoryFiles(files.into()));
    result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false)))
}

/// The number of samples that a renderer drops, all caused by one method.
#[track_caller]
fn check(camera: &str, world: &str, renderer: &str, class: &str, method: &str) -> u64 {
    let RenderResult { statistics, warnings, image, .. } = render(camera, world, renderer);
    let (name, dropped) = (renderer, statistics.dropped_samples);
    assert!((400..625).contains(&dropped), "{name}: {dropped} of 1024 are not about half");
    let named: Vec<(&str, &str)> =
        statistics.not_finite.iter().map(|it| (&*it.class, it.method)).collect();
    assert_eq!(named, [(class, method)], "{name}");
    let text = warnings.to_text(false);
    assert!(text.contains(&format!("[W0630]: {dropped} samples are not finite")), "{name}: {text}");
    assert!(image.pixels.iter().flatten().all(|channel| channel.is_finite()), "{name}");
    dropped
}

/// Both renderers drop the same samples; the methods that they call differ.
#[track_caller]
fn check_both(camera: &str, world: &str, class: &str, [interactive, batch]: [&str; 2]) {
    let one = check(camera, world, INTERACTIVE, class, interactive);
    let other = check(camera, world, BATCH, class, batch);
    assert_eq!(one, other);
}

#[test]
fn textures_count_as_their_material() {
    let wall = format!(
        "Texture \"broken\" \"spectrum\" \"BrokenTexture\"
        Material \"Lambertian\" \"texture kd\" \"broken\" {WALL}"
    );
    check_both(FRONT, &format!("{SUN}{wall}"), "Lambertian", ["shade", "BSDF"]);
    // Without a light to sample, paths continue by it.
    check(FRONT, &wall, BATCH, "Lambertian", "sampleBSDF");
}

#[test]
fn lights_are_named_for_their_samples() {
    for light in ["BrokenLight", "BrokenDensity"] {
        let world = format!("LightSource \"{light}\"\nMaterial \"Lambertian\" {WALL}");
        check_both(FRONT, &world, light, ["illumination"; 2]);
    }
}

#[test]
fn light_that_something_is_in_the_way_of_spoils_nothing() {
    let world = format!(
        "LightSource \"BrokenLight\"\nMaterial \"Lambertian\" {WALL}
        AttributeBegin Translate 0 0 -6 {WALL} AttributeEnd"
    );
    for renderer in [INTERACTIVE, BATCH] {
        let RenderResult { statistics, warnings, .. } = render(FRONT, &world, renderer);
        assert_eq!(statistics.dropped_samples, 0, "{}", renderer);
        assert!(warnings.is_empty(), "{}", warnings.to_text(false));
    }
}

#[test]
fn what_emits_is_named() {
    // The interactive renderer calls the `shade` that a material without one has.
    check_both(FRONT, "Shape \"BrokenLamp\"", "BrokenLamp", ["shade", "emission"]);
    let around = "Camera \"Pinhole\" \"float fov\" 60";
    check_both(around, "LightSource \"BrokenSky\"", "BrokenSky", ["emission"; 2]);
}

#[test]
fn cameras_are_named_for_their_weights() {
    let camera = "Translate 0 0 5 Camera \"BrokenCamera\"";
    let world = format!("{SUN} Material \"Lambertian\" {WALL}");
    check_both(camera, &world, "BrokenCamera", ["generateRay"; 2]);
}

#[test]
fn materials_are_named_for_what_they_scatter() {
    let wall = |material: &str| format!("{SUN} Material \"{material}\" {WALL}");
    check_both(FRONT, &wall("BrokenBSDF"), "BrokenBSDF", ["shade", "BSDF"]);
    check_both(FRONT, &wall("BrokenShade"), "BrokenShade", ["shade"; 2]);
}

/// A mirror that shows the cause is not blamed.
#[test]
fn what_shows_it_is_not_named_for_it() {
    let world = format!(
        "Material \"Mirror\" {WALL}
        AttributeBegin Translate 0 0 -6 Shape \"BrokenLamp\" AttributeEnd"
    );
    check_both(FRONT, &world, "BrokenLamp", ["shade", "emission"]);
}

#[test]
fn the_warning_says_what_to_look_for() {
    let RenderResult { statistics, warnings, .. } = render(FRONT, "Shape \"BrokenLamp\"", BATCH);
    let dropped = statistics.dropped_samples.to_string();
    let text = warnings.to_text(false).replace(&dropped, "N");
    expect![[r#"
        warning[W0630]: N samples are not finite and count as black
         = note: `emission` of `BrokenLamp` returned N values that are not finite
         = help: check these methods and their textures for divisions by 0, for roots and logarithms of negative numbers, and for numbers beyond 3e38

    "#]].assert_eq(&text);
    let json = statistics.to_json();
    assert!(json.contains(&format!("\"dropped_samples\": {dropped}")), "{json}");
    assert!(json.contains("\"class\": \"BrokenLamp\""), "{json}");
}

/// Causes are looked for in so many samples only; the warning says that there are more.
#[test]
fn many_samples_of_one_cause_are_told_once() {
    let RenderResult { statistics, warnings, .. } =
        render_samples(FRONT, "Shape \"BrokenLamp\"", BATCH, 64);
    let dropped = statistics.dropped_samples;
    let [cause] = statistics.not_finite.as_slice() else { panic!("{:?}", statistics.not_finite) };
    assert_eq!((cause.method, cause.count), ("emission", 4096));
    let note = format!("the methods were not looked for in {} other samples", dropped - 4096);
    assert!(dropped > 4096 && warnings.to_text(false).contains(&note), "{dropped} {note}");
}
