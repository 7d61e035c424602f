//! The scenes that are compared with Mitsuba's load and have the light that both systems found in them.

use std::path::{Path, PathBuf};

use rtsl_image::Image;
use rtsl_render::{Execution, RenderRequest, render_scene};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("mitsuba/scenes")
}

fn render(scene: PathBuf) -> Image {
    let request = RenderRequest {
        scene,
        size: Some((24, 24)),
        samples: Some(16),
        execution: Execution::on_threads(2),
        ..RenderRequest::default()
    };
    let fail = |messages: rtsl::Messages| panic!("{}", messages.to_text(false));
    let result = render_scene(&request).unwrap_or_else(fail);
    assert_eq!(result.statistics.dropped_samples, 0);
    result.image
}

/// Compares the mean of the picture's pixels, within a few standard errors of so small a render.
#[track_caller]
fn check(image: &Image, expected: [f64; 3], allowed: f64) {
    for (channel, expected) in expected.into_iter().enumerate() {
        let sum: f64 = image.pixels.iter().map(|pixel| f64::from(pixel[channel])).sum();
        let mean = sum / image.pixels.len() as f64;
        assert!((mean - expected).abs() < allowed, "channel {channel}: {mean}, not {expected}");
    }
}

#[test]
fn metals() {
    check(&render(folder().join("metals.pbrt")), [0.3688, 0.4163, 0.5191], 0.02);
}

#[test]
fn metals_under_a_square_lamp() {
    check(&render(folder().join("metals_area.pbrt")), [0.3492, 0.3985, 0.5030], 0.02);
}

#[test]
fn cornell_box() {
    check(&render(folder().join("cornell_box.pbrt")), [0.2401, 0.1411, 0.0600], 0.02);
}

/// A ball in place of the many that fills the picture and, convex and evenly lit, shows its own colour.
#[test]
fn spheres() {
    for name in ["spheres", "spheres_10k"] {
        let place = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let scene = place.join(format!("{name}.pbrt"));
        let original = folder().join(format!("{name}.pbrt"));
        std::fs::copy(original, &scene).expect("the scene can be copied");
        let ball = "MakeNamedMaterial \"color 0\" \"string type\" \"diffuse\" \"rgb reflectance\" [0.2 0.4 0.6]
            AttributeBegin NamedMaterial \"color 0\" Shape \"sphere\" \"float radius\" 25 AttributeEnd";
        let list = place.join(format!("{name}_list.pbrt"));
        std::fs::write(list, ball).expect("the list can be written");
        check(&render(scene), [0.2, 0.4, 0.6], 0.01);
    }
}
