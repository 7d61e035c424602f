//! The scenes of the pbrt-v4 adapter, with RTSL's names for the classes that pbrt finds in a library, load and have the
//! light that pbrt found in them.

use std::path::{Path, PathBuf};

use rtsl_render::{Execution, RenderRequest, render_scene};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../integrations/pbrt-v4/scenes")
}

/// The parameters before the name of a class in scenes for pbrt.
const LIBRARY: &str = "\"rtsl\" \"string library\" \"shaders.so\" \"string class\" ";

/// Compares the mean of a small picture's pixels with pbrt's.
#[track_caller]
fn check(name: &str, expected: f64) {
    let text = std::fs::read_to_string(folder().join(format!("{name}.rtsl.pbrt")));
    let text = text.expect("the scene is there");
    assert!(text.contains(LIBRARY), "{name} has no class of a library");
    let scene = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.pbrt"));
    std::fs::write(&scene, text.replace(LIBRARY, "")).expect("the scene can be written");
    let request = RenderRequest {
        scene,
        size: Some((32, 24)),
        samples: Some(32),
        execution: Execution::on_threads(2),
        ..RenderRequest::default()
    };
    let fail = |messages: rtsl::Messages| panic!("{name}: {}", messages.to_text(false));
    let image = render_scene(&request).unwrap_or_else(fail).image;
    let sum: f64 = image.pixels.iter().flatten().map(|channel| f64::from(*channel)).sum();
    let mean = sum / (3 * image.pixels.len()) as f64;
    assert!((mean / expected - 1.0).abs() < 0.03, "{name}: {mean}, not {expected}");
}

#[test]
fn scenes_have_the_light_that_pbrt_found() {
    let expected = [
        ("checker", 0.2418),
        ("color", 0.2328),
        ("dielectric", 0.2551),
        ("glow", 0.3446),
        ("lens", 0.2605),
        ("schlick", 0.2543),
        ("showcase", 0.3031),
        ("sky", 0.3174),
        ("sphere", 0.2601),
        ("spot", 0.0983),
        ("ward", 0.2463),
    ];
    for (name, mean) in expected {
        check(name, mean);
    }
    let entries = std::fs::read_dir(folder()).expect("there are scenes");
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let count = names.filter(|name| name.ends_with(".rtsl.pbrt")).count();
    assert_eq!(count, expected.len(), "a scene is not checked");
}
