//! Lights that no traced ray hits: both renderers show the same, independent of how a material divides light between
//! samples and rays.

use std::path::PathBuf;

use rtsl_render::request::render_scene_from;
use rtsl_render::{RenderRequest, Renderer};
use rtsl_scene::reader::MemoryFiles;

/// A rectangle whose samples have a density, and that no ray finds: it has no `emission`.
const PANEL: &str = "class Panel : rt_Light;
public vec3 corner = vec3(-2.0, 2.0, -2.0);
void illumination() {
    vec3 d = corner + vec3(4.0 * rand(), 0.0, 4.0 * rand()) - rt_HitPoint;
    rt_LightDistance = length(d);
    rt_LightDirection = d / rt_LightDistance;
    if (d.y <= 0.0) return;
    rt_LightColor = color(10.0);
    rt_PDF = dot(d, d) / (rt_LightDirection.y * 16.0);
}";

/// The mean of the picture of a floor under a light.
fn mean(light: &str, material: &str, renderer: Renderer) -> f64 {
    let scene = format!(
        "LookAt 0 4 -9  0 0.7 0  0 1 0\nCamera \"Pinhole\" \"float fov\" 40
        Film \"rgb\" \"integer xresolution\" 32 \"integer yresolution\" 20
        Sampler \"stratified\" \"integer pixelsamples\" 81\nWorldBegin
        LightSource {light}\nMaterial {material}\nShape \"Plane\""
    );
    let files = [("scene.pbrt", scene.as_str()), ("panel.rtsl", PANEL)];
    let files = files.map(|(name, text)| (PathBuf::from(name), text.to_owned()));
    let request = RenderRequest {
        scene: "scene.pbrt".into(),
        renderer: Some(renderer),
        ..RenderRequest::default()
    };
    let result = render_scene_from(&request, &MemoryFiles(files.into()));
    let image = result.unwrap_or_else(|messages| panic!("{}", messages.to_text(false))).image;
    let sum: f64 = image.pixels.iter().map(|pixel| f64::from(pixel[0])).sum();
    sum / image.pixels.len() as f64
}

#[track_caller]
fn check(light: &str, material: &str) {
    let [shaded, traced] =
        [Renderer::Interactive, Renderer::Batch].map(|it| mean(light, material, it));
    assert!(traced > 0.05, "{material}: {traced}");
    assert!((shaded - traced).abs() < 0.03 * traced, "{material}: {shaded} {traced}");
}

#[test]
fn both_renderers_light_highlights_by_a_panel() {
    for material in [
        "\"Conductor\" \"rgb reflectance\" [0.8 0.8 0.8] \"float roughness\" 0.3",
        "\"Principled\" \"float metallic\" 1 \"float roughness\" 0.5",
        "\"Ward\"",
        "\"Phong\"",
        "\"CoatedDiffuse\" \"float roughness\" 0.4",
    ] {
        check("\"Panel\"", material);
    }
}

/// Light that rays find is not counted twice.
#[test]
fn both_renderers_light_highlights_by_a_sky() {
    for material in ["\"Ward\"", "\"Phong\""] {
        check("\"ConstantSky\"", material);
    }
}
