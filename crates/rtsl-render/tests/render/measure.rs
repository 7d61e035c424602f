//! Measuring a scene: the kinds of rays, and their counts. Times are not tested.

use std::path::Path;
use std::time::Duration;

use rtsl_render::measure::{Effort, SceneMeasurement, measure_scene};
use rtsl_render::{Execution, RenderRequest};

fn measure(name: &str, world: &str, threads: usize) -> SceneMeasurement {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let path = folder.join(name).with_extension("pbrt");
    let head = "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"Orthographic\" \"float scale\" 2\n";
    std::fs::write(&path, format!("{head}WorldBegin\n{world}")).unwrap();
    let request = RenderRequest {
        scene: path,
        size: Some((100, 100)),
        execution: Execution::on_threads(threads),
        ..RenderRequest::default()
    };
    let effort = Effort { repetitions: 4, time: Duration::from_secs(600) };
    let measured = measure_scene(&request, effort);
    measured.unwrap_or_else(|messages| panic!("{}", messages.to_text(false))).0
}

#[test]
fn every_kind_of_ray_is_counted() {
    let world = "LightSource \"infinite\"\nMaterial \"diffuse\"\nShape \"sphere\"";
    for threads in [1, 2] {
        let measured = measure("sphere", world, threads);
        assert_eq!((measured.primitives, measured.threads), (1, threads));
        let kinds: Vec<&str> = measured.rays.iter().map(|rays| rays.kind).collect();
        assert_eq!(kinds, ["primary", "shadow", "secondary", "random"]);
        let [primary, shadow, secondary, random] = &measured.rays[..] else { panic!() };
        assert_eq!([primary.rays, random.rays], [10_000, 169 * 64]);
        // The sphere's disk has 0.196 of the image, and its rays see no more of the sphere.
        assert!((primary.hits - std::f64::consts::PI / 16.0).abs() < 0.005, "{}", primary.hits);
        let on_sphere = (primary.hits * 10_000.0).round() as u64;
        assert_eq!([shadow.rays, secondary.rays], [on_sphere; 2]);
        // Except for rays that graze it within rounding.
        assert!(shadow.hits + secondary.hits < 0.01, "{} {}", shadow.hits, secondary.hits);
        // Of lines from points of the cube around it, most do not meet the sphere; all from inside do.
        assert!((0.6..0.8).contains(&random.hits), "{}", random.hits);
        assert!(measured.rays.iter().all(|rays| rays.repetitions == 4));
        assert_eq!(measured.frame.rays, 10_000 + on_sphere);
        assert_eq!(measured.frame.repetitions, 4);
    }
}

#[test]
fn kinds_that_a_scene_lacks_are_left_out() {
    let measured = measure("plane", "Rotate 90 1 0 0\nShape \"Plane\"", 1);
    // Nothing lights it, and there is no cube around what is unbounded.
    let kinds: Vec<&str> = measured.rays.iter().map(|rays| rays.kind).collect();
    assert_eq!(kinds, ["primary", "secondary"]);
}

#[test]
fn results_are_one_line_of_json_or_a_table() {
    let measured = measure("empty", "Shape \"sphere\"", 1);
    let json: serde_json::Value = serde_json::from_str(&measured.to_json()).unwrap();
    assert_eq!(json["rays"][0]["kind"], "primary");
    assert_eq!(json["rays"][0]["rays"], 10_000);
    assert!(json["rays"][0]["millionRaysPerSecond"]["median"].as_f64().unwrap() > 0.0);
    assert!(json["frame"]["milliseconds"]["ninetiethPercentile"].as_f64().unwrap() > 0.0);
    let text = measured.to_text();
    assert_eq!(text.lines().count(), 7, "{text}");
}
